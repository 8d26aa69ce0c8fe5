"""The guard itself on recorded work: what it said of each zone, and the alerts it published.

The score is its probability of contact, the floor what it calls imminent by the stopping path
alone, whatever the site's warning probability.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rampe_guard.assembly import Machine
from rampe_guard.core.alarm import Level
from rampe_guard.core.arrays import Arrays
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent, SweepSummary
from rampe_guard.core.guard import Guard
from rampe_guard.core.monitor import Status
from rampe_guard.core.risk import HORIZONS_S, ZoneRisk
from rampe_guard.core.types import Certificate, FloatArray
from rampe_guard.evaluate.blindness import Blindness
from rampe_guard.evaluate.trace import Mask, Trace, lowered
from rampe_guard.runtime.replay import Steps

Knowledge = Arrays
"""What a guard learned of an operator, models and situations; it can be sent to another process."""


@dataclass(frozen=True, slots=True)
class GuardRun:
    """One log through the guard.

    Attributes:
        trace: what it said at each evaluation.
        certain: what of its floor holds whatever the site's settings (k, z): the arm will touch
            whatever the operator does, is inside, or nothing is known.
        transitions: its published alerts: time [s], zone, level; in order.
        blind: spans in which it did not monitor (b, 2) [s].
        knowledge: what it knows in the end.
    """

    trace: Trace
    certain: Mask
    transitions: tuple[tuple[float, str, Level], ...]
    blind: FloatArray
    knowledge: Knowledge


def guard_trace(
    machine: Machine,
    log: Steps,
    first_s: float,
    zones: tuple[str, ...],
    knowledge: Knowledge | None = None,
    *,
    learn: bool = True,
) -> GuardRun:
    """Let a new guard of the machine follow a log.

    Args:
        machine: loaded.
        log: its steps.
        first_s: time at which it begins [s].
        zones: those that are judged.
        knowledge: what earlier logs taught, None for nothing.
        learn: whether this log teaches, too.
    """
    guard = machine.guard(first_s, "evaluate")
    if knowledge is not None:
        guard.rampe.restore(knowledge)
        guard.situations.restore(knowledge)
    if not learn:
        _freeze(guard)
    alerts = machine.site.guard.alerts
    notes = _Notes(zones)
    transitions: list[tuple[float, str, Level]] = []
    shown: dict[str, Level] = {}
    last: tuple[ZoneRisk, ...] = ()
    blindness = Blindness()
    for now_s, inputs in log.steps():
        events = guard.step(inputs, now_s)
        told = guard.snapshot(now_s)
        blindness.take(now_s, monitoring=told.health.status is not Status.NOT_MONITORING)
        if inputs.actuators and told.risks is not last:
            last = told.risks
            notes.take(now_s, last, _floors(told.sweeps, last, alerts, shown))
        for event in events:
            if isinstance(event, AlertEvent) and event.zone != SYSTEM_ZONE:
                transitions.append((now_s, event.zone, event.level))
                shown[event.zone] = event.level
    known = {**guard.rampe.snapshot(), **guard.situations.snapshot()}
    return GuardRun(notes.trace(), notes.certain(), tuple(transitions), blindness.spans, known)


@dataclass(frozen=True, slots=True)
class _Floor:
    """What the stopping path alone says of a zone.

    Attributes:
        on: it makes it imminent.
        certain: it would with any settings.
    """

    on: bool = False
    certain: bool = False


class _Notes:
    """What was said of some zones, evaluation by evaluation."""

    def __init__(self, zones: tuple[str, ...]) -> None:
        self._zones = zones
        self._column = {zone: z for z, zone in enumerate(zones)}
        self._time_s: list[float] = []
        self._score: list[list[float]] = []
        self._floor: list[list[bool]] = []
        self._certain: list[list[bool]] = []
        self._within: list[list[tuple[float, ...]]] = []

    def take(self, now_s: float, risks: tuple[ZoneRisk, ...], floors: dict[str, _Floor]) -> None:
        """Take one evaluation: risks, and the floors with whether each is certain."""
        z = len(self._zones)
        score, within = [0.0] * z, [(0.0,) * len(HORIZONS_S)] * z
        for risk in risks:
            at = self._column.get(risk.zone)
            if at is not None:
                score[at], within[at] = risk.probability, risk.within
        self._time_s.append(now_s)
        self._score.append(score)
        self._within.append(within)
        none = _Floor()
        found = [floors.get(zone, none) for zone in self._zones]
        self._floor.append([floor.on for floor in found])
        self._certain.append([floor.certain for floor in found])

    def certain(self) -> Mask:
        """Floors that are certain (k, z)."""
        shape = (len(self._time_s), len(self._zones))
        return np.array(self._certain, dtype=np.bool_).reshape(shape)

    def trace(self) -> Trace:
        """All that was said."""
        shape = (len(self._time_s), len(self._zones))
        within = np.array(self._within, dtype=np.float64).reshape(*shape, len(HORIZONS_S))
        return Trace(
            np.array(self._time_s),
            self._zones,
            np.array(self._score, dtype=np.float64).reshape(shape),
            np.array(self._floor, dtype=np.bool_).reshape(shape),
            HORIZONS_S,
            np.moveaxis(within, -1, 0),
        )


def _floors(
    sweeps: tuple[SweepSummary, ...],
    risks: tuple[ZoneRisk, ...],
    alerts: AlertConfig,
    shown: dict[str, Level],
) -> dict[str, _Floor]:
    """Zones that the stopping path touches, as `core.levels` judges them.

    Args:
        sweeps: of all forecasts.
        risks: of all zones.
        alerts: settings.
        shown: the level of each zone's alert before this evaluation.

    """
    risk_of = {risk.zone: risk for risk in risks}
    found = {}
    for told in sweeps:
        sweep = told.zone
        free = sweep.certificate is Certificate.FREE or (sweep.inside and not sweep.closing)
        if told.source != "stopping" or free:
            continue
        risk = risk_of[sweep.zone]
        least = alerts.imminent_probability
        if shown.get(sweep.zone, Level.CLEAR) >= Level.IMMINENT:
            least = lowered(least, alerts.deadband_probability)
        certain = sweep.certificate is Certificate.UNKNOWN or sweep.inside or risk.floor
        found[sweep.zone] = _Floor(certain or risk.instant >= least, certain)
    return found


def _freeze(guard: Guard) -> None:
    """Let it learn nothing more."""
    rampe, situations = guard.rampe, guard.situations
    rampe.observe = lambda *_args, **_more: None  # type: ignore[method-assign]
    rampe.learn_passing = lambda *_args, **_more: None  # type: ignore[method-assign]
    situations.see = lambda *_args, **_more: None  # type: ignore[method-assign]
