"""Levers and positions on one even grid of time, with velocities: what `identify` looks at.

Levers hold their last value, positions run straight between samples, and a velocity is the slope
over a window with its middle at the instant: smoothing delays nothing, or a lag would be too long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.identify_frozen import frozen, runs, within
from rampe_guard.core.types import FloatArray

__all__ = ["GAP_S", "STEP_S", "BoolArray", "Signals", "Traces", "runs", "signals_of", "standing"]

BoolArray = npt.NDArray[np.bool_]

STEP_S = 0.01
"""Of the grid [s]."""
GAP_S = 0.5
"""Silence of either input for longer tells nothing of what was between [s]."""
MAX_S = 1800.0
"""So much of a recording is looked at, its end [s]."""
_PAUSE_S = 10.0
"""So much is left of a longer silence of both inputs: it costs no more than a short one [s]."""
_WINDOW_PERIODS, _LEAST_WINDOW_S = 3.0, 0.06
_LEAST_SAMPLES = 20


@dataclass(frozen=True, slots=True)
class Traces:
    """What was heard of a machine, both inputs on one clock.

    Attributes:
        lever_s: times of the levers (k,), rising [s].
        axes: joystick axes (k, m) [-].
        time_s: times of the positions (l,), rising [s].
        position: actuators (l, n) [unit].
        names: of the actuators, where messages named them.
    """

    lever_s: FloatArray
    axes: FloatArray
    time_s: FloatArray
    position: FloatArray
    names: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Signals:
    """Both inputs on an even grid.

    Attributes:
        time_s: (k,) [s].
        axes: (k, m) [-].
        position: (k, n) [unit].
        velocity: (k, n) [unit/s].
        known: (k,) whether both inputs were there.
        period_s: typical distance of two positions [s].
        window_s: over which a velocity is the slope [s].
        noise: of a single position, standard deviation (n,) [unit].
        frozen: from when to when no position changed though a lever was pushed, from
            the beginning of what was heard [s]; not ``known``.
    """

    time_s: FloatArray
    axes: FloatArray
    position: FloatArray
    velocity: FloatArray
    known: BoolArray
    period_s: float
    window_s: float
    noise: FloatArray
    frozen: tuple[tuple[float, float], ...] = ()


def signals_of(traces: Traces) -> Signals | None:
    """The traces on a grid; None where both inputs together are too short to tell anything."""
    if min(len(traces.lever_s), len(traces.time_s)) < _LEAST_SAMPLES:
        return None
    lever_s, axes = _rising(traces.lever_s, traces.axes)
    time_s, position = _rising(traces.time_s, traces.position)
    if len(lever_s) < _LEAST_SAMPLES or len(time_s) < _LEAST_SAMPLES:
        return None
    stretches = frozen(time_s, position, lever_s, axes, GAP_S)
    begin_s = max(lever_s[0], time_s[0])
    told = tuple((float(time_s[a] - begin_s), float(time_s[b] - begin_s)) for a, b in stretches)
    lever_s, time_s = _without_pauses(lever_s, time_s)
    end_s = min(lever_s[-1], time_s[-1])
    start_s = max(lever_s[0], time_s[0], end_s - MAX_S)
    if end_s - start_s < _LEAST_SAMPLES * STEP_S:
        return None
    grid = np.arange(start_s, end_s, STEP_S)
    before = np.searchsorted(lever_s, grid, side="right") - 1
    period_s = float(np.median(np.diff(time_s)))
    window_s = max(_LEAST_WINDOW_S, _WINDOW_PERIODS * period_s)
    resampled = np.column_stack([np.interp(grid, time_s, column) for column in position.T])
    known = _covered(grid, lever_s) & _covered(grid, time_s)
    return Signals(
        time_s=grid,
        axes=axes[before],
        position=resampled,
        velocity=_slope(resampled, window_s),
        known=known & ~standing(grid, time_s, stretches, window_s),
        period_s=period_s,
        window_s=window_s,
        noise=_noise(time_s, position, lever_s, axes),
        frozen=told,
    )


def _without_pauses(lever_s: FloatArray, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same times with what is long silent of both made short: a grid costs what was heard."""
    both = np.union1d(lever_s, time_s)
    steps = np.diff(both)
    if not (steps > _PAUSE_S).any():
        return lever_s, time_s
    short = both[0] + np.concatenate([[0.0], np.cumsum(np.minimum(steps, _PAUSE_S))])
    return short[np.searchsorted(both, lever_s)], short[np.searchsorted(both, time_s)]


def standing(
    grid: FloatArray, time_s: FloatArray, stretches: list[tuple[int, int]], window_s: float
) -> BoolArray:
    """Whether each instant is in one of the ``stretches``, or in the leap at its end."""
    mask = np.zeros(len(grid), dtype=bool)
    for first, last in stretches:
        until_s = time_s[min(last + 1, len(time_s) - 1)] + window_s
        mask[np.searchsorted(grid, time_s[first]) : np.searchsorted(grid, until_s)] = True
    return mask


def _rising(time_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Samples in order of time, of equal times the last."""
    order = np.argsort(time_s, kind="stable")
    time_s, values = time_s[order], values[order]
    last = np.append(np.diff(time_s) > 0.0, True)
    return time_s[last], values[last]


def _covered(grid: FloatArray, time_s: FloatArray) -> BoolArray:
    """Whether each instant lies between two samples that are no gap apart."""
    after = np.clip(np.searchsorted(time_s, grid, side="right"), 1, len(time_s) - 1)
    return np.asarray(time_s[after] - time_s[after - 1] <= GAP_S)


def _slope(position: FloatArray, window_s: float) -> FloatArray:
    """Least-squares slope over a window about each instant; at the ends of less."""
    half = max(1, round(0.5 * window_s / STEP_S))
    weights = np.arange(-half, half + 1, dtype=np.float64)
    weights /= float(weights @ weights) * STEP_S
    padded = np.pad(position, ((half, half), (0, 0)), mode="edge")
    return np.column_stack([np.correlate(column, weights, mode="valid") for column in padded.T])


def _noise(
    time_s: FloatArray, position: FloatArray, lever_s: FloatArray, axes: FloatArray
) -> FloatArray:
    """Standard deviation of single positions, by their second differences at rest.

    A sensor that hung half of the time is none without noise.
    """
    found = []
    for column in position.T:
        hung = within(frozen(time_s, column[:, None], lever_s, axes, GAP_S), len(column))
        second = np.abs(np.diff(column, n=2))[~hung[2:]]
        found.append(float(np.median(second)) if len(second) else 0.0)
    return np.asarray(np.array(found) / (0.6745 * np.sqrt(6.0)))
