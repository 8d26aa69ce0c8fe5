"""What is worth a line in the list of events, and how early warnings came."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rampe_guard import wire
from rampe_guard.client.items import Alert, Item, ProtectionBack, ProtectionLost
from rampe_guard.core.alarm import Level
from rampe_guard.dashboard.picture import Event
from rampe_guard.dashboard.tones import BY_LEVEL, Tone

KEPT_EVENTS = 40
KEPT_LEADS = 5
_KEPT_ALERTS = 256


def with_items(
    events: tuple[Event, ...], items: tuple[Item, ...], now_s: float
) -> tuple[Event, ...]:
    """Put what happened on top; the same thing said twice in a row is said once."""
    for item in items:
        event = _event(item, now_s)
        if not events or (events[0].tone, events[0].text) != (event.tone, event.text):
            events = (event, *events)[:KEPT_EVENTS]
    return events


def _event(item: Item, now_s: float) -> Event:
    if isinstance(item, Alert):
        return _of_alert(item, now_s)
    if isinstance(item, ProtectionLost):
        return Event(now_s, Tone.LOST, item.text)
    if isinstance(item, ProtectionBack):
        tone = Tone.CALM if item.level == "clear" else Tone.CAUTION
        return Event(now_s, tone, item.text)
    return Event(now_s, Tone.CAUTION, item.text)


def _of_alert(alert: Alert, now_s: float) -> Event:
    zone = alert.zone or "system"
    if alert.over:
        return Event(now_s, Tone.CALM, f"{zone}: over")
    if alert.state == "rtn_unacked":
        return Event(now_s, Tone.CALM, f"{zone}: over, nobody has acknowledged it")
    tone = BY_LEVEL[Level[alert.level.upper()]]
    if alert.inhibit == "shelved":
        return Event(now_s, tone, f"{zone}: shelved by {alert.shelved_by or 'somebody'}")
    if alert.state == "acked":
        return Event(now_s, tone, f"{zone}: acknowledged by {alert.acked_by or 'somebody'}")
    return Event(now_s, tone, alert.text)


@dataclass(frozen=True, slots=True)
class Leads:
    """How long before the arm went in a warning came, by the guard's own clock.

    Attributes:
        warned: when an alert first warned, by its id [s].
        entered: ids of the alerts that came true.
        lines: newest first.
    """

    warned: Mapping[str, float] = field(default_factory=dict)
    entered: tuple[str, ...] = ()
    lines: tuple[str, ...] = ()

    def take(self, alert: wire.Alert) -> Leads:
        """Take every message of an alert, repeats too."""
        key = alert.alert_id
        if alert.zone is None or key in self.entered:
            return self
        if alert.source == "contact":
            warned_s = self.warned.get(key)
            line = f"{alert.zone}: entered without a warning"
            if warned_s is not None:
                line = f"{alert.zone}: {alert.published_unix_s - warned_s:.2f} s ahead"
            entered = (*self.entered, key)[-_KEPT_ALERTS:]
            return replace(self, entered=entered, lines=(line, *self.lines)[:KEPT_LEADS])
        if key not in self.warned and Level[alert.level.upper()] >= Level.WARNING:
            kept = list(self.warned.items())[-_KEPT_ALERTS + 1 :]
            return replace(self, warned={**dict(kept), key: alert.published_unix_s})
        return self
