"""Levers and positions on one even grid of time, with velocities: what `identify` looks at.

Levers hold their last value, positions run straight between samples, and a velocity is the slope
over a window with its middle at the instant: smoothing delays nothing, or a lag would be too long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray

BoolArray = npt.NDArray[np.bool_]

STEP_S = 0.01
"""Of the grid [s]."""
GAP_S = 0.5
"""Silence of either input for longer tells nothing of what was between [s]."""
MAX_S = 1800.0
"""So much of a recording is looked at, its end [s]."""
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
        noise: of a single position, standard deviation (n,) [unit].
    """

    time_s: FloatArray
    axes: FloatArray
    position: FloatArray
    velocity: FloatArray
    known: BoolArray
    period_s: float
    noise: FloatArray


def signals_of(traces: Traces) -> Signals | None:
    """The traces on a grid; None where both inputs together are too short to tell anything."""
    if min(len(traces.lever_s), len(traces.time_s)) < _LEAST_SAMPLES:
        return None
    lever_s, axes = _rising(traces.lever_s, traces.axes)
    time_s, position = _rising(traces.time_s, traces.position)
    if len(lever_s) < _LEAST_SAMPLES or len(time_s) < _LEAST_SAMPLES:
        return None
    end_s = min(lever_s[-1], time_s[-1])
    start_s = max(lever_s[0], time_s[0], end_s - MAX_S)
    if end_s - start_s < _LEAST_SAMPLES * STEP_S:
        return None
    grid = np.arange(start_s, end_s, STEP_S)
    before = np.searchsorted(lever_s, grid, side="right") - 1
    period_s = float(np.median(np.diff(time_s)))
    resampled = np.column_stack([np.interp(grid, time_s, column) for column in position.T])
    return Signals(
        time_s=grid,
        axes=axes[before],
        position=resampled,
        velocity=_slope(resampled, max(_LEAST_WINDOW_S, _WINDOW_PERIODS * period_s)),
        known=_covered(grid, lever_s) & _covered(grid, time_s),
        period_s=period_s,
        noise=_noise(position),
    )


def runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Stretches [first, end) in which ``mask`` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


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


def _noise(position: FloatArray) -> FloatArray:
    """Standard deviation of single positions, by their second differences at rest."""
    second = np.abs(np.diff(position, n=2, axis=0))
    return np.asarray(np.median(second, axis=0) / (0.6745 * np.sqrt(6.0)))
