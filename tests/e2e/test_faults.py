"""Faults of the network, of the inputs and of the guard itself; alerts survive all of them.

What every one of them must keep to is judged by `tests.support.ground`: while the arm pushes
against the crate, an alert is shown, or that nobody watches. The deep form, every fault many times,
is ``python -m tests.benchmarks.faults``.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.benchmarks.soak import soak
from tests.support.bench_site import bench_copy
from tests.support.depth import NIGHTLY
from tests.support.faults import FAULTS, suffer
from tests.support.faults_inside import INSIDE, scenes_put
from tests.support.ground import Ground, proving_ground

pytestmark = pytest.mark.e2e

BRIEF = {
    "router killed and restarted": 0.5,
    "guard killed (SIGKILL)": 0.0,
    "inputs flood (10 kHz)": 0.6,
    "messages out of order": 0.5,
    "stamps jump by an hour and back": 1.2,
    "subscriber wedged": 0.5,
    "wall clock set by an hour": 0.5,
}
"""Those that every change goes through, and for how long [s]; nightly, all of them in full."""
BY_NAME = {fault.name: fault for fault in (*FAULTS, *INSIDE)}
SLOW = 4.0
"""How much longer things may take here than promised: other tests run at the same time."""


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    folder = tmp_path_factory.mktemp("ground")
    site = bench_copy(folder, "memory: {save_every_s: 1}", machine="ground")
    with proving_ground(folder, site, clock=folder / "clock") as made:
        yield made


@pytest.mark.parametrize("name", sorted(BY_NAME) if NIGHTLY else sorted(BRIEF))
def test_no_fault_hides_that_the_arm_pushes(ground: Ground, name: str) -> None:
    fault = BY_NAME[name]
    seconds = None if NIGHTLY else BRIEF[name]
    outcome = suffer(ground, fault, random.Random(1), held=True, seconds=seconds, slow=SLOW)
    assert not outcome.broken, outcome.broken
    assert ground.verdict.missed == []
    assert ground.verdict.unexplained == []


@pytest.mark.skipif(not NIGHTLY, reason="a minute: RAMPE_GUARD_TESTS=nightly")
def test_a_thousand_scenes_are_put_while_it_sweeps(ground: Ground) -> None:
    outcome = suffer(ground, scenes_put(1000), random.Random(1), held=True, slow=SLOW)
    assert not outcome.broken, outcome.broken


@pytest.mark.skipif(not NIGHTLY, reason="five minutes: RAMPE_GUARD_TESTS=nightly")
def test_five_minutes_of_work_with_faults(tmp_path: Path) -> None:
    report, running = soak(tmp_path, 300.0, seed=5, every_s=5.0)
    assert len(running.outcomes) >= 5
    assert [line for line in report["failed"] if "memory" not in line and "p99" not in line] == []
    assert {outcome.fault for outcome in running.outcomes} <= set(FAULTS)
