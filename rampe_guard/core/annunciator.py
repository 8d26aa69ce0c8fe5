"""All alerts of a machine: one alarm per zone and one for the system itself.

Turns evidence into published alerts: transitions at once, repeats while active, and frozen
repeats marked stale while the guard cannot see.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rampe_guard.core.alarm import Alarm, Level
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import (
    SYSTEM_ZONE,
    AlertEvent,
    Evidence,
    PredictionSummary,
    Quality,
)
from rampe_guard.core.types import Certificate

_CALM = Evidence(Level.CLEAR, "system", None, None, None)


@dataclass(frozen=True, slots=True)
class Moment:
    """What every alert of a step has in common.

    ``machine_s`` is the time that passed by the stamps of the positions [s]. Alarms of zones
    live by it, so that they do the same live, in replay, and at any speed of replay.
    """

    now_s: float
    machine_s: float
    stamp_s: float | None
    input_age_s: float | None
    prediction: PredictionSummary | None
    degraded: bool = False


class Annunciator:
    """Publishes alerts.

    Args:
        config: life-cycle times.
        boot_id: makes alert ids unique across restarts.
    """

    def __init__(self, config: AlertConfig, boot_id: str) -> None:
        self._config = config
        self._boot_id = boot_id
        self._alarms: dict[str, Alarm] = {}
        self._evidence: dict[str, Evidence] = {}
        self._published_s: dict[str, float] = {}
        self._raised_s: dict[str, float] = {}
        self._changed_s: dict[str, float] = {}
        self._stale = False
        self.seq = 0

    def shown(self, zone: str) -> Level:
        """The level that a zone's alert shows now."""
        alarm = self._alarms.get(zone)
        return alarm.level if alarm else Level.CLEAR

    def update(self, evidence: Mapping[str, Evidence], moment: Moment) -> list[AlertEvent]:
        """Take one evaluation of all zones; returns the alerts to publish."""
        self._stale = False
        events = []
        for zone, found in evidence.items():
            events += self._one(zone, found, moment)
        return events

    def system(self, evidence: Evidence, moment: Moment) -> list[AlertEvent]:
        """Take the evidence about the guard itself (latched)."""
        return self._one(SYSTEM_ZONE, evidence, moment)

    def freeze(self, moment: Moment) -> list[AlertEvent]:
        """The guard cannot see: nothing changes, and what is active is marked stale."""
        first = not self._stale
        self._stale = True
        zones = [z for z, a in self._alarms.items() if a.active and z != SYSTEM_ZONE]
        return [self._event(z, "repeat", moment) for z in zones if first or self._due(z, moment)]

    def repeats(self, moment: Moment) -> list[AlertEvent]:
        """Repeats that are due for active alerts."""
        active = [z for z, a in self._alarms.items() if a.active]
        return [self._event(z, "repeat", moment) for z in active if self._due(z, moment)]

    def acknowledge(self, alert_id: str, who: str, moment: Moment) -> list[AlertEvent]:
        """Acknowledge an alert by its id; empty if there is none of that id to acknowledge."""
        for zone, alarm in self._alarms.items():
            if self._id(zone) == alert_id and alarm.acknowledge(who, _clock(zone, moment)):
                self._changed_s[zone] = moment.now_s
                return [self._event(zone, "transition", moment)]
        return []

    def active(self, moment: Moment) -> list[AlertEvent]:
        """All active alerts, for whoever comes late; not counted as published."""
        return [
            self._build(z, "repeat", moment, self.seq) for z, a in self._alarms.items() if a.active
        ]

    def _one(self, zone: str, found: Evidence, moment: Moment) -> list[AlertEvent]:
        alarm = self._alarms.get(zone)
        if alarm is None:
            alarm = Alarm(self._config, latched=zone == SYSTEM_ZONE)
            self._alarms[zone] = alarm
        if found.sweep is not None and found.sweep.touching and found.level:
            alarm.latched = True
        was_active, number = alarm.active, alarm.number
        changed = alarm.step(found.level, _clock(zone, moment))
        if alarm.number != number:
            self._raised_s[zone] = moment.now_s
        # between cause and release the alert goes on telling of its last cause
        if found.level >= alarm.level or zone not in self._evidence:
            self._evidence[zone] = found
        if changed:
            self._changed_s[zone] = moment.now_s
            event = self._event(zone, "transition", moment)
            if not alarm.active:
                alarm.latched = zone == SYSTEM_ZONE
            return [event]
        if was_active and self._due(zone, moment):
            return [self._event(zone, "repeat", moment)]
        return []

    def _due(self, zone: str, moment: Moment) -> bool:
        # a hair less than the period, so that a 5 Hz repeat survives rounding of ticks
        return moment.now_s - self._published_s.get(zone, 0.0) >= self._config.republish_s - 1e-6

    def _event(self, zone: str, kind: str, moment: Moment) -> AlertEvent:
        self.seq += 1
        self._published_s[zone] = moment.now_s
        return self._build(zone, kind, moment, self.seq)

    def _id(self, zone: str) -> str:
        return f"{self._boot_id}.{zone}.{self._alarms[zone].number}"

    def _build(self, zone: str, kind: str, moment: Moment, seq: int) -> AlertEvent:
        alarm, found = self._alarms[zone], self._evidence.get(zone, _CALM)
        return AlertEvent(
            kind="transition" if kind == "transition" else "repeat",
            alert_id=self._id(zone),
            seq=seq,
            zone=zone,
            level=alarm.level,
            previous_level=alarm.previous,
            state=alarm.state,
            quality=self._quality(zone, found, moment),
            evidence=found,
            prediction=moment.prediction,
            stamp_s=moment.stamp_s,
            now_s=moment.now_s,
            input_age_s=moment.input_age_s,
            raised_s=self._raised_s[zone],
            changed_s=self._changed_s[zone],
            acked_by=alarm.acked_by,
        )

    def _quality(self, zone: str, found: Evidence, moment: Moment) -> Quality:
        if self._stale and zone != SYSTEM_ZONE:
            return "stale"
        unknown = found.sweep is not None and found.sweep.certificate is Certificate.UNKNOWN
        return "degraded" if moment.degraded or unknown else "good"


def _clock(zone: str, moment: Moment) -> float:
    return moment.now_s if zone == SYSTEM_ZONE else moment.machine_s
