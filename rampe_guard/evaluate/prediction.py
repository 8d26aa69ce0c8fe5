"""How good are forecasts of the next displacement? Everything that is measured, in one value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import LogError
from rampe_guard.evaluate.calibration import (
    LEVELS,
    Coverage,
    Foretold,
    Odds,
    Reliability,
    coverage,
    foretell,
    odds,
    reliability,
)
from rampe_guard.evaluate.forecasters import (
    ConstantVelocity,
    FaithfulRampe,
    Forecaster,
    LastValue,
    RunningMean,
    SiteRampe,
    Zero,
)
from rampe_guard.evaluate.forecasters_learned import (
    GaussianProcess,
    NearestNeighbours,
    RiverLeastSquares,
)
from rampe_guard.evaluate.prediction_score import (
    KNOWN,
    CurvePoint,
    Error,
    Interval,
    Mask,
    errors,
    known,
    learning_curve,
    ratio,
)
from rampe_guard.evaluate.prequential import Trials, prequential
from rampe_guard.evaluate.segments import Run, position_middle, position_range

RAMPE = "RAMPE"
ZERO = "zero"
MEAN = "running mean"
PROCESS = "Gaussian process"

FORECASTERS = {
    ZERO: "no motion",
    "last value": "what the category did the last time",
    "constant velocity": "velocity at detection times the mean duration of all primitives so far",
    MEAN: "mean of what the category did",
    "5 nearest neighbours": "mean of what the category did at its five nearest starts",
    PROCESS: (
        "one a category (scikit-learn): RBF of length 0.3 of the range, white noise of half"
        " the variance of x, centred"
    ),
    "Gaussian process, optimised": (
        "the same with length, signal and noise by marginal likelihood, one set a category"
    ),
    "RLS of river": (
        "river.linear_model.BayesianLinearRegression on (q, 1), one a category and actuator"
    ),
    "RAMPE, faithful": "the paper's recursion: n_init 3, tol 1e-6, no prior",
    RAMPE: "as the guard runs it with the site's settings",
}
"""What each forecaster is, in the order of every table."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors by forecaster: of all primitives, and of those of known categories."""

    everything: dict[str, Error]
    known: dict[str, Error]
    primitives: int
    primitives_known: int


@dataclass(frozen=True, slots=True)
class Calibration:
    """Calibration of the site's RAMPE: of all actuators, and of each (n)."""

    forecasts: int
    coverage: tuple[Coverage, ...]
    overall: Reliability
    actuators: tuple[Reliability, ...]


@dataclass(frozen=True, slots=True)
class Prediction:
    """The prediction part of an evaluation.

    Attributes:
        runs: the logs, cut into primitives.
        fresh: whether each run began with nothing learned.
        width: range of each actuator (n,) [unit], the unit of all errors.
        total: errors over all runs.
        by_run: errors of each run.
        curve: error against occurrences seen before.
        ratios: error of RAMPE divided by that of each other forecaster, all primitives.
        ratios_known: the same of known categories; empty if there are none.
        calibration: of all forecasts of RAMPE.
        calibration_known: of those for known categories.
    """

    runs: tuple[Run, ...]
    fresh: bool
    width: FloatArray
    total: Errors
    by_run: tuple[Errors, ...]
    curve: tuple[CurvePoint, ...]
    ratios: dict[str, Interval]
    ratios_known: dict[str, Interval]
    calibration: Calibration
    calibration_known: Calibration


def _why_none(runs: Sequence[Run], config: GuardConfig) -> str:
    """Why there is no complete primitive in some runs."""
    cut_short = sum(run.incomplete for run in runs)
    if not cut_short:
        return f"no lever was moved for {config.joystick.debounce_s:g} s"
    why = []
    if silences := sum(run.silences for run in runs):
        apart_s = max(run.duration_s / max(run.rows - 1, 1) for run in runs)
        allowed_s = min(config.inputs.joystick_timeout_s, config.inputs.actuators_timeout_s)
        why.append(
            f"inputs silent for longer than {allowed_s:g} s ({silences} in all, rows are"
            f" {apart_s:.2g} s apart)"
        )
    if refused := sum(run.refused for run in runs):
        why.append(f"refused samples ({refused} in all)")
    words = " and ".join(why) or f"they are shorter than {config.joystick.debounce_s:g} s"
    return f"{cut_short} begun, and all cut short: {words}"


