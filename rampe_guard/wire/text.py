"""The line that a cab display shows for an alert: at most `MAX_TEXT` characters and cells.

It names the link, the zone and the time; where there is none, a word stands in for it. Names
that are too long are shortened, the sentence never.
"""

from __future__ import annotations

import math
import unicodedata

MAX_TEXT = 60
_ARROW = " → "
_BLIND = "NOT MONITORING: "
_LONGEST_S = 99.0


def alert_text(
    link: str | None,
    zone: str | None,
    time_to_collision_s: float | None,
    level: str = "warning",
    source: str = "intent",
    *,
    machine_off: bool = False,
    in_margin: bool = False,
    times: tuple[int, int] | None = None,
) -> str:
    """Text such as ``bucket → cab-wall in 1.4 s``.

    Args:
        link: the link that touches; None reads "arm".
        zone: the zone; for source "system" the reason.
        time_to_collision_s: [s], rounded down: no more time is promised than there is.
        level: "clear", "caution", "warning" or "imminent".
        source: of the alert.
        machine_off: it is suppressed, since the machine is switched off.
        in_margin: the link is within the zone's margin, which is no alarm while it does not near.
        times: how many of how many similar situations touched; None where memory does not speak.
    """
    link, zone = _line(link or "arm"), _line(zone or "obstacle")
    if source == "system":
        return _system(zone, level, machine_off=machine_off)
    if machine_off:
        return _pair(link, _ARROW, zone, ": machine off")
    if level == "clear" and in_margin:
        return _pair(link, " in margin of ", zone, ", not nearing")
    if level == "clear":
        return _pair(link, " clear of ", zone, " now")
    if source == "contact":
        return _pair(link, " at ", zone, " now")
    why = "" if times is None else f", {times[0]} of {times[1]} times"
    return _pair(link, _ARROW, zone, _when(time_to_collision_s) + why)


def in_full(text: str, reason: str) -> str:
    """The text of an alert about the guard itself with all of its reason, for who has room.

    Args:
        text: as `alert_text` made it, with "…" if it was cut.
        reason: of the alert.
    """
    if not text.endswith("…"):
        return text
    return (_BLIND if text.startswith(_BLIND) else "") + _line(reason)


def advice_text(lever: str | None, share: float, zone: str | None) -> str:
    """Text such as ``swing at most 30 %: cab-wall``, of the lever that is limited most.

    Args:
        lever: actuator; None if nothing is limited.
        share: of its top speed.
        zone: what limits it.
    """
    if lever is None:
        return "levers free"
    # rounded down: no more is promised than was proven
    return _pair(
        _line(lever), f" at most {math.floor(100.0 * share)} %: ", _line(zone or "obstacle"), ""
    )


def no_advice_text(reason: str) -> str:
    """Text for the time while nobody can tell."""
    head = "NO ADVICE: "
    return head + _cut(_line(reason), MAX_TEXT - len(head))


def _system(reason: str, level: str, *, machine_off: bool) -> str:
    if level == "clear":
        return "machine off: not monitoring" if machine_off else "monitoring again"
    if level == "caution":  # it monitors, but something was amiss
        return _cut(reason, MAX_TEXT)
    return _BLIND + _cut(reason, MAX_TEXT - len(_BLIND))


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
    for_first = max(half, room - _cells(second))
    first = _cut(first, for_first)
    return first + between + _cut(second, room - _cells(first)) + tail


def _cut(name: str, room: int) -> str:
    """As much of ``name`` as ``room`` cells hold, with "…" where something is missing."""
    if _cells(name) <= room:
        return name
    kept, left = [], room - 1
    for letter in name:
        left -= _cells(letter)
        if left < 0:
            break
        kept.append(letter)
    return "".join(kept) + "…"


def _cells(name: str) -> int:
    """Width on a display in cells, none below one for each character: both are limited."""
    return sum(2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in name)


def _line(name: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in name)
