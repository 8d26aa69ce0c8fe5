"""What is worth telling, from the items of the client: a pure function.

Told is every transition of an alert at or above a level, its end, and every loss and return of
protection, whatever the level. An alert ends for a target when it falls below the level or is
shelved. The guard's own NOT MONITORING alert is told as the loss of protection that it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import msgspec

from rampe_guard.client import Alert, Item, MachineState, ProtectionBack, ProtectionLost
from rampe_guard.core.alarm import Level

_PROTECTION = "protection"
_TELLING = ("event", "alert_id", "level", "state", "inhibit", "acked_by", "protection")
"""Fields without which two notices tell the same."""
_JITTER_S = 0.5
"""Unix times of one change differ so little between two messages of it."""


@dataclass(frozen=True, slots=True)
class Notice:
    """One thing to tell.

    Attributes:
        base: prefix of the guard's keys: names the machine.
        subject: what it is about: the zone of an alert, or "protection".
        level: how urgent.
        over: the matter has ended: told only to whom it was told before.
        body: all of it, as JSON values.
    """

    base: str
    subject: str
    level: Level
    over: bool
    body: dict[str, Any]

    @property
    def key(self) -> tuple[str, str]:
        """Notices of one key are about one matter: a newer one takes an older one's place."""
        return self.base, self.subject

    @property
    def text(self) -> str:
        """For people."""
        return str(self.body["text"])

    @property
    def about_protection(self) -> bool:
        """It is about the guard, not about a zone."""
        return self.subject == _PROTECTION

    def same(self, other: Notice | None) -> bool:
        """Tells nothing new to whom the other was told."""
        if other is None or any(self.body.get(n) != other.body.get(n) for n in _TELLING):
            return False
        mine_s, its_s = (float(n.body.get("changed_unix_s") or 0.0) for n in (self, other))
        return abs(mine_s - its_s) < _JITTER_S


def notice_of(item: Item, at_least: Level) -> Notice | None:
    """What to tell of an item; None if nothing."""
    if isinstance(item, Alert):
        if item.source == "system" and item.urgency >= Level.WARNING:
            return None  # told as the loss of protection that it is
        over = item.over or item.shelved or item.urgency < max(at_least, Level.CAUTION)
        return _notice(item, f"zone {item.zone}", over=over)
    if isinstance(item, ProtectionLost):
        off = item.protection == "machine_off"
        return _notice(item, _PROTECTION, over=off)
    if isinstance(item, ProtectionBack):
        return _notice(item, _PROTECTION, over=True)
    return None


def notices_of(machine: MachineState, at_least: Level) -> Iterable[Notice]:
    """What to tell of all alerts of a machine that are active."""
    found = (notice_of(alert, at_least) for alert in machine.active)
    return [notice for notice in found if notice is not None and not notice.over]


def _notice(item: Alert | ProtectionLost | ProtectionBack, subject: str, *, over: bool) -> Notice:
    body: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(item))
    for name in ("received_s", "sent_s"):  # on a clock that nobody else has
        body.pop(name, None)
    return Notice(item.base, subject, Level[item.level.upper()], over, {**body, "over": over})
