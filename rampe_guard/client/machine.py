"""What is known of one guarded machine, and what that means now: a frozen value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rampe_guard import wire
from rampe_guard.client.contact import Contact
from rampe_guard.client.items import Alert, Protection

STATUS = {"ok": Protection.MONITORING, "degraded": Protection.DEGRADED}
"""What a status of the heartbeat means if it means that someone watches."""


@dataclass(frozen=True, slots=True)
class Memory:
    """What tells a new message from an old one.

    Attributes:
        seq: of the newest message, by the last part of its key.
        ended: ids of the alerts that ended last.
        earlier_boots: earlier runs of the guard.
        told: the protection that was told last.
    """

    seq: Mapping[str, int] = field(default_factory=dict)
    ended: tuple[str, ...] = ()
    earlier_boots: tuple[str, ...] = ()
    told: Protection | None = None


@dataclass(frozen=True, slots=True)
class MachineState:
    """One machine, as of ``now_s``.

    Attributes:
        base: prefix of its guard's keys.
        now_s: time of this picture [s].
        first_s: when it was first heard of [s].
        expires_after_s: age at which a heartbeat must not be trusted [s].
        site: its name; empty until heard.
        machine: its name; empty until heard.
        boot_id: of the run of the guard that speaks; None until heard.
        heartbeat: the newest; None until heard.
        contact: how fresh it is, and whether all alerts are known.
        gone: the guard's liveliness token went, and no heartbeat came since.
        alerts: every alert that is not over, shelved and expired ones too; the gravest first.
        unreadable_s: when an alert came that could not be read [s]; None: never.
        lost: messages that did not arrive, so far.
        behind: something may be missing here: ask for the guard's `state`.
        memory: to know what is new.
    """

    base: str
    now_s: float
    first_s: float
    expires_after_s: float
    site: str = ""
    machine: str = ""
    boot_id: str | None = None
    heartbeat: wire.Heartbeat | None = None
    contact: Contact = field(default_factory=Contact)
    gone: bool = False
    alerts: tuple[Alert, ...] = ()
    unreadable_s: float | None = None
    lost: int = 0
    behind: bool = True
    memory: Memory = field(default_factory=Memory)

    @property
    def silence_s(self) -> float | None:
        """Time since the newest heartbeat was sent [s], at least; None if there never was one."""
        beat_s = self.contact.beat_s
        return None if beat_s is None else self.now_s - beat_s

    @property
    def protection(self) -> Protection:
        """What can be relied on now."""
        if self.heartbeat is None or self.silent:
            return Protection.UNAVAILABLE
        status = STATUS.get(self.heartbeat.status)
        if status is None:
            off = [reason.code for reason in self.heartbeat.reasons] == ["machine_off"]
            return Protection.MACHINE_OFF if off else Protection.NOT_MONITORING
        if not self.told_all or self._blind or any(self.expired(alert) for alert in self.alerts):
            return Protection.UNAVAILABLE
        return status

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is not plainly monitoring, for people; empty when it is."""
        if self.heartbeat is None:
            return ("no guard was heard",)
        if self.gone:
            return ("the guard, or the network to it, is gone",)
        if self.silent:
            return (f"no heartbeat for {self.silence_s:.1f} s",)
        if self.protection is Protection.UNAVAILABLE:
            return self._missing
        return tuple(reason.text for reason in self.heartbeat.reasons)

    @property
    def _missing(self) -> tuple[str, ...]:
        """What is missing of a guard that says that it watches."""
        if not self.told_all:
            return ("the guard is heard again, its alerts are being asked for",)
        if self._blind:
            return ("an alert cannot be read: another version of rampe-guard?",)
        expired = [alert.zone or "system" for alert in self.alerts if self.expired(alert)]
        return tuple(f"the alert of {zone} is not repeated" for zone in expired)

    @property
    def active(self) -> tuple[Alert, ...]:
        """Alerts that ask for attention: those that are not shelved, the gravest first."""
        return tuple(alert for alert in self.alerts if not alert.shelved)

    @property
    def shelved(self) -> tuple[Alert, ...]:
        """Alerts that someone has put aside for a time."""
        return tuple(alert for alert in self.alerts if alert.shelved)

    def expired(self, alert: Alert) -> bool:
        """It was not repeated in time: still shown, no longer to be trusted."""
        return self.now_s - alert.sent_s > alert.expires_after_s

    @property
    def told_all(self) -> bool:
        """No alert can stand that has not been told."""
        return self.contact.complete(self.now_s)

    @property
    def _blind(self) -> bool:
        """An alert is active that is not among ours."""
        if self.unreadable_s is None:
            return False
        return self.now_s - self.unreadable_s <= self.expires_after_s

    @property
    def silent(self) -> bool:
        """Its guard is gone, was never heard, or not lately."""
        return self.gone or self.contact.silent(self.now_s, self.expires_after_s)
