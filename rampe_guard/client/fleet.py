"""Messages of many machines → what is known of each: pure functions, time passed in.

Each function takes a `Fleet` and returns the next one with the items to tell, in order. Times
``now_s`` are on the listener's monotonic clock, so no wall clock has to agree with another.

**Silence.** A heartbeat older than `Fleet.expires_after_s`, an active alert not repeated within
its own ``expires_after_s``, or a liveliness token that went, is protection `UNAVAILABLE`. Ages
count from when a message was sent, not from when it came; and who is heard again must have told
all alerts first (`contact`).

**Loss.** ``seq`` counts the messages on a key, so a gap is told. Nothing becomes clear because
something did not come: an alert ends by the guard's explicit clear, by a newer alert of the same
zone, or because the `state` of a guard that is monitoring, asked for after the alert was last
heard, does not hold it. `MachineState.behind` says that the state should be asked for.

**Restart.** Another ``boot_id`` is another run of the guard. Alerts of the earlier run stay, and
expire, until the new one has told its own state. Late messages of an earlier run are ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

from rampe_guard import wire
from rampe_guard.client.contact import beaten, pending, sent_s, told_all
from rampe_guard.client.items import (
    Alert,
    GuardRestarted,
    Item,
    MessagesLost,
    Protection,
    ProtectionBack,
    ProtectionLost,
    alert_from,
    ended,
)
from rampe_guard.client.machine import STATUS, MachineState
from rampe_guard.core.alarm import urgency

MAX_MACHINES = 1000
"""A key expression that matches more is a mistake, or an attack on our memory."""
_JITTER_S = 0.1
"""Unix times of one message are taken one after the other: they may differ by so much."""
_KEPT_ENDED = 64
_KEPT_BOOTS = 8


@dataclass(frozen=True, slots=True)
class Fleet:
    """All machines that were heard of, by the prefix of their guards' keys.

    Attributes:
        machines: by base.
        expires_after_s: age at which a heartbeat must not be trusted [s].
    """

    machines: Mapping[str, MachineState] = field(default_factory=dict)
    expires_after_s: float = 1.0


Told: TypeAlias = tuple[Fleet, tuple[Item, ...]]


def at(fleet: Fleet, now_s: float) -> Told:
    """Let time pass: tells of guards that fell silent."""
    machines: dict[str, MachineState] = {}
    items: list[Item] = []
    for base, before in fleet.machines.items():
        late = any(now_s - a.sent_s > a.expires_after_s / 2.0 for a in before.alerts)
        machine = replace(before, now_s=now_s, behind=before.behind or late)
        machines[base], told = _tell(machine)
        items += told
    return replace(fleet, machines=MappingProxyType(machines)), tuple(items)


def expect(fleet: Fleet, base: str, now_s: float) -> Told:
    """There should be a machine: if nothing was heard of it, its protection is unavailable."""
    machine = _machine(fleet, base, now_s)
    if machine is None:
        return fleet, ()
    if machine.heartbeat is None:  # whoever expects it has waited long enough
        machine = replace(machine, first_s=now_s - machine.expires_after_s)
    return _put(fleet, machine, [])


def on_heartbeat(fleet: Fleet, base: str, message: wire.Heartbeat, now_s: float) -> Told:
    """Take a message of ``{base}/heartbeat``."""
    machine, items = _hear(fleet, base, message, "heartbeat", now_s)
    if machine is None:
        return fleet, ()
    return _put(fleet, _beat(machine, message, now_s), items)


def on_alert(fleet: Fleet, base: str, message: wire.Alert, now_s: float) -> Told:
    """Take a message of ``{base}/alert``."""
    machine, items = _hear(fleet, base, message, "alert", now_s)
    if machine is None:
        return fleet, ()
    if any(isinstance(item, MessagesLost) for item in items):
        machine = replace(machine, behind=True)
    machine, alert = _dated(machine, message, now_s)
    machine, told = _take(machine, alert)
    return _put(fleet, machine, items + told)


def on_state(fleet: Fleet, base: str, message: wire.State, now_s: float, asked_s: float) -> Told:
    """Take the answer of ``{base}/state`` to a question asked at ``asked_s`` [s].

    It comes from the worker of the guard, so it is as good as a heartbeat.
    """
    machine = _machine(fleet, base, now_s)
    if machine is None:
        return fleet, ()
    met = _meet(machine, message.heartbeat)
    if met is None:
        return fleet, ()
    machine, items = met
    machine = _beat(machine, message.heartbeat, now_s)
    contact = told_all(machine.contact, now_s, machine.expires_after_s)
    machine = replace(machine, contact=contact)
    for found in message.alerts:
        known = _known(machine, found.alert_id)
        if found.alert_id in machine.memory.ended or (known is not None and known.seq > found.seq):
            continue
        machine, alert = _dated(machine, found, now_s)
        machine, told = _take(machine, alert)
        items += told
    held = {alert.alert_id for alert in message.alerts}
    missing = [alert for alert in machine.alerts if alert.alert_id not in held]
    sees = message.heartbeat.status in STATUS or machine.protection is Protection.MACHINE_OFF
    for alert in missing:
        if sees and alert.received_s < asked_s:
            machine = _end(machine, alert)
            items.append(ended(alert, now_s))
    left = any(alert.alert_id not in held for alert in machine.alerts)
    return _put(fleet, replace(machine, behind=left), items)


def on_unreadable(fleet: Fleet, base: str, now_s: float) -> Told:
    """A message of ``{base}/alert`` cannot be read: something is raised, nobody knows what."""
    machine = _machine(fleet, base, now_s)
    if machine is None:
        return fleet, ()
    return _put(fleet, replace(machine, unreadable_s=now_s), [])


def on_token(fleet: Fleet, base: str, now_s: float, *, alive: bool) -> Told:
    """The liveliness token of a guard appeared or went."""
    if base not in fleet.machines and not alive:
        return fleet, ()
    machine = _machine(fleet, base, now_s)
    if machine is None:
        return fleet, ()
    return _put(fleet, replace(machine, gone=not alive), [])


def _machine(fleet: Fleet, base: str, now_s: float) -> MachineState | None:
    """What is known of it until now; None if there are too many already."""
    known = fleet.machines.get(base)
    if known is not None:
        return replace(known, now_s=now_s)
    if len(fleet.machines) >= MAX_MACHINES:
        return None
    return MachineState(base, now_s, now_s, fleet.expires_after_s)


def _put(fleet: Fleet, machine: MachineState, items: list[Item]) -> Told:
    machine, told = _tell(machine)
    machines = MappingProxyType({**fleet.machines, machine.base: machine})
    return replace(fleet, machines=machines), (*items, *told)


def _hear(
    fleet: Fleet, base: str, message: wire.Alert | wire.Heartbeat, key: str, now_s: float
) -> tuple[MachineState | None, list[Item]]:
    """Who speaks, and what did not arrive of him; None if the message is to be ignored."""
    machine = _machine(fleet, base, now_s)
    met = None if machine is None else _meet(machine, message)
    if met is None:
        return None, []
    machine, items = met
    last = machine.memory.seq.get(key)
    if last is not None and message.seq <= last:
        return None, []
    missed = 0 if last is None else message.seq - last - 1
    machine = replace(
        machine,
        lost=machine.lost + missed,
        memory=replace(machine.memory, seq={**machine.memory.seq, key: message.seq}),
    )
    if missed:
        items.append(
            MessagesLost(
                base=base,
                site=machine.site,
                machine=machine.machine,
                key=f"{base}/{key}",
                count=missed,
                level="caution",
                text=f"{missed} messages of {key} lost",
            )
        )
    return machine, items


def _meet(
    machine: MachineState, message: wire.Alert | wire.Heartbeat
) -> tuple[MachineState, list[Item]] | None:
    """Note who speaks; None if it is an earlier run of a guard that another has replaced."""
    boot = message.boot_id
    named = replace(machine, site=message.site, machine=message.machine, boot_id=boot)
    if machine.boot_id in {None, boot}:
        return named, []
    if boot in machine.memory.earlier_boots and not machine.silent:
        return None
    earlier = (*machine.memory.earlier_boots, machine.boot_id or "")[-_KEPT_BOOTS:]
    restarted = GuardRestarted(
        base=machine.base,
        site=message.site,
        machine=message.machine,
        boot_id=boot,
        level="caution",
        text="the guard restarted",
    )
    memory = replace(machine.memory, earlier_boots=earlier, seq={})
    return replace(named, memory=memory, behind=True), [restarted]


def _dated(machine: MachineState, message: wire.Alert, now_s: float) -> tuple[MachineState, Alert]:
    contact, sent = sent_s(machine.contact, message, now_s)
    return replace(machine, contact=contact), alert_from(message, machine.base, now_s, sent)


def _beat(machine: MachineState, message: wire.Heartbeat, now_s: float) -> MachineState:
    expires_s, lost = machine.expires_after_s, machine.silent
    contact = beaten(machine.contact, message, now_s, expires_s, lost=lost)
    known = machine.heartbeat
    if known is not None and known.boot_id == message.boot_id and known.seq > message.seq:
        message = known
    return replace(
        machine,
        heartbeat=message,
        contact=contact,
        gone=False,
        behind=machine.behind or not contact.complete(now_s),
    )


def _take(machine: MachineState, alert: Alert) -> tuple[MachineState, list[Item]]:
    """Put an alert in its place; tells it if it is more than a repeat."""
    known = _known(machine, alert.alert_id)
    items: list[Item] = []
    for other in machine.alerts:  # a zone has one alert: another one of it is over
        if other.zone == alert.zone and other.alert_id != alert.alert_id:
            machine = _end(machine, other)
            items.append(ended(other, alert.received_s))
    if alert.over:
        if alert.alert_id in machine.memory.ended:
            return machine, items
        return _end(machine, alert), [*items, alert]
    others = [other for other in machine.alerts if other.alert_id != alert.alert_id]
    machine = replace(machine, alerts=tuple(sorted([*others, alert], key=_gravest_first)))
    return machine, [*items, alert] if known is None or _changed(known, alert) else items


def _end(machine: MachineState, alert: Alert) -> MachineState:
    alerts = tuple(other for other in machine.alerts if other.alert_id != alert.alert_id)
    over = (*machine.memory.ended, alert.alert_id)[-_KEPT_ENDED:]
    return replace(machine, alerts=alerts, memory=replace(machine.memory, ended=over))


def _known(machine: MachineState, alert_id: str) -> Alert | None:
    return next((alert for alert in machine.alerts if alert.alert_id == alert_id), None)


def _changed(before: Alert, after: Alert) -> bool:
    """More than a repeat: another level, state, trust or shelving, or asked for anew."""
    shown = [(a.level, a.state, a.inhibit, a.quality == "stale") for a in (before, after)]
    return shown[0] != shown[1] or _unchanged_s(after) < _unchanged_s(before) - _JITTER_S


def _unchanged_s(alert: Alert) -> float:
    """How long it had not changed when it was published [s], on one clock: whatever it shows."""
    return alert.published_unix_s - (alert.changed_unix_s or alert.published_unix_s)


def _gravest_first(alert: Alert) -> tuple[int, float, str]:
    return *urgency(alert.urgency, alert.time_to_collision_s), alert.zone or ""


def _tell(machine: MachineState) -> tuple[MachineState, tuple[Item, ...]]:
    """What is to be said of the protection, if it is not what was said last."""
    now = machine.protection
    if machine.heartbeat is None:
        waiting = machine.now_s - machine.first_s < machine.expires_after_s
    else:
        known = machine.silent or machine.told_all
        waiting = pending(now, machine.memory.told, known=known)
    if now is machine.memory.told or waiting:
        return machine, ()
    machine = replace(machine, memory=replace(machine.memory, told=now))
    return machine, (_protection(machine, now),)


def _protection(machine: MachineState, now: Protection) -> ProtectionLost | ProtectionBack:
    why = "; ".join(machine.reasons)
    if now.guarded:
        degraded = now is Protection.DEGRADED
        return ProtectionBack(
            base=machine.base,
            site=machine.site,
            machine=machine.machine,
            protection=now,
            level="caution" if degraded else "clear",
            text=f"degraded: {why}" if degraded else "monitoring",
        )
    head = {
        Protection.UNAVAILABLE: "PROTECTION UNAVAILABLE",
        Protection.NOT_MONITORING: "NOT MONITORING",
    }.get(now)
    return ProtectionLost(
        base=machine.base,
        site=machine.site,
        machine=machine.machine,
        protection=now,
        level="warning" if head else "caution",
        text=f"{head}: {why}" if head else "machine switched off: not monitored",
    )
