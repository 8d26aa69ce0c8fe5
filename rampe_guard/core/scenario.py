"""Scenarios: the few distinct ways in which the situation may go on, as paths from here.

Each analogue goes on from the present position as it went on then. Those that stay near to one
another all the way are one scenario with the sum of their weights; the most alike of them tells
its way. A way is a few straight pieces in actuator space, each of which can be swept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rampe_guard.core.situation_memory import Analogue
from rampe_guard.core.types import FloatArray

_SAME: Final = 0.1
"""Ways that are never further apart than this are one [share of `situation.TRAVEL_S`]."""
_STRAIGHT: Final = 0.03
"""A piece may leave the way that it stands for by so much [the same]."""
_LOOKS: Final = 6
"""Moments at which two ways are compared."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """One way on.

    Attributes:
        weight: sum of its analogues' weights.
        count: how many they are.
        time_s: of its p + 1 corners, from 0 on [s].
        corners: displacement from the present position at each (p + 1, n) [unit].
    """

    weight: float
    count: int
    time_s: FloatArray
    corners: FloatArray

    @property
    def end(self) -> FloatArray:
        """Where it leads: displacement from the present position (n,) [unit]."""
        last: FloatArray = self.corners[-1]
        return last


def scenarios(
    analogues: Sequence[Analogue], room: tuple[FloatArray, FloatArray], travel: FloatArray
) -> list[Scenario]:
    """Distinct scenarios, the weightiest first.

    Args:
        analogues: the most alike first.
        room: least and largest displacement that the limits leave (n,) each [unit].
        travel: measure of displacements (n,) [unit].
    """
    if not analogues:
        return []
    looks = np.linspace(0.0, min(float(a.time_s[-1]) for a in analogues), _LOOKS + 1)[1:]
    ways = [np.clip(a.path, *room) for a in analogues]
    places = [_at(a.time_s, way, looks) / travel for a, way in zip(analogues, ways, strict=True)]
    groups: list[list[int]] = []
    for index, place in enumerate(places):
        for group in groups:
            if float(np.abs(place - places[group[0]]).max()) < _SAME:
                group.append(index)
                break
        else:
            groups.append([index])
    found = [
        Scenario(
            sum(analogues[i].weight for i in group),
            len(group),
            *_corners(analogues[group[0]].time_s, ways[group[0]], travel),
        )
        for group in groups
    ]
    return sorted(found, key=lambda scenario: -scenario.weight)


def _at(time_s: FloatArray, way: FloatArray, looks: FloatArray) -> FloatArray:
    """Positions of a way (k, n) at k times."""
    right = np.clip(np.searchsorted(time_s, looks), 1, len(time_s) - 1)
    left = right - 1
    share = (looks - time_s[left]) / (time_s[right] - time_s[left])
    result: FloatArray = way[left] + np.minimum(share, 1.0)[:, None] * (way[right] - way[left])
    return result


def _corners(
    time_s: FloatArray, way: FloatArray, travel: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Times and places of the corners (Douglas and Peucker's, deviation by actuator)."""
    measure = way / travel
    kept = {0, len(way) - 1}
    spans = [(0, len(way) - 1)]
    while spans:
        first, last = spans.pop()
        between = slice(first + 1, last)
        if last == first + 1:
            continue
        share = (time_s[between] - time_s[first]) / (time_s[last] - time_s[first])
        chord = measure[first] + share[:, None] * (measure[last] - measure[first])
        off = np.abs(measure[between] - chord).max(axis=1)
        worst = int(off.argmax())
        if off[worst] > _STRAIGHT:
            middle = first + 1 + worst
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    index = sorted(kept)
    return time_s[index], way[index]
