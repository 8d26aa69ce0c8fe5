"""What calibration asks of a forecast, and at which moments of a primitive."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from rampe_guard.core.passing import Moment, UnderWay
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.segments import Segment

SPACING_S = 0.1
"""Moments of one primitive lie at least this far apart [s]."""
_MOST = 100
"""Moments of one primitive that the guard keeps."""


class Predictive(Protocol):
    """A predictive distribution of the displacement of n actuators."""

    def quantile(self, p: float) -> FloatArray:
        """p-quantile of the displacement along Ω, with its sign (n,) [unit]."""
        ...

    def passing(
        self, distance: FloatArray, progress: FloatArray, under_way: UnderWay | None = None
    ) -> FloatArray:
        """P(|x_j| ≥ distance_j given |x_j| ≥ progress_j, lever and speed) along Ω (n,).

        Args:
            distance: (n,) [unit], not below the progress.
            progress: (n,) [unit], at least 0.
            under_way: lever and speed at this moment.
        """
        ...


def moments(segment: Segment, top_speed: FloatArray) -> list[Moment]:
    """The moments of a primitive that the guard keeps, until it sees that it has ended.

    Args:
        segment: a primitive.
        top_speed: of each actuator (n,) [unit/s].
    """
    sign = np.array(segment.start.category, dtype=np.float64)
    peaks = np.maximum.accumulate(np.abs(segment.commands), axis=0)
    found: list[Moment] = []
    last_s = -np.inf
    for k, t in enumerate(segment.times_s.tolist()):
        if t - last_s >= SPACING_S and len(found) < _MOST:
            speed = np.clip(sign * segment.velocities[k] / top_speed, 0.0, 1.0)
            under_way = UnderWay(np.abs(segment.commands[k]), peaks[k], speed)
            progress = np.maximum(sign * (segment.path[k] - segment.start.q), 0.0)
            found.append(Moment(progress, under_way))
            last_s = t
    return found
