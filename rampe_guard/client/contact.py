"""How fresh is what a guard says, and is all of it known? One frozen value for each guard.

**Late messages.** A network may hand on what it kept: a router that stood still delivers, in one
breath, heartbeats of many seconds ago. To count age from arrival would take them for new. So each
message's age counts from when it was sent, at the latest, as the promptest message of this guard
shows (`SenderClock`): no clock has to agree with another. Two clocks of the guard are followed, its
uptime and its wall clock, since each may jump for reasons of its own (a computer that slept, a
clock that was set); a message is late when both say so.

**Contact.** When a guard is heard for the first time, or again after its heartbeat was too old,
alerts may stand of which nobody has told. Contact is *complete* once the guard has told its state,
or has been heard for so long that it has repeated every alert that stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from rampe_guard import wire
from rampe_guard.client.items import Protection
from rampe_guard.core.sender_clock import SenderClock

COMPLETE_S = 0.5
"""Every alert that stands is repeated five times a second: twice in so long [s], and more."""


@dataclass(frozen=True, slots=True)
class Contact:
    """What is known of the way to a guard.

    Attributes:
        boot_id: the run of the guard that ``uptime`` is of.
        uptime: its steady clock.
        wall: its wall clock.
        beat_s: when the newest heartbeat was sent, at the latest [s]; None before the first.
        since_s: since when heartbeats come without the state being known [s]; None: it is known.
    """

    boot_id: str | None = None
    uptime: SenderClock = field(default_factory=SenderClock)
    wall: SenderClock = field(default_factory=SenderClock)
    beat_s: float | None = None
    since_s: float | None = None

    def silent(self, now_s: float, expires_after_s: float) -> bool:
        """The newest heartbeat is too old, or there is none."""
        return self.beat_s is None or now_s - self.beat_s > expires_after_s

    def complete(self, now_s: float) -> bool:
        """No alert can stand that has not been told."""
        return self.since_s is None or now_s - self.since_s > COMPLETE_S


def sent_s(
    contact: Contact, message: wire.Alert | wire.Heartbeat, now_s: float
) -> tuple[Contact, float]:
    """When a message that came now was sent, at the latest, on our clock [s]."""
    if contact.boot_id != message.boot_id:
        contact = replace(contact, boot_id=message.boot_id, uptime=SenderClock())
    wall = contact.wall.followed(message.published_unix_s, now_s)
    contact = replace(contact, wall=wall)
    by_wall_s = wall.measured_s(message.published_unix_s, now_s)
    if message.uptime_s is None:
        return contact, by_wall_s
    uptime = contact.uptime.followed(message.uptime_s, now_s)
    contact = replace(contact, uptime=uptime)
    return contact, max(by_wall_s, uptime.measured_s(message.uptime_s, now_s))


def beaten(
    contact: Contact, message: wire.Heartbeat, now_s: float, expires_after_s: float, *, lost: bool
) -> Contact:
    """After a heartbeat that came now; an old one does not bring contact back.

    Args:
        contact: before it.
        message: the heartbeat.
        now_s: now [s].
        expires_after_s: age at which it is too old [s].
        lost: contact was lost until it came.
    """
    contact, beat_s = sent_s(contact, message, now_s)
    newest_s = beat_s if contact.beat_s is None else max(beat_s, contact.beat_s)
    regained = lost and now_s - beat_s <= expires_after_s
    return replace(contact, beat_s=newest_s, since_s=now_s if regained else contact.since_s)


def told_all(contact: Contact, now_s: float, expires_after_s: float) -> Contact:
    """After the guard has told its state, unless that is too old itself."""
    silent = contact.silent(now_s, expires_after_s)
    return contact if silent else replace(contact, since_s=None)


def pending(now: Protection, told: Protection | None, *, known: bool) -> bool:
    """Whether to wait a moment before telling that protection is not available.

    Args:
        now: what protection is.
        told: what it was when that was told last. Who was told that all is well is told at once.
        known: contact is complete, or plainly lost: no moment will show more.
    """
    return now is Protection.UNAVAILABLE and not known and not (told and told.guarded)
