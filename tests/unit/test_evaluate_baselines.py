"""Baselines on the bench excavator: what they say, and that their sweeps are the machine's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.assembly import Machine, load_machine
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.core.sweep_limit import sweep_limit
from rampe_guard.core.types import Certificate, FloatArray
from rampe_guard.evaluate.baselines import (
    DESCRIPTIONS,
    LONGEST_S,
    PRIMITIVE,
    STOPPING,
    USUAL,
    proximity_name,
    raw,
    traces,
    velocity_name,
)
from rampe_guard.evaluate.touch import Touch, _limit_clearance, _limit_fraction
from rampe_guard.evaluate.walk import Moment
from rampe_guard.settings import load_site
from tests.support.processes import BENCH

ZONES = ("crate", "ceiling", "slew-left", "slew-right")
LEFT, RIGHT = 1.3, 0.02
MIDDLE = np.array([0.6, 0.05, 0.05, 0.05])


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(load_site(BENCH))


def moment(q: FloatArray, velocity: FloatArray, **more: FloatArray) -> Moment:
    nothing = np.zeros(4)
    return replace(
        Moment(0.0, q, velocity, stopping=nothing, intent=None, mean=nothing),
        **more,  # type: ignore[arg-type]
    )


EDGE = st.none() | st.integers(-4, 4).map(lambda k: k / 2)
PLACE = st.integers(-12, 12).map(lambda k: k / 4)


@given(EDGE, EDGE, PLACE, PLACE)
def test_limits_in_closed_form_are_the_guards(
    above: float | None, below: float | None, q: float, x: float
) -> None:
    zone = ActuatorLimit(name="wall", actuator=0, above=above, below=below)
    if above is None and below is None:
        return
    swept = sweep_limit(zone, np.array([q]), np.array([x]))
    free = swept.certificate is Certificate.FREE or (swept.inside and not swept.closing)
    fraction = _limit_fraction(zone, np.array([q]), np.array([x]))[0]
    assert fraction == (np.inf if free else swept.contact_fraction)
    assert _limit_clearance(zone, np.array([q]))[0] == swept.clearance_now_m


def test_first_contacts_are_those_of_the_machines_sweep(machine: Machine) -> None:
    rng = np.random.default_rng(3)
    touch = Touch(machine.sweeper, ZONES)
    low, high = machine.arm.limits.T
    low, high = np.maximum(low, -0.5), np.minimum(high, 1.6)
    start, end = (low + rng.random((40, 4)) * (high - low) for _ in range(2))
    found = touch.first(start, end - start)
    touched = 0
    for row in range(40):
        for z, zone in enumerate(machine.sweeper.sweep(start[row], end[row] - start[row]).zones):
            free = zone.certificate is Certificate.FREE or (zone.inside and not zone.closing)
            assert zone.zone == ZONES[z]
            if free:
                assert np.isinf(found[row, z])
            else:
                assert found[row, z] == pytest.approx(zone.contact_fraction, abs=2e-3)
                touched += 1
        now = touch.clearance(start[row : row + 1])[0]
        for z, zone in enumerate(machine.sweeper.sweep(start[row], np.zeros(4)).zones):
            assert now[z] == zone.clearance_now_m
    assert touched > 40


def test_constant_velocity_reaches_a_limit_when_it_does(machine: Machine) -> None:
    touch = Touch(machine.sweeper, ("slew-left", "slew-right"))
    speed = np.array([0.4, 0.0, 0.0, 0.0])
    told = raw([moment(MIDDLE, speed), moment(MIDDLE, -speed)], touch, machine.arm.limits)
    assert told.contact_s == pytest.approx(
        np.array([[(LEFT - 0.6) / 0.4, np.inf], [np.inf, (0.6 - RIGHT) / 0.4]])
    )


def test_an_actuator_at_its_end_does_not_hold_back_the_others(machine: Machine) -> None:
    """The boom is at its end after 0.1 s; the swing goes on to the limit all the same."""
    touch = Touch(machine.sweeper, ("slew-left",))
    end = machine.arm.limits[1, 1]
    q = np.array([0.6, end - 0.002, 0.05, 0.05])
    speed = np.array([0.4, 0.02, 0.0, 0.0])
    told = raw([moment(q, speed)], touch, machine.arm.limits)
    assert told.contact_s[0, 0] == pytest.approx((LEFT - 0.6) / 0.4)
    at_end = replace(moment(q, speed), q=np.array([0.6, end, 0.05, 0.05]))
    again = raw([at_end], touch, machine.arm.limits)
    assert again.contact_s[0, 0] == pytest.approx((LEFT - 0.6) / 0.4)


def test_what_is_beyond_the_longest_horizon_is_no_contact(machine: Machine) -> None:
    touch = Touch(machine.sweeper, ("slew-left",))
    slow = np.array([(LEFT - 0.6) / (LONGEST_S + 0.1), 0.0, 0.0, 0.0])
    assert np.isinf(raw([moment(MIDDLE, slow)], touch, machine.arm.limits).contact_s).all()


def test_each_baseline_says_what_its_name_promises(machine: Machine) -> None:
    touch = Touch(machine.sweeper, ("slew-left",))
    near = np.array([LEFT - 0.08, 0.05, 0.05, 0.05])
    still = np.zeros(4)
    there = np.array([0.2, 0.0, 0.0, 0.0])
    moments = [
        moment(near, still),
        moment(near, np.array([0.1, 0.0, 0.0, 0.0])),  # there in 0.8 s
        replace(moment(near, still), stopping=there),
        replace(moment(near, still), mean=there),
        replace(moment(near, still), mean=-there),
    ]
    moments = [replace(m, time_s=0.1 * k) for k, m in enumerate(moments)]
    made = traces(raw(moments, touch, machine.arm.limits), np.array([1.0]))
    assert list(made) == list(DESCRIPTIONS)
    scores = {name: trace.score[:, 0].tolist() for name, trace in made.items()}
    assert scores[velocity_name(0.75)] == [0, 0, 0, 0, 0]
    assert scores[velocity_name(1.0)] == [0, 1, 0, 0, 0]
    assert scores[proximity_name(0.05)] == [0, 0, 0, 0, 0]
    assert scores[proximity_name(0.10)] == [1, 1, 1, 1, 1]
    assert scores[USUAL] == [0, 0, 0, 1, 0]
    assert scores[PRIMITIVE] == [0, 0, 0, 0, 0]
    for name in (STOPPING, PRIMITIVE, USUAL):
        assert made[name].floor[:, 0].tolist() == [False, False, True, False, False]
    assert not made[velocity_name(1.0)].floor.any()


def test_zones_that_a_step_concerns(machine: Machine) -> None:
    touch = Touch(machine.sweeper, ZONES)
    positions = np.tile(MIDDLE, (4, 1))
    positions[:, 0] = [0.6, 1.2, LEFT + 0.01, 0.6]
    asked = touch.near(positions, 0.0005)
    limits = [sorted(zones & {"slew-left", "slew-right"}) for zones in asked]
    assert limits == [[], [], ["slew-left"], ["slew-left"]]
    assert all({"crate", "ceiling"} <= zones for zones in asked)
