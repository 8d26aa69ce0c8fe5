"""Messages → `ViewState`: one pure function for each message of the contract.

Times ``now_s`` are on the viewer's clock. Lead times are differences of the guard's own
publication times, so the way to the viewer does not blur them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rampe_guard.client.contact import beaten, pending, sent_s, told_all
from rampe_guard.client.items import Protection
from rampe_guard.client.machine import STATUS
from rampe_guard.core.alarm import Level
from rampe_guard.core.config import ActuatorConfig
from rampe_guard.view.state import (
    ActuatorView,
    AlertView,
    EventView,
    HealthView,
    ViewState,
)
from rampe_guard.wire import (
    ActuatorsMessage,
    Alert,
    Heartbeat,
    JoystickMessage,
    Prediction,
    State,
)

_KEEP_EVENTS = 50


def begin(
    machine: str,
    site: str,
    actuators: Sequence[ActuatorConfig],
    limits: Sequence[tuple[float | None, float | None]],
    now_s: float,
) -> ViewState:
    """Return the screen before the first message: protection unavailable.

    Args:
        machine: its name.
        site: its name.
        actuators: n actuators.
        limits: n pairs (lower, upper) [unit]; None or infinite = endless.
        now_s: now [s].
    """
    return ViewState(
        machine,
        site,
        now_s,
        tuple(
            ActuatorView(a.name, a.unit, _finite(low), _finite(high), axis=a.axis, axis_sign=a.sign)
            for a, (low, high) in zip(actuators, limits, strict=True)
        ),
        began_s=now_s,
    )


def at(state: ViewState, now_s: float) -> ViewState:
    """Let time pass: a guard that fell silent is told."""
    return _tell(replace(state, now_s=now_s))


def add_event(state: ViewState, level: Level, text: str, *, lost: bool = False) -> ViewState:
    """Put a line on top of the events."""
    events = (EventView(state.now_s, level, text, lost), *state.events)
    return replace(state, events=events[:_KEEP_EVENTS])


def on_joystick(state: ViewState, message: JoystickMessage, now_s: float) -> ViewState:
    """Show the levers."""
    actuators = tuple(
        replace(a, command=a.axis_sign * message.axes[a.axis]) for a in state.actuators
    )
    return replace(state, now_s=now_s, command_received_s=now_s, actuators=actuators)


def on_actuators(state: ViewState, message: ActuatorsMessage, now_s: float) -> ViewState:
    """Show where the machine is; arrays in site order, as `wire.decode_actuators` gives them."""
    speeds = message.velocity or (None,) * len(state.actuators)
    actuators = tuple(
        replace(a, position=position, velocity=velocity)
        for a, position, velocity in zip(state.actuators, message.position, speeds, strict=True)
    )
    return replace(state, now_s=now_s, position_received_s=now_s, actuators=actuators)


def on_prediction(state: ViewState, message: Prediction, now_s: float) -> ViewState:
    """Show the primitive under way; one that ended leaves no prediction behind."""
    ended = message.event == "ended"
    actuators = tuple(
        replace(
            a,
            sign=0 if ended else sign,
            displacement=None if ended else _of(message.mean, a.name),
            spread=None if ended else _of(message.scale, a.name),
            endpoint=None if ended else _of(message.endpoint, a.name),
        )
        for a, sign in zip(state.actuators, message.category, strict=True)
    )
    return replace(
        state,
        now_s=now_s,
        actuators=actuators,
        observations=message.observations,
        prediction_received_s=None if ended or message.mean is None else now_s,
    )


def on_heartbeat(state: ViewState, message: Heartbeat, now_s: float) -> ViewState:
    """Show health; a guard that restarted takes its old alerts with it."""
    before, expires_s = state.health, state.expires_after_s
    contact = beaten(state.contact, message, now_s, expires_s, lost=state.silent)
    health = HealthView(
        protection=_protection(message),
        reasons=tuple(reason.text for reason in message.reasons),
        boot_id=message.boot_id,
        joystick_age_s=message.input_age_s.joystick_s,
        actuators_age_s=message.input_age_s.actuators_s,
        loop_p50_ms=message.loop_ms.p50 if message.loop_ms else None,
        loop_p99_ms=message.loop_ms.p99 if message.loop_ms else None,
        sweep_p50_ms=message.sweep_ms.p50 if message.sweep_ms else None,
        sweep_p99_ms=message.sweep_ms.p99 if message.sweep_ms else None,
        version=message.version,
    )
    state = replace(state, now_s=now_s, health=health, contact=contact)
    if before is not None and before.boot_id != health.boot_id:
        kept = tuple(a for a in state.alerts if a.boot_id == health.boot_id)
        state = add_event(replace(state, alerts=kept), Level.WARNING, "the guard restarted")
    return _tell(state)


def on_alert(state: ViewState, message: Alert, now_s: float) -> ViewState:
    """Show an alert, and tell of it when it rises, comes true or ends."""
    contact, sent = sent_s(state.contact, message, now_s)
    state = replace(state, now_s=now_s, contact=contact)
    zone = message.zone or "system"
    before = next((a for a in state.alerts if a.zone == zone), None)
    others = tuple(a for a in state.alerts if a.zone != zone)
    alert = alert_view(message, sent, before)
    if message.state == "normal":
        state = replace(state, alerts=others)
        if before is None or _told_by_heartbeat(before):
            return state
        return add_event(state, Level.CLEAR, f"{zone}: clear")
    state = replace(state, alerts=(*others, alert))
    news = _news(alert, before, message)
    return state if news is None else add_event(state, *news)


def on_state(state: ViewState, message: State, now_s: float) -> ViewState:
    """Catch up, for a viewer that comes late."""
    state = on_heartbeat(state, message.heartbeat, now_s)
    contact = told_all(state.contact, now_s, state.expires_after_s)
    state = _tell(replace(state, contact=contact))
    for alert in message.alerts:
        state = on_alert(state, alert, now_s)
    for prediction in message.predictions:
        state = on_prediction(state, prediction, now_s)
    return state


def alert_view(message: Alert, sent: float, before: AlertView | None = None) -> AlertView:
    """An alert as a screen shows it.

    Args:
        message: what the guard says.
        sent: when it was sent, at the latest, on the viewer's clock [s].
        before: the same alert as it was, if it was.
    """
    level = Level[message.level.upper()]
    came_true = message.source == "contact" or (before is not None and before.came_true)
    warned_s = before.warned_unix_s if before is not None else None
    if level < Level.WARNING:
        warned_s = None
    elif warned_s is None and message.source != "contact":
        warned_s = message.published_unix_s
    until_s = message.shelved_until_unix_s
    return AlertView(
        alert_id=message.alert_id,
        zone=message.zone or "system",
        level=level,
        boot_id=message.boot_id,
        source=message.source,
        link=message.link,
        time_to_collision_s=message.time_to_collision_s,
        probability=message.probability,
        clearance_now_m=message.clearance_now_m,
        attention=message.state != "acked",
        gone=message.state == "rtn_unacked",
        trusted=message.quality == "good",
        text=message.text,
        sent_s=sent,
        expires_after_s=message.expires_after_s,
        warned_unix_s=warned_s,
        came_true=came_true,
        inhibit=message.inhibit,
        shelved_by=message.shelved_by,
        shelved_for_s=None if until_s is None else until_s - message.published_unix_s,
        acked_by=message.acked_by,
        times=_times(message),
    )


def _protection(message: Heartbeat) -> Protection:
    status = STATUS.get(message.status)
    if status is not None:
        return status
    off = [reason.code for reason in message.reasons] == ["machine_off"]
    return Protection.MACHINE_OFF if off else Protection.NOT_MONITORING


def _tell(state: ViewState) -> ViewState:
    """Tell the protection if it is another than was told last."""
    now, told = state.protection, state.told
    if state.health is None:
        waits = state.began_s is not None and state.now_s - state.began_s <= state.expires_after_s
    else:
        known = state.silent or state.contact.complete(state.now_s)
        waits = pending(now, told, known=known)
    if waits or now is told:
        return state
    state = replace(state, told=now)
    if now is Protection.MONITORING:
        return state if told is None else add_event(state, Level.CLEAR, "monitoring again")
    if now is Protection.DEGRADED:
        return add_event(state, Level.CAUTION, f"DEGRADED: {state.why}")
    if now is Protection.MACHINE_OFF:
        return add_event(state, Level.CLEAR, "machine switched off: not monitored")
    head = "NOT MONITORING" if now is Protection.NOT_MONITORING else "PROTECTION UNAVAILABLE"
    return add_event(state, Level.WARNING, f"{head}: {state.why}", lost=True)


def _news(alert: AlertView, before: AlertView | None, message: Alert) -> tuple[Level, str] | None:
    """Level and text of what is new in an alert; None for a repeat."""
    zone, entered = alert.zone, alert.came_true and not (before and before.came_true)
    news: tuple[Level, str] | None = None
    if _told_by_heartbeat(alert):
        pass
    elif entered:
        news = Level.IMMINENT, _came_true(alert, message.published_unix_s)
    elif before is None or alert.level > before.level:
        news = alert.level, f"{zone}: {message.text}"
    elif alert.inhibit != before.inhibit:
        news = Level.CLEAR, f"{zone}: {_inhibited(alert)}"
    elif alert.acked_by and not before.acked_by:
        news = Level.CLEAR, f"{zone}: seen by {alert.acked_by}"
    return news


def _told_by_heartbeat(alert: AlertView) -> bool:
    """That nobody monitors is an alert too, but the protection has told it already."""
    return alert.source == "system" and (alert.level >= Level.WARNING or alert.level is Level.CLEAR)


def _inhibited(alert: AlertView) -> str:
    if alert.inhibit == "shelved":
        return f"shelved by {alert.shelved_by or 'someone'} for {alert.shelved_for_s or 0.0:.0f} s"
    return "machine off" if alert.inhibit == "machine_off" else "no longer shelved"


def _came_true(alert: AlertView, published_unix_s: float) -> str:
    if alert.warned_unix_s is None:
        return f"{alert.zone}: inside the margin"
    return f"{alert.zone}: entered; warned {published_unix_s - alert.warned_unix_s:.2f} s ahead"


def _of(values: Mapping[str, float] | None, name: str) -> float | None:
    return None if values is None else values.get(name)


def _finite(limit: float | None) -> float | None:
    return None if limit is None or abs(limit) == float("inf") else limit


def _times(message: Alert) -> tuple[int, int] | None:
    met, asked = message.similar_contacts, message.similar_situations
    return None if met is None or asked is None else (met, asked)
