"""The guard's own account as a diagnostic_msgs/DiagnosticArray, for rqt and the aggregator.

Two entries: whether the machine is protected, and its alerts. Only a guard that monitors, and whose
word is fresh, is ever OK; alerts of one that does not are STALE, never OK.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any

from rampe_guard import wire
from rampe_guard.ros2 import cdr

OFF = "machine_off"


class Grade(IntEnum):
    """Levels of a DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


_PROTECTION = {"ok": Grade.OK, "degraded": Grade.WARN, "not_monitoring": Grade.ERROR}
_ALERTS = {"clear": Grade.OK, "caution": Grade.WARN, "warning": Grade.WARN, "imminent": Grade.ERROR}


def monitors(state: wire.State | None) -> bool:
    """Whether anything that a state says can be trusted; None: its guard fell silent."""
    return state is not None and state.heartbeat.status != "not_monitoring"


def diagnostics(
    state: wire.State | None,
    node: str,
    machine: str,
    stamp_s: float,
    lost: Mapping[str, int],
    why: str = "",
) -> Any:
    """A diagnostic_msgs/DiagnosticArray.

    Args:
        state: the newest; None where there is none that still holds.
        node: name of the guard's node.
        machine: which it guards.
        stamp_s: now [s since 1970].
        lost: messages lost on their way, by input.
        why: why there is no state.
    """
    status = [
        _protection(state, node, machine, lost, why),
        _alerts(state, node, machine),
    ]
    return cdr.make(
        "diagnostic_msgs/msg/DiagnosticArray", header=cdr.header(stamp_s, ""), status=status
    )


def _protection(
    state: wire.State | None, node: str, machine: str, lost: Mapping[str, int], why: str
) -> Any:
    if state is None:
        return _status(Grade.ERROR, f"{node}: protection", f"NOT MONITORING: {why}", machine, {})
    beat = state.heartbeat
    grade = _PROTECTION[beat.status]
    if beat.status == "not_monitoring" and {r.code for r in beat.reasons} == {OFF}:
        grade = Grade.STALE  # no fault, and nobody watches
    said = {"ok": "monitoring", "degraded": "monitoring, degraded"}.get(beat.status)
    words = [said or "NOT MONITORING", *(reason.text for reason in beat.reasons)]
    ages, rates = beat.input_age_s, beat.rates_hz
    values: dict[str, object] = {
        "status": beat.status,
        "reasons": ", ".join(reason.code for reason in beat.reasons) or "none",
        "age of joystick [s]": _number(ages.joystick_s),
        "age of actuators [s]": _number(ages.actuators_s),
        "rate of joystick [1/s]": _number(rates.joystick),
        "rate of actuators [1/s]": _number(rates.actuators),
        "scene": beat.scene_hash[:12],
        "version": beat.version,
    }
    for name, counts in sorted(beat.rejected.items()):
        for reason, count in sorted(counts.items()):
            values[f"{name} refused: {reason}"] = count
    values |= {f"{name} lost on the way": count for name, count in lost.items()}
    return _status(grade, f"{node}: protection", ": ".join(words[:1] + words[1:2]), machine, values)


def _alerts(state: wire.State | None, node: str, machine: str) -> Any:
    name = f"{node}: alerts"
    if state is None or not monitors(state):
        return _status(Grade.STALE, name, "not known: NOT MONITORING", machine, {})
    active = wire.by_urgency(a for a in state.alerts if a.level != "clear")
    grade = max((_ALERTS[alert.level] for alert in active), default=Grade.OK)
    values = {f"{a.zone or 'system'} ({a.level})": a.text for a in active}
    return _status(grade, name, active[0].text if active else "clear", machine, values)


def _status(
    grade: Grade, name: str, message: str, machine: str, values: Mapping[str, object]
) -> Any:
    pairs: Sequence[Any] = [
        cdr.make("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
        for key, value in values.items()
    ]
    return cdr.make(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=int(grade),
        name=name,
        message=message,
        hardware_id=machine,
        values=list(pairs),
    )


def _number(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.3g}"
