"""How far off forecasts are: errors in units of the range, with their uncertainty.

The error of a set of primitives is the root of their mean squared error, summed over the
actuators, each in units of its range:

    e² = mean over primitives of Σ_j ((x̂_j - x_j) / range_j)²
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.prequential import Trials

Mask = npt.NDArray[np.bool_]

KNOWN = 5
"""Occurrences from which a category counts as known: the figures most worth comparing."""
RESAMPLES = 1000
_SEED = 20140501
_QUANTILES = (0.025, 0.5, 0.975)
CURVE_FROM = (0, 1, 2, 3, 5, 10, 20, 40)
"""First count of each bin of the learning curve; the last is open."""


@dataclass(frozen=True, slots=True)
class Interval:
    """Bootstrap quantiles: 2.5 %, median, 97.5 %."""

    low: float
    median: float
    high: float


@dataclass(frozen=True, slots=True)
class Error:
    """How far off one forecaster was on a set of primitives, in units of the range.

    Attributes:
        error: summed over the actuators, root of the mean.
        spread: the same of resampled primitives.
        moving: root mean square over the actuators that the category moves.
        actuators: root mean square of each actuator (n,).
        answered: share of the primitives for which there was a forecast.
    """

    error: float
    spread: Interval
    moving: float
    actuators: FloatArray
    answered: float


def known(trials: Trials) -> Mask:
    """Primitives whose category was seen at least `KNOWN` times before (N,)."""
    return trials.seen >= KNOWN


def errors(trials: Trials, width: FloatArray, chosen: Mask) -> dict[str, Error]:
    """Errors of every forecaster on the chosen primitives; none if nothing is chosen.

    Args:
        trials: N primitives.
        width: range of each actuator (n,) [unit].
        chosen: which of them count (N,).
    """
    if not chosen.any():
        return {}
    squares = _squares(trials, width)[:, chosen]
    moved = trials.sign[chosen] != 0
    resampled = _resampled(squares.sum(axis=2))
    return {
        name: Error(
            error=float(np.sqrt(square.sum(axis=1).mean())),
            spread=_interval(resampled[f]),
            moving=float(np.sqrt(square[moved].mean())),
            actuators=np.sqrt(square.mean(axis=0)),
            answered=float(trials.answered[f, chosen].mean()),
        )
        for f, (name, square) in enumerate(zip(trials.names, squares, strict=True))
    }


def ratio(trials: Trials, width: FloatArray, chosen: Mask, over: str, under: str) -> Interval:
    """Error of ``over`` divided by that of ``under``, on the same resampled primitives.

    nan where ``under`` is never wrong.

    Args:
        trials: N primitives.
        width: range of each actuator (n,) [unit].
        chosen: which of them count (N,), at least one.
        over: name of a forecaster.
        under: name of another.
    """
    pair = [trials.names.index(over), trials.names.index(under)]
    above, below = _resampled(_squares(trials, width)[pair][:, chosen].sum(axis=2))
    nobody_errs = np.full_like(below, np.nan)  # the other was never wrong: no ratio
    return _interval(np.divide(above, below, out=nobody_errs, where=below > 0.0))


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """Errors by name for categories seen ``first`` to ``last`` times before (None: open)."""

    first: int
    last: int | None
    primitives: int
    errors: dict[str, float]


def learning_curve(
    trials: Trials, width: FloatArray, judged: Mask | None = None
) -> list[CurvePoint]:
    """Error against how often the category was seen before; empty bins are left out.

    ``judged`` says which primitives count (N,), None for all.
    """
    squares = _squares(trials, width).sum(axis=2)
    points = []
    for first, end in zip(CURVE_FROM, (*CURVE_FROM[1:], None), strict=True):
        chosen = trials.seen >= first
        if judged is not None:
            chosen &= judged
        if end is not None:
            chosen &= trials.seen < end
        if chosen.any():
            found = np.sqrt(squares[:, chosen].mean(axis=1)).tolist()
            last = None if end is None else end - 1
            by_name = dict(zip(trials.names, found, strict=True))
            points.append(CurvePoint(first, last, int(chosen.sum()), by_name))
    return points


def _squares(trials: Trials, width: FloatArray) -> FloatArray:
    """Squared errors (F, N, n) in units of the range."""
    squares: FloatArray = ((trials.predicted - trials.truth) / width) ** 2
    return squares


def _resampled(squares: FloatArray) -> FloatArray:
    """Errors (F, RESAMPLES) of primitives drawn with replacement, from squares (F, N)."""
    count = squares.shape[1]
    draws = np.random.default_rng(_SEED).integers(count, size=(RESAMPLES, count))
    roots: FloatArray = np.sqrt(np.array([s[draws].mean(axis=1) for s in squares]))
    return roots


def _interval(values: FloatArray) -> Interval:
    return Interval(*np.quantile(values, _QUANTILES).tolist())
