"""From what was found out about a sequence to its report."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any, Final

import numpy as np

from rampe_guard import __version__
from rampe_guard.assembly import Machine
from rampe_guard.core.alarm import Level
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate import report_model as form
from rampe_guard.evaluate.baselines import (
    DESCRIPTIONS,
    FAMILY_NEAR,
    FAMILY_S,
    constant_velocity,
    proximity,
    traces,
)
from rampe_guard.evaluate.blindness import blind_s
from rampe_guard.evaluate.crew import Findings
from rampe_guard.evaluate.definitions import DEFINITIONS, GUARD, GUARDS, SPARING
from rampe_guard.evaluate.episodes import (
    alert_episodes,
    inside_at_first_s,
    spans_from_transitions,
)
from rampe_guard.evaluate.foretold import foretold
from rampe_guard.evaluate.judging import (
    THRESHOLDS,
    Judged,
    Truth,
    curve,
    outcomes,
    point,
    pooled,
    truth,
)
from rampe_guard.evaluate.odds import odds
from rampe_guard.evaluate.outcome import FALSE, TRUE, UNDECIDED, judge
from rampe_guard.evaluate.points import Figures, Pool, Spread, figures, pool, spread
from rampe_guard.evaluate.prediction_report import report as prediction_report
from rampe_guard.evaluate.stages import judged_zones
from rampe_guard.evaluate.touch import Touch
from rampe_guard.evaluate.trace import Manners, Trace, manners

TOLD: Final = 0.02
"""Probability from which an answer tells of a contact [-]."""
_HALF: Final = 0.5
_VERDICTS = {TRUE: "true", FALSE: "false", UNDECIDED: "undecided"}
_LIBRARIES = ("numpy", "scipy", "scikit-learn", "river")
_SLUGS = {
    "running mean": "mean",
    "RAMPE": "rampe",
    "RAMPE, faithful": "rampe_faithful",
    "5 nearest neighbours": "nearest_neighbours_5",
    "Gaussian process, optimised": "gaussian_process_optimised",
    "RLS of river": "rls_of_river",
}


@dataclass(frozen=True, slots=True)
class _Case:
    """What every part of the report is made from."""

    truths: tuple[Truth, ...]
    threshold: float
    how: Manners


def report(found: Findings, machine: Machine) -> form.Report:
    """The report of one sequence.

    Args:
        found: all of its logs.
        machine: of its site.
    """
    site, order = machine.site, found.order
    skip = order.frozen or 0
    works, guards = found.works[skip:], found.guards[skip:]
    zones = judged_zones(machine)
    truths = tuple(
        truth(w.name, zones, w.contacts, w.window, g.blind)
        for w, g in zip(works, guards, strict=True)
    )
    alerts = site.guard.alerts
    case = _Case(truths, alerts.warning_probability, manners(alerts))
    unit = _units(found, machine, zones)
    by_log = [traces(w.raw, unit) for w in works]
    said = [g.trace for g in guards]
    sparing = [replace(g.trace, floor=g.certain) for g in guards]
    forecasts = {
        GUARD: _forecast(GUARDS[GUARD], said, case, sparing),
        SPARING: _forecast(GUARDS[SPARING], sparing, case),
    }
    for name, text in DESCRIPTIONS.items():
        forecasts[name] = _forecast(text, [made[name] for made in by_log], case)
    details = prediction_report(found.prediction, site)
    return form.Report(
        versions={
            "rampe-guard": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in _LIBRARIES},
        },
        name=order.name,
        site=site.name,
        machine=site.machine,
        knowledge=_knowledge(found),
        zones=zones,
        zones_left_out=tuple(n for n in machine.sweeper.zones if n not in zones),
        learned_from=tuple(w.name for w in found.works[:skip]),
        duration_s=sum(w.window[1] - w.window[0] for w in works),
        not_monitoring_s=sum(blind_s(t.blind, t.window) for t in truths),
        crossings=forecasts[GUARD].operating_point.crossings,
        warning_probability=case.threshold,
        definitions=DEFINITIONS,
        forecasts=forecasts,
        trade_offs={
            "constant_velocity": _trade_off(
                "horizon_s",
                FAMILY_S,
                lambda h: [constant_velocity(w.raw, h) for w in works],
                case,
            ),
            "proximity": _trade_off(
                "share of the actuator's range, or of the arm's reach",
                FAMILY_NEAR,
                lambda near: [proximity(w.raw, near, unit) for w in works],
                case,
            ),
        },
        published=_published(truths, [g.transitions for g in guards]),
        reliability=_reliability(truths, said),
        prediction=_prediction(details),
        prediction_details=details,
        logs=tuple(
            form.LogLine(
                log=w.name,
                start_s=w.window[0],
                duration_s=w.window[1] - w.window[0],
                warnings=w.warnings,
                not_monitoring_s=blind_s(t.blind, t.window),
                not_monitoring=tuple((a, _or_none(b)) for a, b in t.blind.tolist()),
                zones=_lines(t, g.trace, case),
            )
            for w, t, g in zip(works, truths, guards, strict=True)
        ),
    )


def _knowledge(found: Findings) -> str:
    order = found.order
    if order.fresh:
        return "each log from nothing"
    if order.frozen is not None:
        return f"learned from the first {order.frozen} logs, then frozen; the others are judged"
    return "carried over from log to log: of each log, only those before it were known"


def _units(found: Findings, machine: Machine, zones: tuple[str, ...]) -> FloatArray:
    """By zone: range of the actuator over all logs, or reach of the arm (z,) [unit]."""
    low = np.min([w.low for w in found.works], axis=0)
    high = np.max([w.high for w in found.works], axis=0)
    reach_m = max(w.reach_m for w in found.works)
    touch = Touch(machine.sweeper, zones)
    limits = [touch.limit_of(zone) for zone in zones]
    return np.array(
        [reach_m if item is None else (high - low)[item.actuator] for item in limits],
        dtype=np.float64,
    )


def _forecast(
    text: str, said: Sequence[Trace], case: _Case, along: Sequence[Trace] | None = None
) -> form.Forecast:
    """How good a forecaster is; ``along`` is what it says along its curve, if that is another."""
    along = said if along is None else along
    binary = all(trace.binary for trace in said)
    how = case.how
    # of yes and no, any threshold between them says the same
    least = _HALF if binary else case.threshold
    at = point(case.truths, said, least, how)
    columns = range(len(case.truths[0].zones))
    return form.Forecast(
        description=text,
        binary=binary,
        curve=(_point(at, None),)
        if binary
        else tuple(
            _point(j, j.threshold)
            for j in curve(case.truths, THRESHOLDS, lambda threshold: (along, threshold), how)
        ),
        operating_point=_point(at, None if binary else case.threshold),
        by_log={
            t.name: _point(point([t], [s], least, how), None if binary else least)
            for t, s in zip(case.truths, said, strict=True)
        },
        by_zone={
            case.truths[0].zones[z]: _one_zone(z, said, case, least, binary=binary) for z in columns
        },
        leads_s=_leads(pooled(case.truths, said, least, how)),
    )


def _leads(of: Pool) -> tuple[float | None, ...]:
    return tuple(None if np.isnan(lead) else lead for lead in of.lead_s.tolist())


def _one_zone(
    z: int, said: Sequence[Trace], case: _Case, least: float, *, binary: bool
) -> form.Point:
    alone = [replace(t, zones=(t.zones[z],), contacts=(t.contacts[z],)) for t in case.truths]
    heard = [Trace(s.time_s, (s.zones[z],), s.score[:, [z]], s.floor[:, [z]]) for s in said]
    at = point(alone, heard, least, case.how)
    return _point(at, None if binary else least)


def _trade_off(
    parameter: str,
    values: Sequence[float],
    make: Callable[[float], Sequence[Trace]],
    case: _Case,
) -> form.TradeOff:
    judged = curve(case.truths, values, lambda value: (make(value), _HALF), case.how)
    return form.TradeOff(parameter=parameter, curve=tuple(_point(j, j.threshold) for j in judged))


def _published(
    truths: Sequence[Truth], transitions: Sequence[Sequence[tuple[float, str, Level]]]
) -> dict[str, form.LevelTable]:
    """The guard's own alerts: of all zones, and of each."""
    spans = [spans_from_transitions(told) for told in transitions]
    tables = {}
    for level in (Level.IMMINENT, Level.WARNING, Level.CAUTION):
        judged = [
            tuple(
                judge(t.contacts[z], np.array(alert_episodes(s, zone, level)), t.window, t.blind)
                for z, zone in enumerate(t.zones)
            )
            for t, s in zip(truths, spans, strict=True)
        ]
        pools = {"": pool(judged)}
        for z, zone in enumerate(truths[0].zones):
            pools[zone] = pool((log[z],) for log in judged)
        points = {
            zone: _point(Judged(0.0, figures(found), None, spread(found)), None)
            for zone, found in pools.items()
        }
        tables[level.word] = form.LevelTable(
            total=points.pop(""), zones=points, leads_s=_leads(pools[""])
        )
    return tables


