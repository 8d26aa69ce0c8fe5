"""What happens to guarded machines, as an integrator gets it: alerts, and what else must be told.

Every item has ``base``, ``site``, ``machine``, ``level`` and ``text``, so that whoever prints
or sounds them all needs to know no kinds, and misses no loss of protection.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct, structs

from rampe_guard import wire
from rampe_guard.core.alarm import Level
from rampe_guard.wire import fields as f

Base = Annotated[str, Meta(description="Prefix of the guard's keys: names the machine.")]
Text = Annotated[str, Meta(description="The same for people.")]
ItemLevel = Annotated[f.Level, Meta(description="How urgent it is.")]


class Protection(StrEnum):
    """What the operator of a machine can rely on."""

    MONITORING = "monitoring"
    DEGRADED = "degraded"
    NOT_MONITORING = "not_monitoring"  # the guard says so
    MACHINE_OFF = "machine_off"  # the guard says so: the machine is switched off
    UNAVAILABLE = "unavailable"  # the guard says nothing, or nothing fresh

    @property
    def guarded(self) -> bool:
        """Someone watches over the machine, fully or in part."""
        return self in {Protection.MONITORING, Protection.DEGRADED}

    @property
    def words(self) -> str:
        """For people."""
        return self.value.replace("_", " ")


class Alert(wire.Alert, frozen=True, kw_only=True, tag_field="event", tag="alert"):
    """One alert as the guard published it, and where it came from.

    Attributes:
        base: prefix of the guard's keys.
        received_s: when it came, on `time.monotonic` of this process [s].
        sent_s: when it was sent, at the latest, on the same clock [s]: its age counts from there.
        inferred: the guard's own clear was lost; its `state` says that the alert is over.
    """

    base: Base
    received_s: Annotated[float, Meta(description="When it came, on the listener's clock [s].")]
    sent_s: Annotated[
        float,
        Meta(description="When it was sent, at the latest, on the listener's clock [s]."),
    ]
    inferred: Annotated[
        bool, Meta(description="The clear itself was lost; the guard's state says it is over.")
    ] = False

    @property
    def urgency(self) -> Level:
        """The level as a number that can be compared."""
        return Level[self.level.upper()]

    @property
    def over(self) -> bool:
        """Nothing is repeated any more, nobody need acknowledge it."""
        return self.state == "normal"

    @property
    def shelved(self) -> bool:
        """Someone has put it aside for a time, or the machine is switched off."""
        return self.inhibit != "none"


class ProtectionLost(Struct, frozen=True, kw_only=True, tag_field="event", tag="protection_lost"):
    """Nobody watches over the machine now; what was last said of it must not be trusted."""

    base: Base
    site: f.Site
    machine: f.Machine
    protection: Annotated[Protection, Meta(description="not_monitoring, machine_off, unavailable.")]
    level: ItemLevel
    text: Text


class ProtectionBack(Struct, frozen=True, kw_only=True, tag_field="event", tag="protection_back"):
    """Someone watches over the machine (again), fully or, `degraded`, in part.

    Its level is "caution" while degraded, else "clear": of the protection, not of the zones.
    """

    base: Base
    site: f.Site
    machine: f.Machine
    protection: Annotated[Protection, Meta(description="monitoring or degraded.")]
    level: ItemLevel
    text: Text


class GuardRestarted(Struct, frozen=True, kw_only=True, tag_field="event", tag="guard_restarted"):
    """Another run of the guard speaks: its numbers begin anew."""

    base: Base
    site: f.Site
    machine: f.Machine
    boot_id: f.BootId
    level: ItemLevel
    text: Text


class MessagesLost(Struct, frozen=True, kw_only=True, tag_field="event", tag="messages_lost"):
    """Messages did not arrive; the present state has been asked for."""

    base: Base
    site: f.Site
    machine: f.Machine
    key: Annotated[str, Meta(description="The key that they were published on.")]
    count: Annotated[int, Meta(description="How many.")]
    level: ItemLevel
    text: Text


Item: TypeAlias = Alert | ProtectionLost | ProtectionBack | GuardRestarted | MessagesLost


def alert_from(
    message: wire.Alert, base: str, received_s: float, sent_s: float | None = None
) -> Alert:
    """A message of the contract with where it came from and when [s]; sent as it came, if None."""
    sent_s = received_s if sent_s is None else sent_s
    return Alert(base=base, received_s=received_s, sent_s=sent_s, **_fields(message))


def ended(alert: Alert, received_s: float) -> Alert:
    """The clear of an alert that is known to be over though its own clear never came."""
    in_margin = (alert.clearance_now_m or 0.0) < 0.0
    text = wire.alert_text(alert.link, alert.zone, None, "clear", alert.source, in_margin=in_margin)
    return structs.replace(
        alert,
        level="clear",
        previous_level=alert.level,
        state="normal",
        probability=None,
        similar_situations=None,
        similar_contacts=None,
        time_to_collision_s=None,
        received_s=received_s,
        sent_s=received_s,
        inferred=True,
        text=text,
    )


def _fields(message: Struct) -> dict[str, Any]:
    return {name: getattr(message, name) for name in message.__struct_fields__}
