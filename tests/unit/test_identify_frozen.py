"""Logs in which positions froze, levers were never moved, or time leaps: nothing is made of it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.identify import Traces, identify
from rampe_guard.core.identify_frozen import frozen
from rampe_guard.core.identify_signals import signals_of
from tests.support import small_arm


@pytest.fixture(scope="module")
def traces() -> Traces:
    moments = small_arm.ticks()
    times = np.array([tick.time_s for tick in moments])
    axes = np.array([tick.axes for tick in moments])
    return Traces(times, axes, times, np.array([tick.position for tick in moments]))


def _held(traces: Traces, from_s: float, columns: slice = slice(None)) -> Traces:
    """The same with positions that hang from some time on."""
    position = traces.position.copy()
    at = int(np.searchsorted(traces.time_s, from_s))
    position[at:, columns] = position[at, columns]
    return replace(traces, position=position)


def test_positions_that_froze_are_told_and_nothing_is_made_of_them(traces: Traces) -> None:
    half_s = 0.4 * float(traces.time_s[-1])  # turn was moved, lift half, reach not yet
    turn, lift, reach = identify(_held(traces, half_s))
    for one in (turn, lift, reach):
        assert any(f"stood still to the last digit from {half_s:.0f} to" in p for p in one.problems)
    assert (turn.lever.axis, turn.lever.sign) == (2, 1)
    assert not reach.moved  # else noise would be its motion
    assert reach.max_velocity is None
    whole = identify(traces)[0]
    assert (turn.max_velocity, turn.lag_s, turn.deadband) == (
        whole.max_velocity,
        whole.lag_s,
        whole.deadband,
    )
    for one, true in ((turn, small_arm.ACTUATORS[0]), (lift, small_arm.ACTUATORS[1])):
        assert one.deadband is None or one.deadband.value < true.deadband + 0.02


def test_one_sensor_that_froze_is_told_of_itself_only(traces: Traces) -> None:
    late_s = 0.55 * float(traces.time_s[-1])
    turn, lift, reach = identify(_held(traces, late_s, slice(1, 2)))
    assert turn.problems == ()
    assert any("stood still" in problem for problem in lift.problems)
    assert not any("stood still" in problem for problem in reach.problems)
    assert lift.deadband is None or lift.deadband.value < small_arm.ACTUATORS[1].deadband + 0.02


def test_rest_is_not_frozen() -> None:
    """Of a sensor without noise, and after a push against an end stop."""
    times = np.arange(0.0, 10.0, 0.02)
    lever = np.where((times > 2.0) & (times < 5.0), 1.0, 0.0)
    position = np.clip(times - 2.2, 0.0, 1.0)  # at its end from 3.2 s on
    assert frozen(times, position[:, None], times, lever[:, None], 0.5) == []
    stood = frozen(times, np.zeros((len(times), 1)), times, lever[:, None], 0.5)
    assert stood == [(0, len(times) - 1)]


def test_levers_that_never_moved_are_told(traces: Traces) -> None:
    for value in (0.0, 1.0):
        still = replace(traces, axes=np.full_like(traces.axes, value))
        for one in identify(still):
            assert one.lever.axis is None
            assert "no lever was moved" in one.problems[0]


def test_positions_too_far_apart_are_told(traces: Traces) -> None:
    few = slice(None, None, 60)
    found = identify(replace(traces, time_s=traces.time_s[few], position=traces.position[few]))
    assert any("positions are 1.2 s apart" in one.problems[0] for one in found)


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e9])
def test_a_grid_costs_no_more_than_what_was_heard(traces: Traces, factor: float) -> None:
    """Time in another unit than seconds, whoever lets it come so far."""
    wrong = replace(traces, time_s=traces.time_s * factor, lever_s=traces.lever_s * factor)
    began_s = time.process_time()
    signals = signals_of(wrong)
    assert time.process_time() - began_s < 10.0
    assert signals is not None
    assert len(signals.time_s) <= 180_000


def test_a_leap_of_the_clock_hides_nothing_before_it(traces: Traces) -> None:
    leap = np.where(traces.time_s > 20.0, 1.7e9, 0.0)
    whole = identify(traces)
    found = identify(replace(traces, time_s=traces.time_s + leap, lever_s=traces.lever_s + leap))
    for one, other in zip(whole, found, strict=True):
        assert one.lever.axis == other.lever.axis
        assert one.max_velocity is not None
        assert other.max_velocity is not None
        assert other.max_velocity.value == pytest.approx(one.max_velocity.value, rel=0.05)