def _reliability(truths: Sequence[Truth], said: Sequence[Trace]) -> tuple[form.ReliabilityOf, ...]:
    tables = []
    for index, horizon_s in enumerate(said[0].horizons_s):
        answers = foretold(truths, said, index)
        found = odds(*answers)
        told = answers[0] >= TOLD
        of_told = odds(answers[0][told], answers[1][told], answers[2][told])
        tables.append(
            form.ReliabilityOf(
                horizon_s=horizon_s,
                answers=found.answers,
                calibration_error=found.error,
                calibration_error_interval=found.spread,
                answers_told=of_told.answers,
                calibration_error_told=of_told.error,
                bins=tuple(
                    form.ReliabilityBin(
                        said=b.said,
                        happened=b.happened,
                        happened_interval=b.spread,
                        count=b.count,
                    )
                    for b in found.bins
                ),
            )
        )
    return tuple(tables)


def _prediction(details: Mapping[str, Any]) -> dict[str, form.PredictionError]:
    total = details["total"]
    errors = {}
    for name, everything in total["all"].items():
        best = total["known"].get(name, everything)
        low, _, high = best["interval"]
        slug = _SLUGS.get(name, name.replace(",", "").replace(" ", "_").lower())
        errors[slug] = form.PredictionError(
            name=name,
            rms=best["error"],
            rms_interval=None if low is None else (low, high),
            rms_all=everything["error"],
            answered=everything["answered"],
        )
    return errors


