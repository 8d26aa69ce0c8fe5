"""What a machine is like, by what was seen of it: lever, sign, deadband, speed, lag, braking.

For a site engineer who moved each lever once or more. Nothing is guessed: what was not moved, or
cannot be told apart, is None, and ``problems`` says why.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.core.identify_axis import Lever, levers_of, moved
from rampe_guard.core.identify_frozen import frozen
from rampe_guard.core.identify_motion import (
    Estimate,
    Follow,
    deadband,
    deceleration,
    lag,
    top_speed,
)
from rampe_guard.core.identify_signals import (
    GAP_S,
    BoolArray,
    Signals,
    Traces,
    signals_of,
    standing,
)

__all__ = ["DEADBAND_UNSEEN", "Estimate", "Measured", "Traces", "identify"]

DEADBAND_UNSEEN = 0.02
"""Taken where none could be measured: a smaller one warns sooner [-]."""
_ROUNDS = 2
_SHOWN = 3
"""So many stretches are named."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One actuator as it was seen.

    Attributes:
        moved: whether it moved at all.
        lever: which lever moves it, and which way.
        seen: least and greatest position [unit].
        deadband: lever size below which nothing moves [-].
        lag_s: lever to motion [s].
        max_velocity: at full lever [unit/s].
        max_deceleration: after the lever is let go [unit/s²].
        problems: sentences on what could not be measured.
    """

    moved: bool
    lever: Lever
    seen: tuple[float, float]
    deadband: Estimate | None = None
    lag_s: Estimate | None = None
    max_velocity: Estimate | None = None
    max_deceleration: Estimate | None = None
    problems: tuple[str, ...] = ()


def identify(traces: Traces) -> tuple[Measured, ...]:
    """Measure every actuator of ``traces``, in their order; empty if there is too little of it."""
    signals = signals_of(traces)
    if signals is None:
        return ()
    levers = levers_of(signals)
    return tuple(_measured(signals, j, lever) for j, lever in enumerate(levers))


def _measured(signals: Signals, j: int, lever: Lever) -> Measured:
    position = signals.position[:, j]
    seen = (float(position.min()), float(position.max()))
    found = Measured(moved(signals)[j], lever, seen)
    known, stood = _alive(signals, j, lever)
    found = replace(found, problems=(*((lever.problem,) if lever.problem else ()), *stood))
    if not found.moved:
        return found
    axis = lever.axis if lever.sign else None
    unseen = np.zeros(len(position))
    follow = Follow(
        lever=unseen if axis is None else lever.sign * signals.axes[:, axis],
        position=position,
        velocity=signals.velocity[:, j],
        known=known,
        best_lag_s=lever.lag_s,
        lag_s=lever.lag_s,
        noise=float(signals.noise[j]),
        period_s=signals.period_s,
    )
    if axis is None:  # how fast it was is known whatever moved it
        return replace(found, max_velocity=top_speed(follow, DEADBAND_UNSEEN))
    # each needs the other: the lag that explains the motion best holds the time to speed up too
    begins = deadband(follow)
    late = lag(follow, _band(begins))
    for _ in range(_ROUNDS):
        follow = replace(follow, lag_s=late.value)
        begins = deadband(follow)
        late = lag(follow, _band(begins))
    band = _band(begins)
    found = replace(
        found,
        deadband=begins,
        lag_s=late,
        max_velocity=top_speed(follow, band),
        max_deceleration=deceleration(follow, band, late.value),
    )
    missing = [
        text
        for value, text in (
            (begins, "no slow motion at a steady, small lever: deadband not measured"),
            (found.max_deceleration, "no stop after a let-go lever: braking not measured"),
        )
        if value is None
    ]
    return replace(found, problems=(*found.problems, *missing))


def _alive(signals: Signals, j: int, lever: Lever) -> tuple[BoolArray, tuple[str, ...]]:
    """When an actuator's position could be believed, and in words when it could not."""
    begin_s = float(signals.time_s[0])
    told = list(signals.frozen)
    known = signals.known
    # a sensor without noise rests to the last digit, whatever another's lever does
    levers = slice(None) if lever.axis is None else slice(lever.axis, lever.axis + 1)
    if lever.axis is not None or signals.noise[j] > 0.0:
        grid = signals.time_s
        position = np.where(known, signals.position[:, j], np.nan)
        own = frozen(grid, position[:, None], grid, signals.axes[:, levers], GAP_S)
        known = known & ~standing(grid, grid, own, signals.window_s)
        told += [(float(grid[a]) - begin_s, float(grid[b]) - begin_s) for a, b in own]
    if not told:
        return known, ()
    when = ", ".join(f"{since_s:.0f} to {until_s:.0f} s" for since_s, until_s in told[:_SHOWN])
    more = f" and {len(told) - _SHOWN} times more" if len(told) > _SHOWN else ""
    words = (
        f"its position stood still to the last digit from {when}{more} while a lever was pushed:"
        " a frozen sensor, a machine that was off, an end stop? Nothing is measured from that"
    )
    return known, (words,)


def _band(begins: Estimate | None) -> float:
    return DEADBAND_UNSEEN if begins is None else begins.value
