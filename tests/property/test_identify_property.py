"""Simulated machines are measured as they were made, each value on its safe side."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.identify import Traces, identify
from rampe_guard.simulate.exercise import exercise
from rampe_guard.simulate.machine import build_machine
from tests.support.depth import NIGHTLY, depth

RATES = (20.0, 50.0, 100.0) if NIGHTLY else (20.0, 50.0)


@st.composite
def machines(draw: st.DrawFn) -> tuple[ActuatorConfig, ...]:
    """One to four actuators, their levers in any order, some reversed."""
    count = draw(st.integers(1, 4))
    axes = draw(st.permutations(range(count)))
    found = []
    for j in range(count):
        speed = draw(st.floats(0.1, 1.0))
        found.append(
            ActuatorConfig(
                f"a{j}",
                axes[j],
                draw(st.sampled_from((-1, 1))),
                speed,
                draw(st.floats(1.0, 5.0)) * speed,
                draw(st.floats(0.05, 0.35)),
                draw(st.floats(0.02, 0.2)),
                "m",
            )
        )
    return tuple(found)


@settings(max_examples=depth(3, 60), deadline=None, derandomize=True)
@given(machines(), st.sampled_from(RATES))
def test_a_machine_is_measured_as_it_was_made(
    actuators: tuple[ActuatorConfig, ...], rate_hz: float
) -> None:
    machine = build_machine(actuators, [(0.0, 2.0)] * len(actuators))
    ticks = list(exercise(actuators, machine, rate_hz=rate_hz, pushes=2))
    times = np.array([tick.time_s for tick in ticks])
    axes, position = (np.array([getattr(t, what) for t in ticks]) for what in ("axes", "position"))
    measured = identify(Traces(times, axes, times, position))
    for true, seen in zip(actuators, measured, strict=True):
        assert seen.moved
        assert (seen.lever.axis, seen.lever.sign) == (true.axis, true.sign)
        assert seen.max_velocity is not None
        assert seen.max_velocity.value <= 1.15 * true.max_velocity
        if seen.max_velocity.events:  # else it was still rising when the lever was let go
            assert seen.max_velocity.value >= 0.9 * true.max_velocity
        assert seen.lag_s is not None
        period_s = 1.0 / rate_hz
        assert true.lag_s - period_s <= seen.lag_s.value <= true.lag_s + 0.15 + 2.0 * period_s
        if seen.deadband is not None:
            assert 0.0 < seen.deadband.value <= true.deadband + 0.02
        if seen.max_deceleration is not None:
            most = 1.1 * true.max_deceleration
            assert 0.35 * true.max_deceleration <= seen.max_deceleration.value <= most
            # the stop that the guard will forecast is no shorter than that of the machine
            stop = _stop(seen.lag_s.value, seen.max_velocity.value, seen.max_deceleration.value)
            if seen.max_velocity.events:
                assert stop >= 0.9 * _stop(true.lag_s, true.max_velocity, true.max_deceleration)


def _stop(lag_s: float, speed: float, deceleration: float) -> float:
    """How far it runs on from its top speed [unit]."""
    return speed * lag_s + speed * speed / (2.0 * deceleration)
