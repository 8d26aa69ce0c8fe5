"""Sweeps of many straight paths: where each first touches each zone.

Actuator limits have a closed form (`core.sweep_limit`), here of all paths at once; solid zones
and the arm against itself go through the machine's certified sweep, one path after the other.
The manners are those of the guard: moving away is no contact, and no answer is one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.collision import FclSweeper
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.core.types import Certificate, FloatArray, ZoneSweep


class Touch:
    """First contacts of many paths of one machine.

    Args:
        sweeper: of the machine.
        zones: names of the zones that are asked about.
    """

    def __init__(self, sweeper: FclSweeper, zones: Sequence[str]) -> None:
        self.zones = tuple(zones)
        self._sweeper = sweeper
        self._column = {name: z for z, name in enumerate(self.zones)}
        self._limits = [
            item
            for item in sweeper.scene.objects
            if isinstance(item, ActuatorLimit) and item.name in self._column
        ]
        self._solid = frozenset(self.zones) - {item.name for item in self._limits}

    def limit_of(self, zone: str) -> ActuatorLimit | None:
        """The actuator limit of that name, None for a solid zone."""
        return next((item for item in self._limits if item.name == zone), None)

    def first(self, start: FloatArray, displacement: FloatArray) -> FloatArray:
        """First fraction at which each path touches each zone (k, z), inf where it does not.

        Args:
            start: actuator values (k, n) [unit].
            displacement: their change (k, n) [unit].
        """
        found = np.full((len(start), len(self.zones)), np.inf)
        for item in self._limits:
            q, x = start[:, item.actuator], displacement[:, item.actuator]
            found[:, self._column[item.name]] = _limit_fraction(item, q, x)
        if self._solid:
            # what stands still closes in on nothing
            for row in np.flatnonzero(displacement.any(axis=1)).tolist():
                swept = self._sweeper.sweep(
                    start[row], displacement[row], clearance=False, only=self._solid
                )
                for entry in swept.zones:
                    found[row, self._column[entry.zone]] = _fraction(entry)
        return found

    def near(self, position: FloatArray, within: float) -> list[frozenset[str]]:
        """The zones that each step from one position to the next could concern (k).

        All solid ones, and the actuator limits that are no further than ``within`` [unit] at
        either end of the step: between the ends the distance is never less than at both.
        """
        found = [self._solid] * len(position)
        for item in self._limits:
            value = position[:, item.actuator]
            close = _limit_clearance(item, value) <= within
            close[1:] |= close[:-1].copy()
            for row in np.flatnonzero(close).tolist():
                found[row] |= {item.name}
        return found

    def clearance(self, position: FloatArray) -> FloatArray:
        """How far the arm is from each zone (k, z): [m], or the actuator's unit for limits.

        Less the zone's margin; negative inside, and 0 where there is no answer.
        """
        found = np.zeros((len(position), len(self.zones)))
        for item in self._limits:
            value = position[:, item.actuator]
            found[:, self._column[item.name]] = _limit_clearance(item, value)
        if self._solid:
            still = np.zeros(position.shape[1])
            last: tuple[FloatArray, FloatArray] | None = None
            for row, q in enumerate(position):
                if last is None or not np.array_equal(last[0], q):
                    swept = self._sweeper.sweep(q, still, only=self._solid)
                    values = np.zeros(len(self.zones))
                    for entry in swept.zones:
                        values[self._column[entry.zone]] = entry.clearance_now_m or 0.0
                    last = q, values
                for name in self._solid:
                    found[row, self._column[name]] = last[1][self._column[name]]
        return found


def _fraction(entry: ZoneSweep) -> float:
    if entry.certificate is Certificate.FREE or (entry.inside and not entry.closing):
        return np.inf
    return entry.contact_fraction or 0.0


def _limit_clearance(zone: ActuatorLimit, value: FloatArray) -> FloatArray:
    above = np.inf if zone.above is None else zone.above - value
    below = np.inf if zone.below is None else value - zone.below
    nearest: FloatArray = np.minimum(above, below) + np.zeros_like(value)
    return nearest


def _limit_fraction(zone: ActuatorLimit, q: FloatArray, x: FloatArray) -> FloatArray:
    """`core.sweep_limit.sweep_limit`, of many paths (k,)."""
    found = np.full(len(q), np.inf)
    moving = x != 0.0
    pace = np.where(moving, x, 1.0)
    for edge in (zone.above, zone.below):
        if edge is not None:
            at = (edge - q) / pace
            crossed = moving & (at >= 0.0) & (at <= 1.0)
            found = np.where(crossed, np.minimum(found, at), found)
    end_inside = _limit_clearance(zone, q + x) <= 0.0
    found = np.where(np.isinf(found) & end_inside, 1.0, found)
    up = np.full(len(q), np.inf) if zone.above is None else zone.above - q
    down = np.full(len(q), np.inf) if zone.below is None else q - zone.below
    closing = np.where(up < down, x > 0.0, np.where(down < up, x < 0.0, moving))
    inside = _limit_clearance(zone, q) <= 0.0
    return np.where(inside, np.where(closing, 0.0, np.inf), found)
