"""What calibration asks of a forecast, and RAMPE's Student-t as an answer to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import stdtr, stdtrit

from rampe_guard.core.rampe import DisplacementForecast
from rampe_guard.core.types import Category, FloatArray


class Predictive(Protocol):
    """A predictive distribution of the displacement of n actuators."""

    def quantile(self, p: float) -> FloatArray:
        """p-quantile of the signed displacement (n,) [unit]."""
        ...

    def passing(self, distance: FloatArray, progress: FloatArray) -> FloatArray:
        """P(|x_j| ≥ distance_j given |x_j| ≥ progress_j) along the sign of Ω (n,).

        Args:
            distance: (n,) [unit], not below the progress.
            progress: (n,) [unit], at least 0.
        """
        ...


@dataclass(frozen=True, slots=True)
class StudentPredictive:
    """The Student-t of a forecast of a primitive of Ω ``category``."""

    forecast: DisplacementForecast
    category: Category

    def quantile(self, p: float) -> FloatArray:
        """See `Predictive`."""
        known = self.forecast
        result: FloatArray = known.mean + known.scale * stdtrit(known.dof, p)
        return result

    def passing(self, distance: FloatArray, progress: FloatArray) -> FloatArray:
        """See `Predictive`."""
        known = self.forecast
        mean = np.array(self.category) * known.mean
        here = stdtr(known.dof, (mean - progress) / known.scale)
        there = stdtr(known.dof, (mean - distance) / known.scale)
        chance: FloatArray = np.clip(there / np.maximum(here, np.finfo(np.float64).tiny), 0.0, 1.0)
        return chance
