"""All alerts of a machine: one alarm per zone and one for the system itself.

Turns evidence into published alerts: transitions at once, repeats while active, and frozen
repeats marked stale while the guard cannot see. Alarms of zones live by the machine's time;
what people ask for (shelving) goes by the guard's own clock, which never stands still.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from rampe_guard.core.alarm import Alarm, Inhibit, Level, urgency
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import (
    SYSTEM_ZONE,
    AlertEvent,
    Evidence,
    PredictionSummary,
    Quality,
)
from rampe_guard.core.types import Certificate
from rampe_guard.errors import RefusedError

_CALM = Evidence(Level.CLEAR, "system", None, None, None)
_GONE = Evidence(Level.CLEAR, "contact", None, None, None)
"""Of a zone that is no more: nothing can be met, and nobody computes how near it is."""


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
        self._link: dict[str, str | None] = {}
        self._published_s: dict[str, float] = {}
        self._raised_s: dict[str, float] = {}
        self._changed_s: dict[str, float] = {}
        self._stale = self._off = False
        self._gone: set[str] = set()
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
        for zone in self._gone:
            events += self._one(zone, _GONE, moment)
        self._gone = {zone for zone in self._gone if self._alarms[zone].active}
        return events

    def change_zones(self, zones: Collection[str]) -> None:
        """Other zones from now on. An alert of one that is gone ends as any other does."""
        known = {zone for zone in self._alarms if zone != SYSTEM_ZONE}
        self._gone = {zone for zone in known - set(zones) if self._alarms[zone].active}

    def system(self, evidence: Evidence, moment: Moment) -> list[AlertEvent]:
        """Take the evidence about the guard itself (latched)."""
        return self._one(SYSTEM_ZONE, evidence, moment)

    def freeze(self, moment: Moment) -> list[AlertEvent]:
        """The guard cannot see: nothing changes, and what is active is marked stale."""
        first = not self._stale
        self._stale = True
        zones = [z for z, a in self._alarms.items() if a.active and z != SYSTEM_ZONE]
        return [self._event(z, "repeat", moment) for z in zones if first or self._due(z, moment)]

    def switch_off(self, moment: Moment) -> list[AlertEvent]:
        """The machine is off: alerts of zones return, and none is raised until `switch_on`."""
        self._off, self._stale = True, False
        events = []
        for zone, alarm in self._alarms.items():
            if zone != SYSTEM_ZONE and alarm.switch_off(_clock(zone, moment)):
                events.append(self._changed(zone, moment))
        return [*events, *self.repeats(moment)]

    def switch_on(self) -> None:
        """The machine is on."""
        if self._off:
            self._off = False
            for alarm in self._alarms.values():
                alarm.switch_on()

    def lapse(self, moment: Moment) -> list[AlertEvent]:
        """End every shelving whose time is up, whether or not the guard can see."""
        over = [zone for zone, alarm in self._alarms.items() if alarm.lapse(moment.now_s)]
        return [self._changed(zone, moment) for zone in over]

    def repeats(self, moment: Moment) -> list[AlertEvent]:
        """Repeats that are due for active alerts."""
        active = [z for z, a in self._alarms.items() if a.active]
        return [self._event(z, "repeat", moment) for z in active if self._due(z, moment)]

    def acknowledge(self, alert_id: str, who: str, moment: Moment) -> list[AlertEvent]:
        """Acknowledge an alert by its id; empty if there is none of that id to acknowledge."""
        zone = self._zone(alert_id)
        if zone is None or not self._alarms[zone].acknowledge(who):
            return []
        return [self._changed(zone, moment)]

    def shelve(
        self, alert_id: str, who: str, duration_s: float, moment: Moment
    ) -> list[AlertEvent]:
        """Silence an alert for ``duration_s`` from now on; 0 ends its silence.

        Raises:
            RefusedError: there is no such alert, or it may not be silent (for so long).
        """
        zone = self._zone(alert_id)
        if zone is None:
            raise RefusedError(f"no alert {alert_id!r} is shown")
        alarm = self._alarms[zone]
        if duration_s > 0.0:
            alarm.shelve(who, duration_s, moment.now_s)
        elif not alarm.unshelve():
            raise RefusedError(f"alert {alert_id!r} is not shelved")
        return [self._changed(zone, moment)]

    def active(self, moment: Moment) -> list[AlertEvent]:
        """All active alerts, the most urgent first, for whoever comes late; not published."""
        shown = [
            self._build(z, "repeat", moment, self.seq) for z, a in self._alarms.items() if a.active
        ]
        return sorted(
            shown, key=lambda e: (*urgency(e.level, e.evidence.time_to_collision_s), e.zone)
        )

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
            if found.level and found.sweep is not None:
                self._link[zone] = found.sweep.link
        if changed:
            return [self._changed(zone, moment)]
        if was_active and self._due(zone, moment):
            return [self._event(zone, "repeat", moment)]
        return []

    def _zone(self, alert_id: str) -> str | None:
        """The zone of an alert that is shown, by its id."""
        shown = (zone for zone, alarm in self._alarms.items() if alarm.active)
        return next((zone for zone in shown if self._id(zone) == alert_id), None)

    def _changed(self, zone: str, moment: Moment) -> AlertEvent:
        self._changed_s[zone] = moment.now_s
        alarm = self._alarms[zone]
        if not alarm.active:
            alarm.latched = zone == SYSTEM_ZONE
        return self._event(zone, "transition", moment)

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
            link=self._link.get(zone),
            prediction=moment.prediction,
            stamp_s=moment.stamp_s,
            now_s=moment.now_s,
            input_age_s=moment.input_age_s,
            raised_s=self._raised_s[zone],
            changed_s=self._changed_s[zone],
            acked_by=alarm.acked_by,
            inhibit=self._inhibit(alarm),
            shelved_by=alarm.shelved_by,
            shelved_until_s=alarm.shelved_until_s,
        )

    def _inhibit(self, alarm: Alarm) -> Inhibit:
        """The system's own alarm is never suppressed, but without a cause it is off like all."""
        if self._off and alarm.level is Level.CLEAR:
            return Inhibit.MACHINE_OFF
        return alarm.inhibit

    def _quality(self, zone: str, found: Evidence, moment: Moment) -> Quality:
        if self._stale and zone != SYSTEM_ZONE:
            return "stale"
        unknown = found.sweep is not None and found.sweep.certificate is Certificate.UNKNOWN
        return "degraded" if moment.degraded or unknown else "good"


def _clock(zone: str, moment: Moment) -> float:
    return moment.now_s if zone == SYSTEM_ZONE else moment.machine_s