def assess(
    config: GuardConfig,
    limits: FloatArray,
    runs: Sequence[Run],
    *,
    fresh: bool,
    frozen: int | None = None,
) -> Prediction:
    """Let every forecaster predict every primitive of the runs, in their order.

    Args:
        config: the guard's settings.
        limits: actuator limits (n, 2) [unit], infinite where there are none.
        runs: at least one.
        fresh: each run starts from nothing, instead of what the runs before it taught.
        frozen: only so many runs teach, and only the others are judged; None for all.

    Raises:
        LogError: there is no primitive to predict.
    """
    segments = [run.segments for run in runs]
    judged_runs = runs[frozen or 0 :]
    if not any(run.segments for run in judged_runs):
        names = ", ".join(run.name for run in judged_runs)
        why = _why_none(judged_runs, config)
        raise LogError(f"{names}: no complete primitive, so there is nothing to predict: {why}")
    width, middle = position_range(runs), position_middle(runs)

    def team() -> dict[str, Forecaster]:
        members: tuple[Forecaster, ...] = (
            Zero(),
            LastValue(),
            ConstantVelocity(),
            RunningMean(),
            NearestNeighbours(width),
            GaussianProcess(width),
            GaussianProcess(width, optimise=True),
            RiverLeastSquares(width, middle),
            FaithfulRampe(len(width)),
            SiteRampe(config, limits),
        )
        return dict(zip(FORECASTERS, members, strict=True))

    trials = prequential(segments, team, fresh=fresh, frozen=frozen)
    judged = trials.run >= (frozen or 0)
    foretold = foretell(segments, lambda: SiteRampe(config, limits), fresh=fresh, frozen=frozen)
    told = [one for one, counts in zip(foretold, judged.tolist(), strict=True) if counts]
    top_speed = np.array([a.max_velocity for a in config.actuators])
    asked = odds(told, width, top_speed)
    told_known = [one for one in told if one.seen >= KNOWN]
    return Prediction(
        runs=tuple(runs),
        fresh=fresh,
        width=width,
        total=_errors(trials, width, judged),
        by_run=tuple(_errors(trials, width, judged & (trials.run == k)) for k in range(len(runs))),
        curve=tuple(learning_curve(trials, width, judged)),
        ratios=_ratios(trials, width, judged),
        ratios_known=_ratios(trials, width, judged & known(trials)),
        calibration=_calibration(told, asked, len(width)),
        calibration_known=_calibration(told_known, asked.known(KNOWN), len(width)),
    )


def _errors(trials: Trials, width: FloatArray, chosen: Mask) -> Errors:
    of_known = chosen & known(trials)
    return Errors(
        everything=errors(trials, width, chosen),
        known=errors(trials, width, of_known),
        primitives=int(chosen.sum()),
        primitives_known=int(of_known.sum()),
    )


def _ratios(trials: Trials, width: FloatArray, chosen: Mask) -> dict[str, Interval]:
    others = [name for name in trials.names if name != RAMPE] if chosen.any() else []
    return {name: ratio(trials, width, chosen, RAMPE, name) for name in others}


def _calibration(told: Sequence[Foretold], asked: Odds, actuators: int) -> Calibration:
    return Calibration(
        forecasts=sum(t.forecast is not None for t in told),
        coverage=tuple(coverage(told, actuators, level) for level in LEVELS),
        overall=reliability(asked),
        actuators=tuple(reliability(asked.of(j)) for j in range(actuators)),
    )
