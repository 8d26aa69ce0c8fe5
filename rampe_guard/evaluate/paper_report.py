"""Everything that the experiment says, once: the page, the table file and the terminal show it."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_claims import Claim, claims
from rampe_guard.evaluate.paper_clusters import two_ways
from rampe_guard.evaluate.paper_estimates import (
    MODES,
    N_INIT,
    PREDICTORS,
    TOL,
    PredictorName,
    Run,
)
from rampe_guard.evaluate.paper_table import (
    LAST,
    CategoryRow,
    ErrorQuantiles,
    category_rows,
    error_quantiles,
    squared_shares,
)


@dataclass(frozen=True, slots=True)
class Experiment:
    """What was done.

    Attributes:
        cycles: of each run.
        actuators: their names (n).
        units: and units (n).
        span: the range that errors are shares of, that of the targets (n,) [unit].
        targets: name to its two values [unit].
        way: names of the targets in the order of one cycle.
        minutes: simulated time of all runs together [min].
        corrections: moves that the operators made again, in all runs.
    """

    cycles: int
    actuators: tuple[str, ...]
    units: tuple[str, ...]
    span: FloatArray
    targets: Mapping[str, tuple[float, float]]
    way: tuple[str, ...]
    minutes: float
    corrections: int


@dataclass(frozen=True, slots=True)
class Report:
    """What came out.

    Attributes:
        experiment: what was done.
        seeds: of the runs; figures are of the first.
        primitives: in all runs.
        first: table of the first run.
        every: table of all runs together.
        quantiles: per predictor, after initialising.
        quantiles_all: per predictor, over all occurrences.
        claims: per mode.
        squared: share of the squared error that each category bears, per mode, largest first.
        two_ways: runs in which a category goes two ways from one place, categories that do.
        two_futures: forecasts in which the default mode said so, and all of the category.
    """

    experiment: Experiment
    seeds: tuple[int, ...]
    primitives: int
    first: tuple[CategoryRow, ...]
    every: tuple[CategoryRow, ...]
    quantiles: dict[PredictorName, ErrorQuantiles]
    quantiles_all: dict[PredictorName, ErrorQuantiles]
    claims: dict[PredictorName, tuple[Claim, ...]]
    squared: dict[PredictorName, dict[Category, float]]
    two_ways: dict[Category, int]
    two_futures: dict[Category, tuple[int, int]]


@dataclass(frozen=True, slots=True)
class FigureFile:
    """A figure that was written: its name without ending, its heading, what it shows."""

    name: str
    title: str
    caption: str


def build_report(experiment: Experiment, runs: Sequence[Run]) -> Report:
    """Compute all tables and verdicts from the runs, of which there is at least one."""
    span = experiment.span
    return Report(
        experiment=experiment,
        seeds=tuple(run.seed for run in runs),
        primitives=sum(len(run.primitives.category) for run in runs),
        first=category_rows(runs[:1]),
        every=category_rows(runs),
        quantiles={p: error_quantiles(runs, p, span, initialised=True) for p in PREDICTORS},
        quantiles_all={p: error_quantiles(runs, p, span, initialised=False) for p in PREDICTORS},
        claims={mode: claims(runs, mode, span) for mode in MODES},
        squared={mode: squared_shares(runs, mode, span) for mode in MODES},
        two_ways=_two_ways(runs, span),
        two_futures=_two_futures(runs),
    )


def sign_name(category: Category) -> str:
    """Ω as a person writes it: (+, -, 0)."""
    return "(" + ", ".join({1: "+", -1: "\N{MINUS SIGN}", 0: "0"}[s] for s in category) + ")"


def report_json(report: Report) -> dict[str, Any]:
    """The report as plain JSON values: null where there is nothing to count."""
    done = report.experiment
    return {
        "experiment": {
            "cycles": done.cycles,
            "seeds": list(report.seeds),
            "n_init": N_INIT,
            "tol": TOL,
            "last": LAST,
            "actuators": list(done.actuators),
            "units": list(done.units),
            "range": done.span.tolist(),
            "primitives": report.primitives,
            "simulated_minutes": done.minutes,
            "corrections": done.corrections,
        },
        "first_run": [_row_json(row, done) for row in report.first],
        "all_runs": [_row_json(row, done) for row in report.every],
        "error_share_of_range": {
            "after_initialising": {p: _quantiles_json(q) for p, q in report.quantiles.items()},
            "all_occurrences": {p: _quantiles_json(q) for p, q in report.quantiles_all.items()},
        },
        "share_of_squared_error": {
            mode: {sign_name(c): value for c, value in shares.items()}
            for mode, shares in report.squared.items()
        },
        "forecasts_of_two_futures": {
            sign_name(c): {"said": said, "of": total}
            for c, (said, total) in report.two_futures.items()
        },
        "runs_with_two_ways_from_one_place": {
            sign_name(c): count for c, count in report.two_ways.items()
        },
        "claims": {mode: [_claim_json(c) for c in found] for mode, found in report.claims.items()},
    }


def primitives_csv(runs: Sequence[Run], experiment: Experiment) -> str:
    """Every primitive with what each predictor said of it: all the tables come from these rows."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = experiment.actuators
    columns = ["seed", "start_s", "end_s", *(f"sign_{n}" for n in names), "occurrence"]
    columns += [f"start_{n}_{u}" for n, u in zip(names, experiment.units, strict=True)]
    for what in ("displacement", *PREDICTORS):
        prefix = what.replace(" ", "_")
        columns += [f"{prefix}_{n}_{u}" for n, u in zip(names, experiment.units, strict=True)]
    table.writerow(columns)
    for run in runs:
        p = run.primitives
        for k, category in enumerate(p.category):
            numbers = [*p.start[k], *p.displacement[k]]
            for predictor in PREDICTORS:
                numbers += [*run.estimate[predictor][k]]
            times = (f"{p.start_s[k]:.3f}", f"{p.end_s[k]:.3f}")
            row = [run.seed, *times, *category, int(p.occurrence[k])]
            table.writerow([*row, *(f"{value:.9g}" for value in numbers)])
    return text.getvalue()


