"""One evaluation: from the present state to the evidence about every zone.

::

    stopping path ─► sweep ─┐
    intent path ───► sweep ─┼─► one probability per zone and horizon ─► level and evidence
    scenarios ─────► sweep ─┘

A zone that is met whatever the operator does, or in which the arm is, cannot become more urgent
by what is foreseen: the intent path is not swept against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from rampe_guard.core.alarm import Level
from rampe_guard.core.config import GuardConfig
from rampe_guard.core.events import Evidence, SweepSummary
from rampe_guard.core.forecast import Forecast, Forecaster, IntentForecast, StoppingForecast
from rampe_guard.core.foresight import Foresight, Outlook
from rampe_guard.core.intention import Intention
from rampe_guard.core.levels import LevelRules, worst
from rampe_guard.core.risk import RiskBook, Threat, ZoneRisk
from rampe_guard.core.types import Certificate, FloatArray, PathSweeper, Placement, ZoneSweep


@dataclass(frozen=True, slots=True)
class State:
    """The machine now: position, velocity (n,) each, and the stamp of the position [s]."""

    q: FloatArray
    velocity: FloatArray
    stamp_s: float


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The scene now.

    Attributes:
        placed: where the zones that move are.
        restless: whether a zone may come nearer whatever the arm does.
        shown: the level that a zone's alert shows.
    """

    placed: dict[str, Placement | None]
    restless: Callable[[str], bool]
    shown: Callable[[str], Level]


@dataclass(frozen=True, slots=True)
class Assessed:
    """What one evaluation found.

    Attributes:
        evidence: the most urgent of each zone.
        risks: the probability of contact with each zone.
        sweeps: what the forecasts met, for the prediction message.
        unknown: a sweep that should have had an answer had none.
    """

    evidence: dict[str, Evidence]
    risks: tuple[ZoneRisk, ...]
    sweeps: tuple[SweepSummary, ...]
    unknown: bool


class Assessor:
    """Evaluates.

    Args:
        config: settings.
        limits: actuator limits (n, 2) [unit].
        sweeper: geometry.
    """

    def __init__(self, config: GuardConfig, limits: FloatArray, sweeper: PathSweeper) -> None:
        alerts = config.alerts
        tail = max(alerts.caution_probability - alerts.deadband_probability, 0.02)
        self._sweeper = sweeper
        self._forecaster = Forecaster(config.actuators, limits, config.stopping.reaction_s, tail)
        self._reaction_s = config.stopping.reaction_s
        self._rules = LevelRules(alerts)
        self._book = RiskBook(config.next.horizon_s)
        self.foresight = Foresight(config, limits)

    def interrupt(self) -> None:
        """Something was missing: what was, says nothing of what is."""
        self.foresight.interrupt()
        self._book.forget()

    def change_scene(self, sweeper: PathSweeper) -> None:
        """Sweep by another geometry from now on: what was found of the old one is dropped."""
        self._sweeper = sweeper
        self.foresight.look_anew()
        self._book.forget()

    def assess(self, state: State, intention: Intention, around: Surroundings) -> Assessed:
        """Evaluate the present state."""
        stopping = self._forecaster.stopping(state.q, state.velocity, intention.command)
        intent = self._intent(state, intention)
        stops = self._swept(state.q, stopping, None, around)
        threats = {name: _threat(stopping, stop, around) for name, stop in stops.items()}
        intents: dict[str, ZoneSweep] = {}
        if intent is not None:
            settled = {name for name, threat in threats.items() if threat.too_late}
            asked = frozenset(stops.keys() - settled) if settled else None
            intents = self._swept(state.q, intent, asked, around)
        outlook = self.foresight.look(state.stamp_s, state.q, self._sweeper, around.placed)
        stop_s = max(stopping.stop_s, self._reaction_s)
        self._book.begin(state.stamp_s)
        evidence, risks, sweeps = {}, [], []
        for name, stop in stops.items():
            threat = _with_intent(threats[name], intent, intents.get(name))
            risk = self._book.weigh(name, threat, outlook, stop_s, state.stamp_s)
            risks.append(risk)
            shown = around.shown(name)
            at_stop = self._rules.stopping(stopping, stop, risk, shown)
            likely = _likeliest(risk, stop, intents.get(name), outlook)
            found = [at_stop]
            if likely is not None and not threat.too_late:
                met = self._rules.foreseen(likely, risk, shown, stop_s)
                found.append(_explained(met, outlook) if risk.source == "next" else met)
            evidence[name] = worst(found)
            sweeps += _summaries(stop, at_stop, threat, intents.get(name), outlook)
        unknown = any(
            zone.certificate is Certificate.UNKNOWN
            and around.placed.get(zone.zone, True)  # what is not placed has a reason already
            for zone in (*stops.values(), *intents.values())
        )
        return Assessed(evidence, tuple(risks), tuple(sweeps), unknown)

    def _intent(self, state: State, intention: Intention) -> IntentForecast | None:
        current, known = intention.current, intention.forecast
        if current is None or known is None:
            return None
        return self._forecaster.intent(
            state.q, state.velocity, intention.command, current, known, intention.under_way()
        )

    def _swept(
        self,
        q: FloatArray,
        forecast: Forecast,
        only: frozenset[str] | None,
        around: Surroundings,
    ) -> dict[str, ZoneSweep]:
        """What the sweep of a forecast proved, by zone."""
        result = self._sweeper.sweep(
            q, forecast.displacement, clearance=False, only=only, placed=around.placed
        )
        found = {}
        for entry in result.zones:
            zone = entry
            if around.restless(zone.zone):
                zone = replace(zone, closing=True)  # whatever the arm does
            if around.shown(zone.zone) and self._rules.grazes(zone):
                zone = self._surer(q, forecast.displacement, zone, around)
            found[zone.zone] = zone
        return found

    def _surer(
        self, q: FloatArray, displacement: FloatArray, zone: ZoneSweep, around: Surroundings
    ) -> ZoneSweep:
        """A free zone whose alert is shown: a weak bound must not hold it.

        Asks whether the way keeps clear of the deadband too, which is far quicker to tell than
        how near it comes.
        """
        zones = self._sweeper.sweep(
            q,
            displacement,
            clearance=False,
            wider_m=self._rules.alerts.deadband_m,
            only=frozenset([zone.zone]),
            placed=around.placed,
        ).zones
        wide = next(found for found in zones if found.zone == zone.zone)
        closing = wide.closing or around.restless(zone.zone)
        now = zone.clearance_now_m if wide.clearance_now_m is None else wide.clearance_now_m
        zone = replace(zone, closing=closing, clearance_now_m=now)
        if wide.certificate is Certificate.FREE:
            zone = replace(zone, clearance_m=wide.clearance_m)
        return zone


