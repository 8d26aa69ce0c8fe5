"""Units of experience: how far this operator works and how far he usually goes.

Angles and strokes, a slew of three turns and a cylinder used over a third of its stroke: the
estimator compares them in units that it learns. Starts are compared in shares of the range
worked in, displacements in shares of the actuator's usual displacement.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray, Indices

_LEAST_SHARE = 0.25
"""A range worked in counts at least this share of the limits: early on, little was seen."""
_OBSERVATION_WIDTH = 1.7
"""Ranges of an observation ξ beside q that count as one range of q: ξ says less than q."""
_STALE = 0.05
"""Relative change of a unit after which everything is scaled anew."""
_SLACK = 0.05
"""How far beyond its limits an actuator may be measured [share of the range]."""
_PRIOR_COUNT = 2.0
"""Displacements that the prior's usual displacement is worth."""


class Scales:
    """Learned units of n actuators and of the observations ξ beside them.

    Args:
        limits: (n, 2) [unit], infinite where there are none.
        displacement: usual displacement before any was seen [share of the range].
        observations: length of ξ.

    Attributes:
        bounded: which actuators have limits (n,).
        span: range by the limits (n,) [unit]; nan without.
        lowest, highest: the least and greatest position that can be measured (n,) [unit].
        low, high: what was seen of y (n + len(ξ),).
        moved: 1 for what the operator has moved, and for ξ (n + len(ξ),).
        count: displacements behind ``usual`` (n,).
        total: their sum (n,) [unit].
        largest: the largest of them (n,) [unit].
        inverse: 1 / unit of each entry of y (n + len(ξ),); 0 while it has not varied.
        usual: usual displacement (n,) [unit]; nan while unknown.
        version: grows when ``inverse`` changes.
    """

    def __init__(self, limits: FloatArray, displacement: float, observations: int = 0) -> None:
        n = len(limits)
        span = limits[:, 1] - limits[:, 0]
        known = np.isfinite(span)
        self.bounded = known
        self.span: FloatArray = np.where(known, span, np.nan)
        self.all_bounded = bool(known.all())
        self.lowest: FloatArray = limits[:, 0] - np.where(known, _SLACK * span, 0.0)
        self.highest: FloatArray = limits[:, 1] + np.where(known, _SLACK * span, 0.0)
        self._extra = np.concatenate((np.ones(n), np.full(observations, _OBSERVATION_WIDTH)))
        self._least = np.concatenate(
            (np.where(known, _LEAST_SHARE * span, 0.0), np.zeros(observations))
        )
        self._most = np.concatenate((np.where(known, span, np.inf), np.full(observations, np.inf)))
        self.low: FloatArray = np.full(n + observations, np.inf)
        self.high: FloatArray = np.full(n + observations, -np.inf)
        self.moved: FloatArray = np.zeros(n + observations)
        self.moved[n:] = 1.0
        self.count: FloatArray = np.where(known, _PRIOR_COUNT, 0.0)
        self.total: FloatArray = np.where(known, _PRIOR_COUNT * displacement * span, 0.0)
        self.largest: FloatArray = np.zeros(n)
        self.version = 0
        self.inverse: FloatArray = np.zeros(n + observations)
        self._measure_usual()

    def learn(
        self,
        y: FloatArray,
        x: FloatArray,
        active: Indices,
        move: FloatArray,
    ) -> None:
        """Take a primitive from y (n + len(ξ),) that went x (n,), by ``move`` along Ω (m,)."""
        n = len(x)
        end = y.copy()
        end[:n] += x
        low = np.minimum(self.low, np.minimum(y, end))
        high = np.maximum(self.high, np.maximum(y, end))
        further = (low < self.low).any() or (high > self.high).any()
        if further or not self.moved[active].all():
            self.low, self.high = low, high
            self.moved[active] = 1.0
            self._measure()
        size = np.abs(move)
        self.total[active] += size
        self.count[active] += 1.0
        self.largest[active] = np.maximum(self.largest[active], size)
        if self.total[active].all():
            self.usual[active] = self.total[active] / self.count[active]
        else:
            self._measure_usual()

    @property
    def known(self) -> npt.NDArray[np.bool_]:
        """Which actuators have a usual displacement (n,)."""
        return ~np.isnan(self.usual)

    @property
    def slope(self) -> FloatArray:
        """1 / half of the range seen, of each entry of y (n + len(ξ),); 0 where unknown.

        The unit of functions that have slopes: there it is no matter how much an observation
        tells, the fit will see.
        """
        return 2.0 * self._extra * self.inverse

    def refresh(self) -> None:
        """Take up what was restored."""
        self.version += 1
        self._measure_usual()

    def _measure(self) -> None:
        """Adopt the units that were seen, if they differ enough from those in force."""
        reach = np.minimum(np.maximum(self.high - self.low, self._least), self._most)
        # what the operator has not moved yet, or what never varied, tells starts not apart
        told = (self.moved > 0.0) & (reach > 0.0)
        inverse = np.zeros(len(reach))
        inverse[told] = 1.0 / (reach[told] * self._extra[told])
        if (np.abs(inverse - self.inverse) > _STALE * self.inverse).any():
            self.inverse = inverse
            self.version += 1

    def _measure_usual(self) -> None:
        known = (self.count > 0.0) & (self.total > 0.0)
        self.usual: FloatArray = np.full(len(self.count), np.nan)
        self.usual[known] = self.total[known] / self.count[known]
