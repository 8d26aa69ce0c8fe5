"""Alerts that were given live beside those of a replay: the same, and how far apart in time?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rampe_guard.core.events import SYSTEM_ZONE

TOGETHER_S = 1.0
"""Further apart, two changes of a zone to the same level are not the same change."""

Change = tuple[float, str]
"""Time [s] and the level from then on."""


@dataclass(frozen=True, slots=True)
class ZoneComparison:
    """The changes of level of one zone.

    Attributes:
        zone: its name.
        same: changes that both know.
        only_live: what only the live guard told.
        only_replay: what only the replay told.
        apart_s: replay less live, of the same changes [s].
    """

    zone: str
    same: int
    only_live: tuple[Change, ...]
    only_replay: tuple[Change, ...]
    apart_s: tuple[float, ...]


def changes(alerts: Iterable[tuple[float, str | None, str]]) -> dict[str, list[Change]]:
    """Changes of level by zone, from alerts (time [s], zone, level) with their repeats."""
    found: dict[str, list[Change]] = {}
    for time_s, name, level in alerts:
        before = found.setdefault(name or SYSTEM_ZONE, [])
        if level != (before[-1][1] if before else "clear"):
            before.append((time_s, level))
    return {zone: told for zone, told in found.items() if told}


def compare(
    live: dict[str, list[Change]], replayed: dict[str, list[Change]]
) -> tuple[ZoneComparison, ...]:
    """Hold the changes of all zones against each other."""
    zones = sorted(live.keys() | replayed.keys())
    return tuple(_compare(zone, live.get(zone, ()), replayed.get(zone, ())) for zone in zones)


def _compare(zone: str, live: Sequence[Change], replayed: Sequence[Change]) -> ZoneComparison:
    """In order of time: the next of one that is also the next of the other of that level."""
    left = list(replayed)
    apart, lonely = [], []
    for time_s, level in live:
        near = (
            i
            for i, (at_s, other) in enumerate(left)
            if other == level and abs(at_s - time_s) <= TOGETHER_S
        )
        index = next(near, None)
        if index is None:
            lonely.append((time_s, level))
        else:
            apart.append(left.pop(index)[0] - time_s)
    return ZoneComparison(zone, len(apart), tuple(lonely), tuple(left), tuple(apart))