def _threat(stopping: StoppingForecast, stop: ZoneSweep, around: Surroundings) -> Threat:
    """What the stopping path alone says of a zone."""
    if stop.certificate is Certificate.FREE or (stop.inside and not stop.closing):
        return Threat()
    time_s = stopping.time_at(stop.contact_fraction or 0.0)
    # memory says what the operator does, not what an object does that moves, nor what is unknown
    blind = stop.certificate is Certificate.UNKNOWN or around.restless(stop.zone)
    return Threat(time_s, too_late=blind or stop.inside or time_s <= stopping.brake_s)


def _with_intent(threat: Threat, intent: IntentForecast | None, met: ZoneSweep | None) -> Threat:
    if intent is None or met is None or met.certificate is Certificate.FREE:
        return threat
    if met.inside and not met.closing:
        return threat
    at = met.contact_fraction or 0.0
    return replace(threat, intent=intent.probability_at(at), intent_s=intent.time_at(at))


def _likeliest(
    risk: ZoneRisk, stop: ZoneSweep, intent: ZoneSweep | None, outlook: Outlook
) -> ZoneSweep | None:
    """The sweep behind what is foreseen of a zone; None where the arm is in it."""
    if stop.inside:
        return intent
    meeting = outlook.first(risk.zone) if risk.source == "next" else None
    if meeting is not None:
        return replace(
            meeting.sweep,
            clearance_now_m=stop.clearance_now_m,
            contact_fraction=meeting.share,
            closing=True,
        )
    for sweep in (intent, stop):
        if sweep is not None and sweep.certificate is not Certificate.FREE:
            return sweep
    return intent


def _explained(evidence: Evidence, outlook: Outlook) -> Evidence:
    """The situations behind it."""
    sweep = evidence.sweep
    meeting = None if sweep is None else outlook.first(sweep.zone)
    if sweep is None or meeting is None or outlook.position is None:
        return evidence
    met = sum(m.count for m in outlook.meetings[sweep.zone])
    return replace(evidence, similar=outlook.count, met=met, onward=outlook.position + meeting.end)


def _summaries(
    stop: ZoneSweep,
    at_stop: Evidence,
    threat: Threat,
    intent: ZoneSweep | None,
    outlook: Outlook,
) -> list[SweepSummary]:
    """What each forecast met of one zone."""
    touched = stop.certificate is not Certificate.FREE
    chance = at_stop.probability or 0.0
    told = [SweepSummary("stopping", stop, chance if touched else 0.0, at_stop.time_to_collision_s)]
    if intent is not None:
        time_s = None if math.isinf(threat.intent_s) else threat.intent_s
        told.append(SweepSummary("intent", intent, threat.intent, time_s))
    meeting = outlook.first(stop.zone)
    if meeting is not None:
        share = sum(m.weight for m in outlook.meetings[stop.zone]) / outlook.weight
        told.append(SweepSummary("next", meeting.sweep, min(share, 1.0), meeting.time_s))
    return told
