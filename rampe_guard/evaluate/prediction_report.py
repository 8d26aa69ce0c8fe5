"""`prediction.json`: every figure of the prediction part, with what it means and comes from.

The same logs, site and versions give the same bytes: no stamps, no folders.
"""

from __future__ import annotations

import math
import platform
from importlib.metadata import version
from typing import Any

from rampe_guard import __version__
from rampe_guard.core.moments import SPACING_S
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.calibration import AHEAD, Reliability
from rampe_guard.evaluate.prediction import FORECASTERS, RAMPE, Calibration, Errors, Prediction
from rampe_guard.evaluate.prediction_score import KNOWN, RESAMPLES, Error, Interval
from rampe_guard.evaluate.segments import Run
from rampe_guard.settings import Site

_LIBRARIES = ("numpy", "scipy", "scikit-learn", "river")

_DEFINITIONS = {
    "order": "prequential: at each primitive every forecaster predicts first, then learns it",
    "range": "greatest less smallest accepted position over all logs given",
    "error": (
        "sqrt of the mean over primitives of the squared error summed over the actuators, each"
        " in units of its range; without a forecast, zero counts as predicted"
    ),
    "error_moving": "root mean square over the actuators that the category moves",
    "error_actuators": "root mean square of each actuator",
    "known": f"categories seen at least {KNOWN} times before",
    "interval": (
        f"2.5 %, 50 % and 97.5 % of {RESAMPLES} bootstrap samples of the primitives (seeded)"
    ),
    "ratio": f"error of {RAMPE} divided by that of the other, on the same bootstrap samples",
    "incomplete": (
        "primitives during which inputs were missing or refused: not learned by the guard, and"
        " not predicted here"
    ),
    "coverage": "share of displacements inside the central interval, of actuators that move",
    "reliability": (
        f"at every sample from the detection of a primitive to that of its end, at least"
        f" {SPACING_S:g} s apart, and for each actuator that the category moves: the probability,"
        f" by progress, lever and speed, that the displacement passes the progress plus"
        f" {', '.join(f'{a:g}' for a in AHEAD)} of the range, against whether it did"
    ),
    "expected_calibration_error": "mean |said - happened| over the bins, weighted by count",
}


def report(prediction: Prediction, site: Site) -> dict[str, Any]:
    """The content of ``prediction.json``: JSON types only, null where a figure is unknown."""
    names = site.actuator_names
    units = [a.unit for a in site.guard.actuators]
    return {
        "versions": {
            "rampe-guard": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in _LIBRARIES},
        },
        "site": site.name,
        "machine": site.machine,
        "knowledge": "fresh for each log" if prediction.fresh else "carried over from log to log",
        "definitions": _DEFINITIONS,
        "range": {
            name: {"width": width, "unit": unit}
            for name, width, unit in zip(names, prediction.width.tolist(), units, strict=True)
        },
        "forecasters": FORECASTERS,
        "total": _errors(prediction.total, names),
        "logs": [
            {**_run(run), **_errors(found, names)}
            for run, found in zip(prediction.runs, prediction.by_run, strict=True)
        ],
        "ratios": {
            "all": {name: _interval(r) for name, r in prediction.ratios.items()},
            "known": {name: _interval(r) for name, r in prediction.ratios_known.items()},
        },
        "learning_curve": [
            {"seen_from": p.first, "seen_to": p.last, "primitives": p.primitives, "error": p.errors}
            for p in prediction.curve
        ],
        "calibration": {
            "of": RAMPE,
            "all": _calibration(prediction.calibration, names),
            "known": _calibration(prediction.calibration_known, names),
        },
    }


def _run(run: Run) -> dict[str, Any]:
    return {
        "log": run.name,
        "duration_s": run.duration_s,
        "rows": run.rows,
        "rows_left_out": run.left_out,
        "samples_refused": run.refused,
        "incomplete": run.incomplete,
    }


def _errors(found: Errors, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "primitives": found.primitives,
        "primitives_known": found.primitives_known,
        "all": {name: _error(e, names) for name, e in found.everything.items()},
        "known": {name: _error(e, names) for name, e in found.known.items()},
    }


def _error(error: Error, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "error": error.error,
        "interval": _interval(error.spread),
        "error_moving": error.moving,
        "error_actuators": _by_name(names, error.actuators),
        "answered": error.answered,
    }


def _interval(interval: Interval) -> list[float | None]:
    return [_number(interval.low), _number(interval.median), _number(interval.high)]


def _calibration(found: Calibration, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "forecasts": found.forecasts,
        "coverage": [
            {
                "level": c.level,
                "overall": _number(c.overall),
                "actuators": _by_name(names, c.actuators),
                "counts": dict(zip(names, c.counts.tolist(), strict=True)),
            }
            for c in found.coverage
        ],
        "reliability": {
            "overall": _reliability(found.overall),
            "actuators": {
                name: _reliability(r) for name, r in zip(names, found.actuators, strict=True)
            },
        },
    }


def _reliability(found: Reliability) -> dict[str, Any]:
    return {
        "expected_calibration_error": _number(found.error),
        "answers": int(found.counts.sum()),
        "bins": [
            {"count": count, "said": _number(said), "happened": _number(happened)}
            for count, said, happened in zip(
                found.counts.tolist(), found.said.tolist(), found.happened.tolist(), strict=True
            )
        ],
    }


def _by_name(names: tuple[str, ...], values: FloatArray) -> dict[str, float | None]:
    return {name: _number(v) for name, v in zip(names, values.tolist(), strict=True)}


def _number(value: float) -> float | None:
    """JSON knows no NaN: null is an unknown figure."""
    return value if math.isfinite(value) else None
