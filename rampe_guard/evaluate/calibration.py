"""Does RAMPE know what it does not know? Coverage of its intervals, reliability of its odds.

Two questions about the predictive distribution of the site's RAMPE:

* coverage: how often does the displacement lie in the central 50 % and 90 % interval that was
  given at the start of a primitive? It is of the motion along Ω: an arm that still coasts the
  other way, or gives under its load, has gone 0 along it.
* reliability: while a primitive is under way with progress p, what is the chance that it will
  pass d > p, by what lever and speed say as well, and how often does it? This is the
  probability that alerts are made of.

Both are asked about the actuators that the category moves, and only where there is a forecast.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.forecasters import SiteRampe
from rampe_guard.evaluate.predictive import Predictive, moments
from rampe_guard.evaluate.segments import Segment

LEVELS = (0.5, 0.9)
AHEAD = (0.05, 0.1, 0.2, 0.3, 0.5)
"""Distances ahead of the progress that are asked about [share of the range]."""
BINS = 10


@dataclass(frozen=True, slots=True)
class Foretold:
    """A primitive and the distribution that was forecast for it, None if there was none.

    ``seen`` counts occurrences of the category before.
    """

    segment: Segment
    forecast: Predictive | None
    seen: int


def foretell(
    runs: Sequence[Sequence[Segment]],
    model: Callable[[], SiteRampe],
    *,
    fresh: bool,
    frozen: int | None = None,
) -> list[Foretold]:
    """Walk through all runs: predict, then learn.

    A new model for each run if ``fresh``; only the first ``frozen`` runs teach anything.
    """
    learner, seen = model(), Counter[Category]()
    found = []
    for index, segments in enumerate(runs):
        if fresh and index:
            learner, seen = model(), Counter[Category]()
        for segment in segments:
            category = segment.start.category
            found.append(Foretold(segment, learner.distribution(segment.start), seen[category]))
            if frozen is None or index < frozen:
                learner.observe(segment)
                seen[category] += 1
    return found


@dataclass(frozen=True, slots=True)
class Coverage:
    """Share of displacements inside the central interval of ``level``.

    Attributes:
        level: probability that the interval promises.
        actuators: share for each actuator (n,), nan where it never moved.
        counts: primitives that moved it (n,).
        overall: share of all of them, nan without any.
    """

    level: float
    actuators: FloatArray
    counts: npt.NDArray[np.int64]
    overall: float


def coverage(told: Sequence[Foretold], n: int, level: float) -> Coverage:
    """Coverage of the central intervals of ``level`` over all n actuators."""
    inside, asked = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for one in told:
        if one.forecast is None:
            continue
        sign = np.array(one.segment.start.category, dtype=np.float64)
        near, far = (sign * one.forecast.quantile(p) for p in (0.5 - level / 2, 0.5 + level / 2))
        along = np.maximum(sign * one.segment.displacement, 0.0)
        moved = sign != 0.0
        asked += moved
        inside += moved & (near <= along) & (along <= far)
    total = int(asked.sum())
    share = np.divide(inside, asked, out=np.full(n, np.nan), where=asked > 0)
    return Coverage(level, share, asked, int(inside.sum()) / total if total else np.nan)


@dataclass(frozen=True, slots=True)
class Odds:
    """Answers to "will actuator j pass d?": what was said and what came.

    Attributes:
        actuator: j (m,).
        said: probability (m,).
        passed: whether it did (m,).
        seen: occurrences of the category before (m,).
    """

    actuator: npt.NDArray[np.int64]
    said: FloatArray
    passed: npt.NDArray[np.bool_]
    seen: npt.NDArray[np.int64]

    def of(self, actuator: int) -> Odds:
        """Those about one actuator."""
        return self._where(self.actuator == actuator)

    def known(self, occurrences: int) -> Odds:
        """Those of categories that were seen at least so often before."""
        return self._where(self.seen >= occurrences)

    def _where(self, chosen: npt.NDArray[np.bool_]) -> Odds:
        return Odds(
            self.actuator[chosen], self.said[chosen], self.passed[chosen], self.seen[chosen]
        )


def odds(told: Sequence[Foretold], width: FloatArray, top_speed: FloatArray) -> Odds:
    """Ask every forecast at every moment about every distance ahead.

    Args:
        told: primitives with their forecasts.
        width: range of each actuator (n,) [unit].
        top_speed: of each actuator (n,) [unit/s].
    """
    rows: list[tuple[int, float, bool, int]] = []
    for one in told:
        if one.forecast is None:
            continue
        sign = np.array(one.segment.start.category, dtype=np.float64)
        moved = np.flatnonzero(sign)
        reached = sign * one.segment.displacement
        for moment in moments(one.segment, top_speed):
            for ahead in AHEAD:
                distance = moment.progress + ahead * width
                said = one.forecast.passing(distance, moment.progress, moment.under_way)
                rows += [
                    (int(j), float(said[j]), bool(reached[j] >= distance[j]), one.seen)
                    for j in moved
                ]
    return Odds(
        actuator=np.array([j for j, *_ in rows], dtype=np.int64),
        said=np.array([p for _, p, *_ in rows], dtype=np.float64),
        passed=np.array([b for _, _, b, _ in rows], dtype=bool),
        seen=np.array([k for *_, k in rows], dtype=np.int64),
    )


@dataclass(frozen=True, slots=True)
class Reliability:
    """Probabilities in `BINS` equal bins, against what happened.

    Attributes:
        counts: answers in each bin (BINS,).
        said: mean probability of each (BINS,), nan where empty.
        happened: share that passed (BINS,), nan where empty.
        error: expected calibration error: |said - happened| weighted by count, nan without any.
    """

    counts: npt.NDArray[np.int64]
    said: FloatArray
    happened: FloatArray
    error: float


def reliability(odds: Odds) -> Reliability:
    """Bin the answers."""
    bins = np.minimum((odds.said * BINS).astype(np.int64), BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    some = counts > 0
    empty = np.full(BINS, np.nan)
    said = np.bincount(bins, odds.said, BINS)
    happened = np.bincount(bins, odds.passed, BINS)
    gap = float(np.abs(said - happened).sum())
    return Reliability(
        counts,
        np.divide(said, counts, out=empty.copy(), where=some),
        np.divide(happened, counts, out=empty.copy(), where=some),
        gap / len(bins) if len(bins) else np.nan,
    )
