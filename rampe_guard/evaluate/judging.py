"""From traces to figures: a forecaster's point at one threshold, and its whole curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.blindness import NEVER
from rampe_guard.evaluate.episodes import Contact, contact_episodes, contact_times
from rampe_guard.evaluate.outcome import Outcome, judge
from rampe_guard.evaluate.points import Figures, Pool, Spread, figures, pool, spread
from rampe_guard.evaluate.trace import Manners, Trace, alarms

THRESHOLDS: Final = tuple(
    round(float(p), 3)
    for p in np.concatenate(
        (np.arange(0.01, 0.2, 0.005), np.arange(0.2, 0.6, 0.01), np.arange(0.6, 1.0, 0.02))
    )
)
"""Thresholds of a curve: dense where alarms come and go with small changes."""
RATES: Final = (0.5, 1.0, 2.0, 3.0)
"""False alarms per minute and zone whose nearest points of a curve get intervals."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What truly happened in one log.

    Attributes:
        name: of the log.
        zones: names.
        contacts: of each zone (c, 2) [s].
        window: first and last position [s].
        blind: spans in which a guard did not monitor (b, 2) [s]; nobody is judged there.
    """

    name: str
    zones: tuple[str, ...]
    contacts: tuple[FloatArray, ...]
    window: tuple[float, float]
    blind: FloatArray = field(default_factory=lambda: NEVER)


def truth(
    name: str,
    zones: tuple[str, ...],
    contacts: Sequence[Contact],
    window: tuple[float, float],
    blind: FloatArray = NEVER,
) -> Truth:
    """Join the contacts of each zone."""
    joined = tuple(contact_times(contact_episodes(contacts, zone)) for zone in zones)
    return Truth(name, zones, joined, window, blind)


@dataclass(frozen=True, slots=True)
class Judged:
    """A forecaster at one threshold.

    Attributes:
        threshold: smallest score that alarms.
        figures: of alarms with the manners of published alerts.
        strict: of alarms that end with their last cause; None where there is no cause to see.
        spread: intervals of ``figures``; None where they were not asked for.
    """

    threshold: float
    figures: Figures
    strict: Figures | None
    spread: Spread | None


def outcomes(truth: Truth, trace: Trace, threshold: float, how: Manners) -> tuple[Outcome, ...]:
    """What became of the alarms of a trace, zone by zone."""
    return tuple(
        judge(truth.contacts[z], alarms(trace, z, threshold, how), truth.window, truth.blind)
        for z in range(len(truth.zones))
    )


def point(
    truths: Sequence[Truth], traces: Sequence[Trace], threshold: float, how: Manners
) -> Judged:
    """One point with its intervals, over all logs."""
    found = pooled(truths, traces, threshold, how)
    strict = figures(pooled(truths, traces, threshold, replace(how, strict=True)))
    return Judged(threshold, figures(found), strict, spread(found))


def curve(
    truths: Sequence[Truth],
    thresholds: Sequence[float],
    make: Callable[[float], tuple[Sequence[Trace], float]],
    how: Manners,
) -> list[Judged]:
    """Points of a curve, with intervals at those nearest to `RATES`.

    Args:
        truths: what happened in each log.
        thresholds: of the points, or values of another parameter.
        make: for each of these, what was said of each log and the threshold of its score.
        how: manners of the alarms.
    """
    pools, points = [], []
    for value in thresholds:
        said, threshold = make(value)
        found = pooled(truths, said, threshold, how)
        strict = figures(pooled(truths, said, threshold, replace(how, strict=True)))
        pools.append(found)
        points.append(Judged(value, figures(found), strict, None))
    rates = np.array([p.figures.false_per_min_per_zone or 0.0 for p in points])
    for k in {int(np.argmin(np.abs(rates - rate))) for rate in RATES} if points else ():
        points[k] = replace(points[k], spread=spread(pools[k]))
    return points


def pooled(
    truths: Sequence[Truth], traces: Sequence[Trace], threshold: float, how: Manners
) -> Pool:
    """Outcomes of all logs at one threshold."""
    pairs = zip(truths, traces, strict=True)
    return pool(outcomes(truth, trace, threshold, how) for truth, trace in pairs)
