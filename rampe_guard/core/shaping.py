"""How far an actuator still goes if it is commanded so much, and how much it may be commanded.

The law behind the advice: a command that holds for `hold_s` and is then let go of takes an
actuator, which moves at v (along the direction asked about), at most

    reach(w) = v·lag + max(v, w)²/(2a) + w·hold,    w = share of the top speed commanded

and one that comes from the other direction at most w²/(2a) + w·hold. Both grow with w, so the
largest share that stays within a room follows in closed form. Where commands are still under way
to the drive, v is the speed that they will bring, if that is more (`Pending`).

Actuators do not come to rest together: `legs` cuts a motion where each of them does.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray

_TOGETHER_S = 0.05
"""Actuators that come to rest within this time count as coming to rest together [s]."""


class ShapingLaw:
    """Reaches and shares of n actuators.

    Args:
        actuators: in site order.
        hold_s: how long a command may last before the next advice counts [s].
    """

    def __init__(self, actuators: tuple[ActuatorConfig, ...], hold_s: float) -> None:
        self._top = np.array([a.max_velocity for a in actuators])
        self._deceleration = np.array([a.max_deceleration for a in actuators])
        self._lag_s = np.array([a.lag_s for a in actuators])
        self._hold_s = hold_s

    def coast(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where all go that are let go of now (n,) [unit], and for how long (n,) [s].

        Args:
            velocity: (n,) [unit/s].
        """
        size = np.abs(velocity)
        way = velocity * (self._lag_s + size / 2.0 / self._deceleration)
        return way, self._lag_s + size / self._deceleration

    def reach(self, i: int, along: float, share: float) -> float:
        """How far actuator ``i`` goes [unit], which moves ``along`` [unit/s], if so commanded."""
        speed, brake = share * float(self._top[i]), 2.0 * float(self._deceleration[i])
        held = speed * self._hold_s
        if along <= 0.0:
            return held + speed * speed / brake
        return along * float(self._lag_s[i]) + max(along, speed) ** 2 / brake + held

    def lasts_s(self, i: int, along: float, share: float) -> float:
        """How long that takes [s]."""
        speed = max(along, share * float(self._top[i]))
        return float(self._lag_s[i]) + self._hold_s + speed / float(self._deceleration[i])

    def share(self, i: int, along: float, room: float) -> float:
        """Largest share in [0, 1] whose reach is within ``room`` [unit]; 0 where none is."""
        top, a, hold = float(self._top[i]), float(self._deceleration[i]), self._hold_s
        if along > 0.0:
            room -= along * float(self._lag_s[i])
            slow = (room - along * along / 2.0 / a) / hold  # it brakes down to the command
            if slow <= along:
                return min(max(slow, 0.0) / top, 1.0)
        if room <= 0.0:
            return 0.0
        # w²/(2a) + w·hold = room, in the form that does not cancel
        speed = 2.0 * room / (hold + math.sqrt(hold * hold + 2.0 * room / a))
        return min(speed / top, 1.0)


class Pending:
    """Commands of the last moments, which the drives have yet to obey.

    Args:
        actuators: in site order.
        more_s: how much longer than its lag a command counts [s].
    """

    def __init__(self, actuators: tuple[ActuatorConfig, ...], more_s: float) -> None:
        self._top = np.array([a.max_velocity for a in actuators])
        self._window_s = np.array([a.lag_s for a in actuators]) + more_s
        self._given: deque[tuple[float, FloatArray]] = deque()

    def forget(self) -> None:
        """Nothing is under way."""
        self._given.clear()

    def give(self, command: FloatArray, now_s: float) -> None:
        """A command (n,) in [-1, 1] was given."""
        self._given.append((now_s, command))
        while now_s - self._given[0][0] > self._window_s.max():
            self._given.popleft()

    def speeds(self, now_s: float) -> FloatArray:
        """Top speeds that are under way towards smaller and larger values (n, 2) [unit/s]."""
        speeds = np.zeros((len(self._top), 2))
        for at_s, command in self._given:
            live = np.where(now_s - at_s <= self._window_s, command * self._top, 0.0)
            speeds = np.maximum(speeds, np.stack((-live, live), axis=1))
        return speeds


def legs(way: FloatArray, lasts_s: FloatArray) -> Iterator[FloatArray]:
    """A motion, cut where actuators come to rest: displacements (n,) that add up to ``way``.

    Args:
        way: (n,) [unit].
        lasts_s: how long each actuator moves (n,) [s], evenly.
    """
    moving = way != 0.0
    ends = np.unique(lasts_s[moving])
    done = np.zeros_like(way)
    for k, end_s in enumerate(ends):
        if k + 1 < len(ends) and ends[k + 1] - end_s < _TOGETHER_S:
            continue
        share = np.minimum(end_s / np.where(moving, lasts_s, 1.0), 1.0)
        leg = np.where(moving, way * share, 0.0) - done
        done += leg
        yield leg
