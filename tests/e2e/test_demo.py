"""``rampe-guard demo`` as a newcomer runs it, but on a pipe."""

from __future__ import annotations

import re
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rampe_guard.settings import load_site
from tests.support.processes import DEMO, Identity, Process, living, until, watched_family
from tests.support.tap import Document, Tap

pytestmark = pytest.mark.e2e

END_S = 5.0
PARTS = 5
"""The demo itself, router, guard and its supervisor, operator."""


def wait_to_end(demo: Process, note: Callable[[], set[Identity]], within_s: float) -> None:
    deadline = time.monotonic() + within_s
    while demo.alive:
        note()
        assert time.monotonic() < deadline, f"the demo runs on:\n{demo.out}\n{demo.err}"
        time.sleep(0.1)


@dataclass
class Run:
    """A demo of one cycle, over: what it printed, left behind and published."""

    demo: Process
    folder: Path
    family: set[Identity]
    tap: Tap
    document: Document
    parameters: dict[str, str]
    state: Any


@pytest.fixture(scope="module")
def one_cycle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    folder = tmp_path_factory.mktemp("demo")
    keys = load_site(DEMO).keys
    parameters = {"joystick": keys.joystick, "actuators": keys.actuators, "base": keys.base}
    args = ["-m", "rampe_guard", "demo", "--cycles", "1", "--obey"]
    with Process(folder, "demo", args) as demo, watched_family(demo) as note:
        demo.wait_for("watching")
        (endpoint,) = re.findall(r"--connect (\S+)", demo.out)
        with Tap(endpoint, keys.base.rpartition("/")[0]) as tap:
            (state,) = until(lambda: tap.ask(f"{keys.base}/state"), 60.0, "a guard's state")
            wait_to_end(demo, note, 90.0)
            yield Run(demo, folder, note(), tap, Document(), parameters, state)


def test_one_cycle_to_its_summary(one_cycle: Run) -> None:
    demo = one_cycle.demo
    assert demo.popen.returncode == 0, demo.err
    assert len(one_cycle.family) >= PARTS
    assert not living(one_cycle.family)
    assert "lead min" in demo.out
    assert "power-line" in demo.out
    assert "1 cycle" in demo.out
    assert re.search(r"followed the advice: 0 contacts; a cycle took \d+\.\d s", demo.out)
    assert not (one_cycle.folder / "state").exists()  # a simulated operator is not remembered
    assert "Traceback" not in demo.err


def test_everything_on_the_wire_is_as_the_contract_says(one_cycle: Run) -> None:
    """Every message of every program, inputs too: its key, its schema, its quality of service."""
    counts: Counter[str] = one_cycle.tap.check(one_cycle.document, one_cycle.parameters)
    assert set(counts) == {
        "rampe.joystick.v1",
        "rampe.actuators.v1",
        "rampe.alert.v1",
        "rampe.prediction.v1",
        "rampe.advice.v1",
        "rampe.heartbeat.v1",
    }
    assert one_cycle.document.check("state", one_cycle.state, "state") == "rampe.state.v1"


@pytest.mark.parametrize("loading", [True, False], ids=["loading", "watching"])
def test_ctrl_c_ends_it_and_all_its_parts(tmp_path: Path, *, loading: bool) -> None:
    args = ["-m", "rampe_guard", "demo"]
    with Process(tmp_path, "demo", args) as demo, watched_family(demo) as note:
        until(lambda: len(note()) >= PARTS, 40.0, "all parts of the demo")
        if not loading:
            demo.wait_for("watching")
        assert demo.signal_and_wait(signal.SIGINT) <= END_S
        assert demo.popen.returncode == 0, demo.err
        assert not living(note())
        assert ("lead min" in demo.out) is not loading
        assert "Traceback" not in demo.err
