"""What lever and speed did during a primitive, kept until its end says what they meant."""

from __future__ import annotations

import numpy as np

from rampe_guard.core.passing import Moment, UnderWay
from rampe_guard.core.types import Category, FloatArray

SPACING_S = 0.1
"""Moments of one primitive lie at least this far apart [s]."""
_MOST = 100


class MomentKeeper:
    """Follows one primitive.

    Args:
        category: Ω.
        start: q[k] (n,) [unit].
        top_speed: of each actuator (n,) [unit/s].

    Attributes:
        moments: those kept.
    """

    def __init__(self, category: Category, start: FloatArray, top_speed: FloatArray) -> None:
        self._sign = np.array(category, dtype=np.float64)
        self._start = start
        self._top = top_speed
        self._peak: FloatArray = np.zeros(len(start))
        self._kept_s = float("-inf")
        self.moments: list[Moment] = []

    def see(
        self, stamp_s: float, position: FloatArray, velocity: FloatArray, command: FloatArray
    ) -> None:
        """Take position [unit], velocity [unit/s] and filtered lever [-] (n,) at ``stamp_s``."""
        self._peak = np.maximum(self._peak, np.abs(command))
        if stamp_s - self._kept_s >= SPACING_S and len(self.moments) < _MOST:
            self._kept_s = stamp_s
            progress = np.maximum(self._sign * (position - self._start), 0.0)
            self.moments.append(Moment(progress, self.under_way(velocity, command)))

    def under_way(self, velocity: FloatArray, command: FloatArray) -> UnderWay:
        """How lever and speed bear on the primitive at this velocity and command (n,)."""
        speed = np.clip(self._sign * velocity / self._top, 0.0, 1.0)
        return UnderWay(np.abs(command), self._peak.copy(), speed)
