"""A `Sight` of a machine → the `Picture` that its pages show. Pure.

The rule above all others: what nobody watches over, or nobody knows, never looks judged.
Without protection the objects lose their colours, forecasts and the contact point go, and
the banner says so. Alerts stay listed, as the last that was known.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from rampe_guard.client.items import Alert, Protection
from rampe_guard.core.scene import SELF_ZONE, ActuatorLimit
from rampe_guard.dashboard.actuators import bars, basis
from rampe_guard.dashboard.ghosts import intent_ghosts, next_ghost, stopping_ghosts
from rampe_guard.dashboard.model import Model
from rampe_guard.dashboard.picture import Banner, Card, Contact, Picture, Zone
from rampe_guard.dashboard.sight import STALE_S, Sight
from rampe_guard.dashboard.tones import BY_LEVEL, Tone

WORK_ALONE = "Collision warnings will not come. Work as if there were none."


def compose(model: Model, sight: Sight) -> Picture:
    """Return what a page is to show."""
    guard = sight.guard
    lost = bool(sight.trouble) or not guard.protection.guarded
    alerts = {a.zone: a for a in reversed(guard.alerts) if a.zone is not None}
    tones = _link_tones(model, () if lost else guard.alerts)
    limits = model.limits
    onward = None if lost or sight.position_stale else next_ghost(model, sight)
    zone_tones = {name: tone_of(a) for name, a in alerts.items() if not lost}
    return Picture(
        machine=model.site.machine,
        site=model.site.name,
        now_s=sight.now_s,
        banner=_banner(sight),
        lost=lost,
        zones=tuple(
            _zone(s.name, alerts.get(s.name), sight, lost=lost, moves=s.moves) for s in model.solids
        ),
        limits=tuple(
            _zone(li.name, alerts.get(li.name), sight, lost=lost, text=_limit_text(model, li))
            for li in limits
        ),
        links=None if sight.position is None else model.poses(sight.position[None])[0],
        stale=sight.position_stale,
        link_tones=tones,
        intent=None if lost or sight.position_stale else intent_ghosts(model, sight),
        stopping=None if lost or sight.position_stale else stopping_ghosts(model, sight),
        next=None if onward is None else onward[0],
        next_words="" if onward is None else onward[1],
        contact=None if lost else _contact(guard.active, sight.now_s),
        bars=bars(model, sight, zone_tones, lost=lost),
        basis=basis(sight, lost=lost),
        cards=tuple(_card(sight, alert, lost=lost) for alert in guard.alerts),
        events=sight.events,
        leads=sight.leads,
        footer=_footer(sight),
    )


def tone_of(alert: Alert) -> Tone:
    """Its level; a shelved alert and one whose cause is gone are calm."""
    return Tone.CALM if alert.shelved else BY_LEVEL[alert.urgency]


def countdown(seconds: float | None) -> str:
    """Rounded down: no more time is promised than there is."""
    if seconds is None:
        return ""
    tenths = max(0, math.floor(seconds * 10.0 + 1e-6))
    return f"{tenths / 10.0:.1f} s" if tenths else "now"


def _attention(alert: Alert) -> bool:
    return alert.state in {"unacked", "rtn_unacked"} and not alert.shelved


def _banner(sight: Sight) -> Banner:
    guard = sight.guard
    protection = Protection.UNAVAILABLE if sight.trouble else guard.protection
    other = (sight.other_scene,) if sight.other_scene else ()
    why = sight.trouble or "; ".join((*other, *guard.reasons))
    if protection is Protection.MACHINE_OFF:
        return Banner(Tone.OFF, Tone.OFF.look.word, "not monitored", detail=WORK_ALONE)
    if not protection.guarded:
        text = why or "the guard gave no reason"
        if protection is Protection.UNAVAILABLE:
            text = f"protection unavailable: {text}"
        seen = any(a.zone is None and a.state == "acked" for a in guard.alerts)
        word = Tone.LOST.look.word
        return Banner(Tone.LOST, word, text, detail=WORK_ALONE, flash=not seen)
    worse = protection is Protection.DEGRADED or other
    degraded = f"degraded: {why}" if worse else ""
    if not guard.active:
        shelved = _count(len(guard.shelved), "alert shelved", "alerts shelved")
        if degraded:
            return Banner(Tone.CAUTION, "DEGRADED", why, detail=shelved)
        return Banner(Tone.CALM, "monitoring", "no alert", detail=shelved)
    first = guard.active[0]
    others = len(guard.alerts) - 1
    parts = (
        "" if first.quality == "good" else f"quality {first.quality}",
        degraded,
        _count(others, "more alert", "more alerts"),
    )
    tone = tone_of(first)
    return Banner(
        tone=tone,
        word="OVER" if tone is Tone.CALM else tone.look.word,
        text=_title(first) if tone is not Tone.CALM else f"{_title(first)}: please acknowledge",
        count=countdown(first.time_to_collision_s),
        detail=" · ".join(part for part in parts if part),
        flash=_attention(first),
    )


def _title(alert: Alert) -> str:
    if alert.zone is None:
        return alert.text
    return alert.zone if alert.link is None else f"{alert.link} → {alert.zone}"


def _zone(
    name: str,
    alert: Alert | None,
    sight: Sight,
    *,
    lost: bool,
    moves: bool = False,
    text: str = "",
) -> Zone:
    pose = sight.placed.get(name) if moves else None
    known = not moves or (pose is not None and _placed(sight, name))
    tone = Tone.LOST if lost else Tone.CALM if alert is None else tone_of(alert)
    attention = alert is not None and _attention(alert)
    said = text or name
    if alert is not None and tone not in {Tone.LOST, Tone.CALM}:
        said = f"{tone.look.shape} {tone.look.word} {said} {countdown(alert.time_to_collision_s)}"
    elif alert is not None and alert.shelved and not lost:
        said = f"{said} (shelved)"
    if not known:
        said = f"? {said.strip()}: nobody knows where"
    lit = tone.lit(sight.now_s, attention=attention)
    return Zone(name, tone, lit, said.strip(), known, pose)


def _placed(sight: Sight, name: str) -> bool:
    """The guard knows where it is, and so do we."""
    beat = sight.guard.heartbeat
    if beat is None or sight.now_s - sight.placed_s.get(name, -math.inf) > STALE_S:
        return False
    return all(o.placed for o in beat.objects if o.name == name)


def _limit_text(model: Model, limit: ActuatorLimit) -> str:
    actuator = model.site.guard.actuators[limit.actuator]
    ends = [
        f"{word} {value:+.2f} {actuator.unit}"
        for word, value in (("below", limit.below), ("above", limit.above))
        if value is not None
    ]
    return f"{limit.name}: {actuator.name} {' or '.join(ends)}"


def _link_tones(model: Model, alerts: Iterable[Alert]) -> tuple[Tone, ...]:
    """The gravest tone of the alerts that name a link, which a self-collision does twice."""
    worst: dict[str, Alert] = {}
    for alert in alerts:
        for name in (alert.link, (alert.zone or "").removeprefix(SELF_ZONE)):
            if (
                name
                and not alert.shelved
                and (name not in worst or alert.urgency > worst[name].urgency)
            ):
                worst[name] = alert
    return tuple(
        tone_of(worst[name]) if name in worst else Tone.CALM for name in model.arm.link_names
    )


def _contact(alerts: Iterable[Alert], now_s: float) -> Contact | None:
    for alert in alerts:
        tone = tone_of(alert)
        if alert.contact_point_m is not None and tone is not Tone.CALM:
            label = f"{tone.look.shape} {alert.link or 'contact'}"
            lit = tone.lit(now_s, attention=_attention(alert))
            return Contact(alert.contact_point_m, tone, lit, label)
    return None


def _card(sight: Sight, alert: Alert, *, lost: bool) -> Card:
    stale = lost or sight.guard.expired(alert) or alert.quality == "stale"
    # a frozen alert is repeated: what it tells of is as old as the guard's newest input
    before_s = (alert.input_age_s or 0.0) if alert.quality == "stale" else 0.0
    age_s = sight.now_s - alert.received_s + before_s
    remarks = [f"last known, {age_s:.0f} s ago"] if stale else []
    if alert.state == "rtn_unacked":
        remarks.append("over: please acknowledge")
    elif alert.state == "acked":
        remarks.append(f"seen by {alert.acked_by or 'somebody'}")
    if alert.inhibit == "shelved":
        remarks.append(f"shelved by {alert.shelved_by or 'somebody'}")
    if alert.probability is not None:
        remarks.append(f"{alert.probability:.0%}")
    if alert.similar_situations is not None and alert.similar_contacts is not None:
        remarks.append(f"{alert.similar_contacts} of {alert.similar_situations} times")
    if alert.clearance_now_m is not None:
        remarks.append(f"now {alert.clearance_now_m:+.2f} m from the margin")
    return Card(
        alert_id=alert.alert_id,
        tone=Tone.LOST if stale else BY_LEVEL[alert.urgency],
        title=_title(alert),
        count=countdown(alert.time_to_collision_s),
        detail=" · ".join(remarks) or alert.source,
        flash=_attention(alert) and not stale,
        can_ack=alert.state in {"unacked", "rtn_unacked"},
        can_shelve=BY_LEVEL[alert.urgency] in {Tone.CAUTION, Tone.WARNING}
        and alert.zone is not None
        and not alert.shelved,
        shelved=alert.inhibit == "shelved",
    )


def _footer(sight: Sight) -> str:
    beat = sight.guard.heartbeat
    if beat is None:
        return sight.trouble or "no heartbeat yet"
    ages = beat.input_age_s
    parts = [
        f"{name} {value * 1000.0:.0f} ms"
        for name, value in (("joystick", ages.joystick_s), ("actuators", ages.actuators_s))
        if value is not None
    ]
    if beat.loop_ms is not None:
        parts.append(f"loop {beat.loop_ms.p50:.1f}/{beat.loop_ms.p99:.1f} ms p50/p99")
    if sight.guard.lost:
        parts.append(f"{sight.guard.lost} messages lost")
    return " · ".join([*parts, f"rampe-guard {beat.version}"])


def _count(number: int, one: str, more: str) -> str:
    return "" if number == 0 else f"{number} {one if number == 1 else more}"
