"""The line that a cab display shows for an alert: at most `MAX_TEXT` characters."""

from __future__ import annotations

import math

MAX_TEXT = 60
_ARROW = " → "
_LONGEST_S = 99.0


def alert_text(
    link: str | None,
    zone: str | None,
    time_to_collision_s: float | None,
    level: str = "warning",
    source: str = "intent",
) -> str:
    """Text such as ``bucket → cab-wall in 1.4 s``; long names are cut, the time never.

    Args:
        link: the link that touches; None reads "arm".
        zone: the zone; for source "system" the reason.
        time_to_collision_s: [s], rounded down: no more time is promised than there is.
        level: "clear", "caution", "warning" or "imminent".
        source: of the alert.
    """
    link, zone = _line(link or "arm"), _line(zone or "obstacle")
    if source == "system":
        if level == "clear":
            return "monitoring again"
        if level == "caution":  # it monitors, but something was amiss
            return _cut(zone, MAX_TEXT)
        head = "NOT MONITORING: "
        return head + _cut(zone, MAX_TEXT - len(head))
    if level == "clear":
        tail = " clear"
        return _cut(zone, MAX_TEXT - len(tail)) + tail
    if source == "contact":
        return _pair(link, " at ", zone, "")
    return _pair(link, _ARROW, zone, _when(time_to_collision_s))


def _when(time_s: float | None) -> str:
    if time_s is None or not math.isfinite(time_s):
        return ", time unknown"
    if time_s > _LONGEST_S:
        return f" in >{_LONGEST_S:.0f} s"
    tenths = math.floor(time_s * 10.0 + 1e-6)  # 2.3 * 10 is 22.999999999999996
    return " now" if tenths <= 0 else f" in {tenths / 10:.1f} s"


def _pair(first: str, between: str, second: str, tail: str) -> str:
    """Both names in the room left, each with at least half of it where it needs so much."""
    room = MAX_TEXT - len(between) - len(tail)
    half = room // 2
    for_first = max(half, room - len(second))
    first = _cut(first, for_first)
    return first + between + _cut(second, room - len(first)) + tail


def _cut(name: str, room: int) -> str:
    return name if len(name) <= room else name[: room - 1] + "…"


def _line(name: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in name)