def _lines(truth: Truth, trace: Trace, case: _Case) -> dict[str, form.ZoneLine]:
    lines = {}
    judged = outcomes(truth, trace, case.threshold, case.how)
    for zone, contacts, outcome in zip(truth.zones, truth.contacts, judged, strict=True):
        alarms = zip(outcome.alarms.tolist(), outcome.verdict.tolist(), strict=True)
        lines[zone] = form.ZoneLine(
            contacts=tuple((a, _or_none(b)) for a, b in contacts.tolist()),
            inside_at_first_s=inside_at_first_s(contacts, truth.window),
            alarms=tuple((a, _or_none(b), _VERDICTS[verdict]) for (a, b), verdict in alarms),
        )
    return lines


def _or_none(end_s: float) -> float | None:
    """An end that never came is none."""
    return None if np.isinf(end_s) else end_s


def _point(judged: Judged, threshold: float | None) -> form.Point:
    found: Figures = judged.figures
    return form.Point(
        threshold=threshold,
        false_per_min_per_zone=found.false_per_min_per_zone,
        alarmed_share=found.alarmed_share,
        warned_0_5_s=found.warned[0],
        warned_1_0_s=found.warned[1],
        warned_1_5_s=found.warned[2],
        warned_2_0_s=found.warned[3],
        median_lead_s=found.median_lead_s,
        lead_5_percent_s=found.lead_5_percent_s,
        crossings=found.crossings,
        unmonitored=found.unmonitored,
        missed=found.missed,
        alarms=found.alarms,
        false_alarms=found.false_alarms,
        undecided=found.undecided,
        zone_minutes=found.zone_minutes,
        strict=None if judged.strict is None else _strict(judged.strict),
        intervals=None if judged.spread is None else _intervals(judged.spread),
    )


def _strict(found: Figures) -> form.Strict:
    return form.Strict(
        false_per_min_per_zone=found.false_per_min_per_zone,
        alarmed_share=found.alarmed_share,
        warned_0_5_s=found.warned[0],
        warned_1_0_s=found.warned[1],
        warned_1_5_s=found.warned[2],
        warned_2_0_s=found.warned[3],
        median_lead_s=found.median_lead_s,
        missed=found.missed,
    )


def _intervals(around: Spread) -> form.Intervals:
    return form.Intervals(
        false_per_min_per_zone=around.false_per_min_per_zone,
        warned_0_5_s=around.warned[0],
        warned_1_0_s=around.warned[1],
        warned_1_5_s=around.warned[2],
        warned_2_0_s=around.warned[3],
        missed=around.missed,
        median_lead_s=around.median_lead_s,
        lead_5_percent_s=around.lead_5_percent_s,
    )
