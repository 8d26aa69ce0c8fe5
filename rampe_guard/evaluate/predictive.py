"""What calibration asks of a forecast, and at which moments of a primitive."""

from __future__ import annotations

from typing import Protocol

from rampe_guard.core.moments import MomentKeeper
from rampe_guard.core.passing import Moment, UnderWay
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.segments import Segment


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
    keeper = MomentKeeper(segment.start.category, segment.start.q, top_speed)
    way = zip(
        segment.times_s.tolist(), segment.path, segment.velocities, segment.commands, strict=True
    )
    for seen in way:
        keeper.see(*seen)
    return keeper.moments
