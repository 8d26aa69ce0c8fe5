"""What a new site file says of an actuator: which values are believed, which are to do."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from rampe_guard.collision.urdf_joints import MovableJoint
from rampe_guard.core.identify import Estimate, Measured
from rampe_guard.core.identify_axis import Lever
from rampe_guard.programs.initing_plan import ActuatorPlan, plan

JOINT = MovableJoint("boom", "revolute", -1.0, 2.0, 1.2, "base", "boom", 0)
KNOWN = Lever(0, 1, 0.9, 0.2)
SEEN = Measured(
    moved=True,
    lever=KNOWN,
    seen=(-0.5, 1.5),
    deadband=Estimate(0.05, 4, "so"),
    lag_s=Estimate(0.2, 4, "so"),
    max_velocity=Estimate(0.5, 2, "so"),
    max_deceleration=Estimate(1.0, 4, "so"),
)


def _plan(seen: Measured, joint: MovableJoint = JOINT) -> ActuatorPlan:
    return plan([joint], ["boom"], [seen], {}, 1)[0]


def test_what_was_measured_is_believed() -> None:
    one = _plan(SEEN)
    assert one.max_velocity.value == pytest.approx(0.525)
    assert one.deadband.value == 0.05
    assert not one.max_velocity.todo
    assert not one.deadband.todo
    assert one.problems == ()


def test_a_speed_by_no_known_lever_is_not_believed() -> None:
    """It may have been a slow push, or the shaking of an arm that another lever moved."""
    unknown = replace(SEEN, lever=Lever(None, 0, 0.1, 0.2, "no lever explains its motion"))
    one = _plan(replace(unknown, max_velocity=Estimate(0.011, 2, "so")))
    assert one.max_velocity.todo
    assert one.max_velocity.value == 1.2  # of the URDF
    fast = _plan(replace(unknown, max_velocity=Estimate(3.0, 2, "so")))
    assert fast.max_velocity.todo
    assert fast.max_velocity.value == pytest.approx(3.15)
    nothing = _plan(unknown, replace(JOINT, velocity=None))
    assert nothing.max_velocity.value == 1.0


def test_a_deadband_beyond_that_of_levers_is_not_believed() -> None:
    one = _plan(replace(SEEN, deadband=Estimate(0.447, 4, "so")))
    assert one.deadband.todo
    assert one.deadband.value == 0.3
    assert _plan(replace(SEEN, deadband=Estimate(0.1, 0, "no motion"))).deadband.todo


@pytest.mark.parametrize(
    ("kind", "ends", "seen", "said"),
    [
        ("revolute", (-1.0, 2.0), (28.6, 88.3), "degrees? Of a CSV log, --actuators COLUMN:0.0174"),
        ("prismatic", (0.0, 0.5), (3.0, 48.0), "centimetres?"),
        ("prismatic", (0.0, 0.5), (30.0, 480.0), "millimetres?"),
        ("revolute", (-1.0, 2.0), (1.5, 2.5), "another joint, another unit, or a cylinder"),
        ("revolute", (-math.inf, math.inf), (0.0, 1.0), "it is taken as endless: if it has ends"),
    ],
)
def test_positions_where_the_joint_cannot_be_are_told(
    kind: str, ends: tuple[float, float], seen: tuple[float, float], said: str
) -> None:
    one = _plan(replace(SEEN, seen=seen), replace(JOINT, kind=kind, lower=ends[0], upper=ends[1]))
    (problem,) = one.problems
    assert said in problem
