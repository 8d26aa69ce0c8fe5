"""The table of the engineering test: per category how far, and how wrong; quantiles over runs."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_estimates import PREDICTORS, PredictorName, Run

LAST = 10
"""How many of the last occurrences show what the error settles to."""


@dataclass(frozen=True, slots=True)
class CategoryRow:
    """One category over one or more runs; arrays (n,) [unit], None where nothing is to count.

    Attributes:
        category: Ω.
        occurrences: in all runs together.
        rms_displacement: of x.
        rms_error: of E after the first `N_INIT` occurrences of each run, per predictor.
        rms_last: of E over the last `LAST` occurrences of each run, initialising left out.
    """

    category: Category
    occurrences: int
    rms_displacement: FloatArray
    rms_error: dict[PredictorName, FloatArray | None]
    rms_last: dict[PredictorName, FloatArray | None]


@dataclass(frozen=True, slots=True)
class ErrorQuantiles:
    """Quantiles of ‖E / span‖ / √n, the error as a share of the range, over all runs [-]."""

    median: float
    p90: float
    p99: float
    largest: float
    count: int


def category_rows(runs: Sequence[Run]) -> tuple[CategoryRow, ...]:
    """One row per category that was seen, the most frequent first."""
    seen = Counter(c for run in runs for c in run.primitives.category)
    return tuple(_row(runs, category, count) for category, count in seen.most_common())


def error_quantiles(
    runs: Sequence[Run], predictor: PredictorName, span: FloatArray, *, initialised: bool
) -> ErrorQuantiles:
    """Quantiles of the error as a share of the range, over all primitives of all runs.

    Args:
        runs: at least one.
        predictor: whose error.
        span: the range of each actuator (n,) [unit].
        initialised: count only what comes after the first `N_INIT` occurrences of a category.
    """
    shares = np.concatenate([share(run, predictor, span, initialised=initialised) for run in runs])
    if not shares.size:
        return ErrorQuantiles(np.nan, np.nan, np.nan, np.nan, 0)
    median, p90, p99, largest = np.quantile(shares, [0.5, 0.9, 0.99, 1.0]).tolist()
    return ErrorQuantiles(median, p90, p99, largest, int(shares.size))


def share(run: Run, predictor: PredictorName, span: FloatArray, *, initialised: bool) -> FloatArray:
    """‖E / span‖ / √n of each primitive, or of those after initialising [-]."""
    scaled = run.error(predictor) / span
    if initialised:
        scaled = scaled[run.initialised]
    size: FloatArray = np.linalg.norm(scaled, axis=1) / np.sqrt(scaled.shape[1])
    return size


def squared_shares(
    runs: Sequence[Run], predictor: PredictorName, span: FloatArray
) -> dict[Category, float]:
    """Which category bears how much of the squared error after initialising, largest first [-]."""
    total: defaultdict[Category, float] = defaultdict(float)
    for run in runs:
        squares = np.sum((run.error(predictor) / span) ** 2, axis=1)
        for category in dict.fromkeys(run.primitives.category):
            members = run.primitives.of(category)
            total[category] += float(squares[members[run.initialised[members]]].sum())
    ordered = sorted(total.items(), key=lambda item: -item[1])
    whole = sum(total.values())
    return {c: value / whole for c, value in ordered} if whole > 0.0 else {}


def rms(values: FloatArray) -> FloatArray | None:
    """Root mean square over the rows of (N, n); None without rows."""
    return np.sqrt(np.mean(values**2, axis=0)) if len(values) else None


def _row(runs: Sequence[Run], category: Category, count: int) -> CategoryRow:
    members = [run.primitives.of(category) for run in runs]
    known = [m[run.initialised[m]] for run, m in zip(runs, members, strict=True)]

    def gathered(predictor: PredictorName, last: int | None) -> FloatArray | None:
        chosen = [k if last is None else k[-last:] for k in known]
        errors = [run.error(predictor)[k] for run, k in zip(runs, chosen, strict=True)]
        return rms(np.concatenate(errors))

    moved = [run.primitives.displacement[m] for run, m in zip(runs, members, strict=True)]
    root = rms(np.concatenate(moved))
    return CategoryRow(
        category=category,
        occurrences=count,
        rms_displacement=np.zeros(runs[0].primitives.start.shape[1]) if root is None else root,
        rms_error={p: gathered(p, None) for p in PREDICTORS},
        rms_last={p: gathered(p, LAST) for p in PREDICTORS},
    )
