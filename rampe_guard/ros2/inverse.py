"""From joint to actuator: the inverse of a drive, and of its speed.

ROS 2 tells where joints are; a cylinder is measured by its stroke. A drive is strictly monotone
between the limits of its actuator (`core.drive_proof`), so there the inverse is unique; it goes on
beyond them for as long as the drive stays monotone, at most by a fifth of the range. What lies
outside has no inverse, and none is made up.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Final

import numpy as np

from rampe_guard.core.drive import (
    DirectDrive,
    Drive,
    domain,
    joint_scalar,
    joint_value,
)

_BEYOND: Final = 0.2
_LOOKS: Final = 257
_CELLS: Final = 512
_TRIES: Final = 50
_EXACT: Final = 1e-13
"""Of a joint [rad or m]: below it are only rounding errors."""
_STEP: Final = 1e-6
"""Of the difference that gives a slope [share of the range]."""
_FLAT: Final = 1e-9
"""A slope smaller than this is none: rounding alone would make a speed of it."""


class Inverse:
    """q(θ) and q̇(θ̇) of one actuator.

    Args:
        drive: θ(q).
        lower: limit of q [unit]; may be infinite for direct drives.
        upper: the other.
    """

    def __init__(self, drive: Drive, lower: float, upper: float) -> None:
        self._drive = drive
        self._theta: list[float] = []
        self._q: list[float] = []
        if isinstance(drive, DirectDrive):
            return
        low, high = domain(drive)
        lower, upper = max(lower, low), min(upper, high)
        width = upper - lower
        self._low = self._reach(lower, max(low, lower - _BEYOND * width))
        self._high = self._reach(upper, min(high, upper + _BEYOND * width))
        self._step = _STEP * width
        grid = np.linspace(self._low, self._high, _CELLS + 1)
        theta = [joint_scalar(drive, float(q)) for q in grid]
        rises = np.diff(theta)
        if not ((rises > 0.0).all() or (rises < 0.0).all()):
            self._theta, self._q = [], []  # limits that do not hold a drive to one branch
            return
        order = slice(None) if theta[-1] > theta[0] else slice(None, None, -1)
        self._theta, self._q = theta[order], grid.tolist()[order]

    def actuator(self, joint: float) -> float:
        """The value q [unit] for θ [rad or m]; NaN where there is none."""
        drive = self._drive
        if isinstance(drive, DirectDrive):
            return (joint - drive.offset) / drive.scale
        theta = self._theta
        if not theta or not theta[0] <= joint <= theta[-1]:
            return math.nan
        cell = min(bisect_right(theta, joint), len(theta) - 1)
        return self._sought(joint, cell)

    def speed(self, actuator: float, joint_speed: float) -> float:
        """The speed q̇ [unit/s] at q for θ̇ [rad/s or m/s]; NaN without a slope to speak of."""
        drive = self._drive
        if isinstance(drive, DirectDrive):
            return joint_speed / drive.scale
        before = max(self._low, actuator - self._step)
        after = min(self._high, actuator + self._step)
        rise = joint_scalar(drive, after) - joint_scalar(drive, before)
        slope = rise / (after - before)
        return joint_speed / slope if abs(slope) > _FLAT else math.nan

    def _sought(self, joint: float, cell: int) -> float:
        """The value within a cell of the grid, by the rule of Illinois: a few looks."""
        drive = self._drive
        a, b = self._q[cell - 1], self._q[cell]
        below, above = self._theta[cell - 1] - joint, self._theta[cell] - joint
        side = 0
        for _ in range(_TRIES):
            if above == below:
                break
            q = (a * above - b * below) / (above - below)
            off = joint_scalar(drive, q) - joint
            if abs(off) <= _EXACT:
                return q
            if off < 0.0:
                a, below = q, off
                above *= 0.5 if side < 0 else 1.0
                side = -1
            else:
                b, above = q, off
                below *= 0.5 if side > 0 else 1.0
                side = 1
        return a if abs(below) < abs(above) else b

    def _reach(self, limit: float, far: float) -> float:
        """How far from a limit outwards to ``far`` the drive stays strictly monotone."""
        if far == limit:
            return limit
        q = np.linspace(limit, far, _LOOKS)
        steps = np.diff(joint_value(self._drive, q))
        good = np.isfinite(steps) & (np.sign(steps) == np.sign(steps[0])) & (steps != 0.0)
        # the first step must go on as the drive comes from within
        inside = joint_scalar(self._drive, limit - (q[1] - limit))
        if not (joint_scalar(self._drive, limit) - inside) * steps[0] > 0.0:
            return limit
        bad = np.flatnonzero(~good)
        return float(q[bad[0]] if bad.size else q[-1])
