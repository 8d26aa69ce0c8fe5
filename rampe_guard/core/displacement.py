"""The forecast of a displacement: a distribution per actuator, and what can be asked of it.

Along the sign of Ω, x of an actuator has the distribution G(T((x - mean)/scale)): T the
Student-t, G the learned shape (identity while nothing is known). Where two futures were seen
from one start, it is a mixture of two Student-t instead, one about each end.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtr, stdtrit

from rampe_guard.core.passing import PassingWeights, UnderWay, condition, uncondition
from rampe_guard.core.types import Category, FloatArray

_LEAST_SURVIVAL = 1e-9
"""Beyond this the operator has left all experience behind: no more is foreseen."""
_BISECTIONS = 40
_LEVELS = (1e-12, 1.0 - 1e-12)
"""A Student-t has no ends: nearer to them than this is not asked."""


@dataclass(frozen=True, slots=True)
class DisplacementForecast:
    """Predictive distribution of x, for n actuators.

    Attributes:
        category: Ω.
        mean: expected x (n,) [unit], never against Ω nor past a limit, 0 where Ω is 0 (faithful
            mode: as the paper has it, without any of these bounds). Where two futures are
            seen nobody stops there: see `modes` and `likeliest`.
        scale: of the Student-t (n,) [unit], 0 where Ω is 0; nan where no spread is known.
        dof: its degrees of freedom (n,).
        occurrences: primitives of this very category behind it.
        related: other categories that it borrows from.
        covariance: joint covariance of x (n, n) [unit²]; nan where no spread is known.
        shape: learned cumulated shape (n, bins + 1), or None for the plain Student-t.
        modes: the two futures (2, n) [unit], likelier first, or None.
        mode_weights: their shares (2,).
        room: way to the joint's limit along Ω (n,) [unit], infinite without limits.
        weights: how lever and speed bear on the progress (see `passing`).
    """

    category: Category
    mean: FloatArray
    scale: FloatArray
    dof: FloatArray
    occurrences: int
    related: tuple[Category, ...] = ()
    covariance: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    shape: FloatArray | None = None
    modes: FloatArray | None = None
    mode_weights: FloatArray = field(default_factory=lambda: np.ones(1))
    room: FloatArray | None = None
    weights: PassingWeights | None = None

    @property
    def borrowed(self) -> bool:
        """True if this category was never seen and related ones speak for it."""
        return self.occurrences == 0

    @property
    def bimodal(self) -> bool:
        """True if from such a start two futures were seen, and not one."""
        return self.modes is not None

    @property
    def likeliest(self) -> FloatArray:
        """Where he most likely ends (n,) [unit]; the mean, or the likelier of two futures."""
        return self.mean if self.modes is None else self.modes[0]

    def survival(self, distance: FloatArray) -> FloatArray:
        """P(X ≥ distance) (..., n) along Ω, for distances (..., n) [unit]; 0 where Ω is 0."""
        sign = np.asarray(self.category, dtype=np.float64)
        distance = np.asarray(distance, dtype=np.float64)
        if distance.shape[-1:] != sign.shape or np.isnan(distance).any():
            raise ValueError(f"distance {distance} must be {len(sign)} numbers")
        if self.modes is None:
            result = 1.0 - self._shaped(_cdf(distance, sign * self.mean, self.scale, self.dof))
        else:
            result = sum(
                w * (1.0 - _cdf(distance, sign * mode, self.scale, self.dof))
                for w, mode in zip(self.mode_weights, self.modes, strict=True)
            )
        if self.room is not None:
            result = np.where(distance > self.room, 0.0, result)
        return np.where(sign != 0.0, result, 0.0)

    def quantile(self, p: float | FloatArray) -> FloatArray:
        """Signed displacement x (n,) that is not exceeded along Ω with probability ``p``.

        It does not lead against Ω nor past a limit: there the distribution ends.
        """
        if not (np.min(p) >= 0.0 and np.max(p) <= 1.0):
            raise ValueError(f"a quantile of probability {p} cannot be")
        sign = np.asarray(self.category, dtype=np.float64)
        level = np.clip(np.broadcast_to(np.asarray(p, dtype=np.float64), sign.shape), *_LEVELS)
        if self.modes is None:
            deviation: FloatArray = stdtrit(self.dof, self._unshaped(level))
            along = sign * self.mean + self.scale * deviation
        else:
            along = self._mixture_quantile(level)
        room = np.inf if self.room is None else self.room
        return np.where(sign != 0.0, sign * np.clip(along, 0.0, room), 0.0)

    def passing(
        self, distance: FloatArray, progress: FloatArray, under_way: UnderWay | None = None
    ) -> FloatArray:
        """P(X ≥ distance | X ≥ progress, what lever and speed say) (..., n), along Ω.

        Args:
            distance: (..., n) from the start along Ω [unit].
            progress: way already made along Ω (..., n) [unit].
            under_way: lever and speed now; without it the survival form S(d)/S(p) alone.
        """
        here = np.maximum(self.survival(progress), 0.0)
        there = self.survival(distance)
        ratio = np.where(here > _LEAST_SURVIVAL, there / np.maximum(here, _LEAST_SURVIVAL), 0.0)
        ratio = np.where(np.isnan(there), np.nan, np.clip(ratio, 0.0, 1.0))
        if under_way is not None and self.weights is not None:
            ratio = condition(ratio, self.weights, under_way)
        return np.where(np.asarray(distance) <= progress, 1.0, ratio)

    def reach(
        self, probability: float, progress: FloatArray, under_way: UnderWay | None = None
    ) -> FloatArray:
        """Distance (n,) along Ω that is passed with ``probability`` from ``progress`` (n,) on.

        The inverse of `passing`; no less than the progress, and no more than that where the
        operator has left all experience behind.
        """
        level = np.full(len(self.mean), probability)
        if under_way is not None and self.weights is not None:
            level = uncondition(level, self.weights, under_way)
        here = self.survival(progress)
        along = np.abs(self.quantile(1.0 - np.clip(level, 0.0, 1.0) * here))
        return np.where(here > _LEAST_SURVIVAL, np.maximum(along, progress), progress)

    def _shaped(self, plain: FloatArray) -> FloatArray:
        if self.shape is None:
            return plain
        bins = self.shape.shape[1] - 1
        at = np.clip(plain, 0.0, 1.0) * bins
        left = np.minimum(at.astype(np.intp), bins - 1)
        row = np.arange(plain.shape[-1])
        low = self.shape[row, left]
        result: FloatArray = low + (at - left) * (self.shape[row, left + 1] - low)
        return result

    def _unshaped(self, shaped: FloatArray) -> FloatArray:
        if self.shape is None:
            return shaped
        grid = np.linspace(0.0, 1.0, self.shape.shape[1])
        return np.array(
            [np.interp(p, known, grid) for p, known in zip(shaped, self.shape, strict=True)]
        )

    def _mixture_quantile(self, level: FloatArray) -> FloatArray:
        # bisection between the outer ends: a mixture's quantile has no closed form
        ends = np.abs(np.asarray(self.modes))
        wide = self.scale * np.abs(stdtrit(self.dof, 1e-9))
        low, high = ends.min(axis=0) - wide, ends.max(axis=0) + wide
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            below = sum(
                w * _cdf(middle, end, self.scale, self.dof)
                for w, end in zip(self.mode_weights, ends, strict=True)
            )
            low, high = np.where(below < level, middle, low), np.where(below < level, high, middle)
        result: FloatArray = (low + high) / 2.0
        return result


def _cdf(distance: FloatArray, mean: FloatArray, scale: FloatArray, dof: FloatArray) -> FloatArray:
    """Student-t, elementwise; a scale of 0 is a certainty."""
    spread = np.where(scale > 0.0, scale, 1.0)
    result: FloatArray = np.where(
        scale > 0.0, stdtr(dof, (distance - mean) / spread), (distance >= mean).astype(float)
    )
    # an unknown spread is no certainty
    return np.where(np.isnan(scale), np.nan, result)
