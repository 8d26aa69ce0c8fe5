"""The paper's three claims, each as conditions on a run, and a verdict over all runs.

A condition is one measured number per run and a limit, settled here before anything is run.

* A condition is *met* when at least `SHARE_OF_RUNS` of the runs that can show it keep the limit.
* A claim *holds* when all its conditions are met, holds *in part* when some are, and else
  *does not hold*. It is *not shown* when no run can show one of its conditions.

Errors of different units are added as shares of the range. "Moved" are the actuators that a
category drives; what a static one drifts is no displacement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_clusters import TwoClusters, told_apart, two_clusters
from rampe_guard.evaluate.paper_estimates import N_INIT, PredictorName, Run
from rampe_guard.evaluate.paper_table import LAST

FREQUENT = 5
"""The paper shows this many categories: the most frequent ones."""

SHARE_OF_RUNS = 0.9
_NOT_ZERO = 1e-3


class Verdict(StrEnum):
    """What came out of a claim."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    DOES_NOT = "does not hold"
    NOT_SHOWN = "not shown"


@dataclass(frozen=True, slots=True)
class Condition:
    """One condition of a claim, measured in every run.

    Attributes:
        name: what is measured, in words.
        limit: what it is compared with.
        above: the limit must be passed upwards; else the value must not be above it.
        values: one per run; nan in a run that cannot show it.
    """

    name: str
    limit: float
    above: bool
    values: FloatArray

    @property
    def shown(self) -> FloatArray:
        """The values of the runs that can show it."""
        return self.values[~np.isnan(self.values)]

    @property
    def share(self) -> float | None:
        """Share of those runs that keep the limit; None without any."""
        kept = self.shown > self.limit if self.above else self.shown <= self.limit
        return float(np.mean(kept)) if kept.size else None

    @property
    def met(self) -> bool | None:
        """At least `SHARE_OF_RUNS` of the runs keep the limit; None where none can show it."""
        return None if self.share is None else self.share >= SHARE_OF_RUNS


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim of the paper for one predictor."""

    text: str
    conditions: tuple[Condition, ...]

    @property
    def verdict(self) -> Verdict:
        """What the conditions say together."""
        met = [c.met for c in self.conditions]
        if None in met:
            return Verdict.NOT_SHOWN
        if all(met):
            return Verdict.HOLDS
        return Verdict.IN_PART if any(met) else Verdict.DOES_NOT


def claims(
    runs: Sequence[Run], predictor: PredictorName, span: FloatArray
) -> tuple[Claim, Claim, Claim]:
    """Measure the three claims of Sect. IV-B for one predictor.

    Args:
        runs: at least one.
        predictor: whose estimates.
        span: the range of each actuator (n,) [unit].
    """

    def condition(
        name: str, measure: Callable[[_Measured], float], limit: float, *, above: bool = False
    ) -> Condition:
        values = np.array([measure(_Measured(run, predictor, span)) for run in runs])
        return Condition(name, limit, above, values)

    frequent = f"the {FREQUENT} most frequent categories"
    return (
        Claim(
            "The error is large only while initialising, then falls, and is never zero.",
            (
                condition(
                    f"errors after the first {N_INIT} occurrences that are larger than the RMS"
                    f" displacement, share ({frequent}, moved actuators)",
                    _Measured.large_share,
                    0.05,
                ),
                condition(
                    f"RMS error of the last {LAST} occurrences over that of the first {LAST}"
                    f" after initialising ({frequent})",
                    _Measured.fall,
                    1.0,
                ),
                condition(
                    f"smallest RMS error of the last {LAST} occurrences, share of the range"
                    f" ({frequent}, moved actuators)",
                    _Measured.smallest_last,
                    _NOT_ZERO,
                    above=True,
                ),
            ),
        ),
        Claim(
            "One linear model of a category separates two clusters of starts.",
            (
                condition(
                    "categories whose starts lie in two clusters with displacements of their own",
                    _Measured.clustered,
                    0.0,
                    above=True,
                ),
                condition(
                    "estimates nearer to what their own cluster did than to the other, share"
                    " (both clusters weigh the same; 0.5 is chance)",
                    _Measured.told_apart,
                    0.9,
                    above=True,
                ),
                condition(
                    "RMS error over that of the running mean, in those categories",
                    _Measured.against_mean,
                    1.0,
                ),
            ),
        ),
        Claim(
            "The error is small relative to the total displacement.",
            (
                condition(
                    "sum of |E| after initialising over sum of |x| (all categories)",
                    _Measured.relative_total,
                    0.25,
                ),
                condition(
                    f"RMS error after initialising over RMS displacement ({frequent})",
                    _Measured.relative_frequent,
                    0.25,
                ),
                condition(
                    "RMS error after initialising over RMS displacement (all categories)",
                    _Measured.relative,
                    0.25,
                ),
            ),
        ),
    )


@dataclass(frozen=True, slots=True)
class _Measured:
    """The numbers of one run that the conditions speak of."""

    run: Run
    predictor: PredictorName
    span: FloatArray

    def large_share(self) -> float:
        larger = []
        for category in self._frequent():
            moved = np.array(category) != 0
            members = self.run.primitives.of(category)
            x = self.run.primitives.displacement[members]
            known = self.run.initialised[members]
            error = self._scaled(category)[known] * self.span
            typical = np.sqrt(np.mean(x**2, axis=0))
            larger.append((np.abs(error) > typical)[:, moved].ravel())
        return _mean(np.concatenate(larger)) if larger else np.nan

    def fall(self) -> float:
        first, last = [], []
        for category in self._frequent():
            error = self._known(category)
            if len(error) >= 2 * LAST:  # else they would share occurrences
                first.append(error[:LAST].ravel())
                last.append(error[-LAST:].ravel())
        return _ratio(last, first)

    def smallest_last(self) -> float:
        settled = []
        for category in self._frequent():
            error = self._known(category)[-LAST:, np.array(category) != 0]
            if len(error):
                settled.append(np.sqrt(np.mean(error**2, axis=0)).min())
        return float(min(settled, default=np.nan))

    def clustered(self) -> float:
        return float(len(self._clusters()))

    def told_apart(self) -> float:
        shares = [told_apart(self.run, c, self.predictor, self.span) for c in self._clusters()]
        return _mean(np.array([s for s in shares if not np.isnan(s)]))

    def against_mean(self) -> float:
        mean = _Measured(self.run, "running mean", self.span)
        categories = [c.category for c in self._clusters()]
        return _ratio(
            [self._known(c).ravel() for c in categories],
            [mean._known(c).ravel() for c in categories],
        )

    def relative_total(self) -> float:
        known = self.run.initialised
        error = np.abs(self.run.error(self.predictor) / self.span)[known].sum()
        moved = np.abs(self.run.primitives.displacement / self.span)[known].sum()
        return float(error / moved) if moved > 0.0 else np.nan

    def relative_frequent(self) -> float:
        return self._relative(self._frequent())

    def relative(self) -> float:
        return self._relative(tuple(dict.fromkeys(self.run.primitives.category)))

    def _relative(self, categories: Sequence[Category]) -> float:
        moved = []
        for category in categories:
            members = self.run.primitives.of(category)
            chosen = members[self.run.initialised[members]]
            moved.append((self.run.primitives.displacement[chosen] / self.span).ravel())
        return _ratio([self._known(c).ravel() for c in categories], moved)

    def _frequent(self) -> tuple[Category, ...]:
        return self.run.primitives.most_frequent(FREQUENT)

    def _clusters(self) -> list[TwoClusters]:
        every = self.run.primitives.most_frequent(3 ** len(self.span))
        found = [two_clusters(self.run, category, self.span) for category in every]
        return [clusters for clusters in found if clusters is not None]

    def _scaled(self, category: Category) -> FloatArray:
        members = self.run.primitives.of(category)
        error: FloatArray = self.run.error(self.predictor)[members] / self.span
        return error

    def _known(self, category: Category) -> FloatArray:
        """Errors of a category after initialising, as shares of the range (N, n)."""
        members = self.run.primitives.of(category)
        return self._scaled(category)[self.run.initialised[members]]


def _mean(values: FloatArray) -> float:
    return float(np.mean(values)) if values.size else np.nan


def _ratio(above: Sequence[FloatArray], below: Sequence[FloatArray]) -> float:
    """RMS of everything above over RMS of everything below; nan without either."""
    if not above or not below:
        return np.nan
    a, b = np.concatenate(above), np.concatenate(below)
    if not a.size or not b.size or not np.any(b):
        return np.nan
    return float(np.sqrt(np.mean(a**2) / np.mean(b**2)))