def _two_futures(runs: Sequence[Run]) -> dict[Category, tuple[int, int]]:
    """Categories for which two futures were ever forecast: how often, and of how many."""
    said, total = Counter[Category](), Counter[Category]()
    for run in runs:
        for category, two in zip(run.primitives.category, run.two_futures, strict=False):
            total[category] += 1
            said[category] += bool(two)
    return {c: (count, total[c]) for c, count in said.most_common() if count}


def _two_ways(runs: Sequence[Run], span: FloatArray) -> dict[Category, int]:
    found = Counter(
        category
        for run in runs
        for category in dict.fromkeys(run.primitives.category)
        if two_ways(run, category, span)
    )
    return dict(found.most_common())


def _row_json(row: CategoryRow, done: Experiment) -> dict[str, Any]:
    return {
        "category": list(row.category),
        "occurrences": row.occurrences,
        "rms_displacement": _by_actuator(row.rms_displacement, done),
        "rms_error_after_initialising": {
            p: _by_actuator(e, done) for p, e in row.rms_error.items()
        },
        "rms_error_of_last": {p: _by_actuator(e, done) for p, e in row.rms_last.items()},
    }


def _by_actuator(values: FloatArray | None, done: Experiment) -> dict[str, float] | None:
    if values is None:
        return None
    names = [f"{n} [{u}]" for n, u in zip(done.actuators, done.units, strict=True)]
    return dict(zip(names, values.tolist(), strict=True))


def _quantiles_json(q: ErrorQuantiles) -> dict[str, float | int | None]:
    values = {"median": q.median, "p90": q.p90, "p99": q.p99, "largest": q.largest}
    return {**{k: _finite(v) for k, v in values.items()}, "primitives": q.count}


def _claim_json(claim: Claim) -> dict[str, Any]:
    return {
        "claim": claim.text,
        "verdict": claim.verdict.value,
        "conditions": [
            {
                "measured": c.name,
                "limit": c.limit,
                "must_be": "above" if c.above else "at most",
                "values": [_finite(v) for v in c.values.tolist()],
                "share_of_runs": c.share,
                "met": c.met,
            }
            for c in claim.conditions
        ],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
