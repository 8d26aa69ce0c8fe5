"""Well-known arms among boxes: whatever pinocchio and coal find, the sweep finds.

`python -m tests.benchmarks.robots --check` does ten times as much.
"""

from __future__ import annotations

import pytest

from rampe_guard.core.types import Certificate, ZoneSweep
from tests.support.depth import NIGHTLY
from tests.support.machines import AbsentError
from tests.support.robots import named
from tests.support.robots_check import Found, check, judge

ARMS = (
    "panda_description/panda",
    "ur_description/ur5_robot",
    "xarm_description/xarm7",
    "kinova_description/kinova",
    "zx200",
)


@pytest.mark.skipif(not NIGHTLY, reason="half a minute each: RAMPE_GUARD_TESTS=nightly")
@pytest.mark.parametrize("name", ARMS)
def test_another_sees_no_contact_that_the_sweep_does_not(name: str) -> None:
    for library in ("pinocchio", "coal"):
        pytest.importorskip(library, reason="tests/benchmarks/robots-requirements.txt")
    try:
        robot = named(name)
    except AbsentError as why:
        pytest.skip(str(why))
    found = check(robot, motions=20, boxes=30, seed=2)
    assert found.motions == 20
    assert found.contacts >= 1
    assert found.pose < 1e-9
    assert not found.stories


@pytest.mark.parametrize(
    ("certificate", "said", "seen", "fault"),
    [
        (Certificate.FREE, None, 0.5, "missed"),
        (Certificate.CONTACT, 0.51, 0.5, "late"),
        (Certificate.UNKNOWN, 0.0, None, "unknown"),
        (Certificate.CONTACT, 0.49, 0.5, None),
        (Certificate.FREE, None, None, None),
    ],
)
def test_the_comparison_catches_what_it_says(
    certificate: Certificate, said: float | None, seen: float | None, fault: str | None
) -> None:
    found = Found()
    zone = ZoneSweep("box", certificate, said, "link", None, None, None, closing=True)
    judge(found, zone, seen, "motion 0")
    assert [story.split(":")[0] for story in found.stories] == ([fault] if fault else [])
    assert found.faults == bool(fault)
