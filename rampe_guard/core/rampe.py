"""RAMPE: per category Ω, learn the displacement x of a primitive from its start q[k].

Flow-chart blocks 5 to 19 (Fig. 4, Table I) are named where they happen. Two modes:

* ``faithful``: the paper. No estimate before ``n_init`` occurrences, then Θ̂ and P from the
  stacked first observations, then the recursion (2) to (4).
* ``bayesian`` (default): the same recursion begun from a Gaussian prior on Θ, with q centred
  and scaled by its range. The noise variance of each actuator is learned too
  (normal-inverse-gamma), so that a prediction is a Student-t per actuator:

      x ~ t(dof 2a, location hΘ̂, scale² = (b/a)·(1 + h P⁻¹ hᵀ))

  Begun before a first observation, it has no ill-conditioned start: where occurrences lie
  almost on a line, the prior decides what the data cannot.

Only categories that were seen cost memory.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rampe_guard.core.config import PriorConfig
from rampe_guard.core.rls import LeastSquares, from_batch, pseudo_inverse
from rampe_guard.core.types import Category, FloatArray

_PRIOR_SHAPE = 1.5
"""a₀: three degrees of freedom, the fewest with a finite variance (of a scaled t)."""


@dataclass(frozen=True, slots=True)
class DisplacementForecast:
    """Predictive distribution of x: Student-t per actuator.

    Attributes:
        mean: location (n,) [unit], never against the sign of Ω.
        scale: scale (n,) [unit]; nan in faithful mode, which knows no spread.
        dof: degrees of freedom (n,); nan in faithful mode.
        occurrences: primitives of this category seen so far.
    """

    mean: FloatArray
    scale: FloatArray
    dof: FloatArray
    occurrences: int


@dataclass(frozen=True, slots=True)
class CategoryMemory:
    """What is known of one category: the recursion, the noise (a, b (n,)) and a count.

    ``first_h`` and ``first_x`` hold the observations of the initialising phase (faithful).
    """

    fit: LeastSquares | None
    shape: float
    rate: FloatArray
    occurrences: int
    first_h: tuple[FloatArray, ...] = ()
    first_x: tuple[FloatArray, ...] = ()


class Rampe:
    """Recursive estimate of the next displacement, one model per category.

    Args:
        actuators: n.
        mode: "bayesian" or "faithful".
        n_init: occurrences of a category before its first estimate.
        tol: relative threshold of the pseudo-inverse.
        forgetting: λ in (0, 1].
        limits: (n, 2) [unit], scales q and bounds predictions; unlimited if None or infinite.
        prior: what is believed before the first occurrence (bayesian).
    """

    def __init__(
        self,
        actuators: int,
        mode: Literal["bayesian", "faithful"] = "bayesian",
        n_init: int = 3,
        tol: float = 1e-9,
        forgetting: float = 1.0,
        limits: FloatArray | None = None,
        prior: PriorConfig | None = None,
    ) -> None:
        if not 0.0 < forgetting <= 1.0:
            raise ValueError(f"forgetting is {forgetting}, must lie in (0, 1]")
        if limits is not None and limits.shape != (actuators, 2):
            raise ValueError(f"limits have shape {limits.shape}, need ({actuators}, 2)")
        self._n = actuators
        self._mode = mode
        self._n_init = n_init
        self._tol = tol
        self._forgetting = forgetting
        self._prior = prior or PriorConfig()
        bounds = np.tile([-np.inf, np.inf], (actuators, 1)) if limits is None else limits
        self._limits = bounds
        bounded = np.isfinite(bounds).all(axis=1)
        # an actuator without limits is a slew or a wheel: half a turn is its natural scale
        half = np.full(actuators, np.pi)
        half[bounded] = (bounds[bounded, 1] - bounds[bounded, 0]) / 2
        self._half = half
        self._center = np.zeros(actuators)
        self._center[bounded] = bounds[bounded].mean(axis=1)
        self._memory: dict[Category, CategoryMemory] = {}

    @property
    def categories(self) -> dict[Category, int]:
        """Occurrences per category seen."""
        return {c: m.occurrences for c, m in self._memory.items()}

    def predict(self, category: Category, q: FloatArray) -> DisplacementForecast | None:
        """Blocks 16 and 19: x̂ at the start q (n,) of a primitive; None before ``n_init``."""
        memory = self._memory.get(category)
        if memory is None or memory.occurrences < self._n_init or memory.fit is None:
            return None  # block 5: still initialising
        h = self._regressor(q)
        mean = memory.fit.predict(h)
        if self._mode == "faithful":
            unknown = np.full(self._n, np.nan)
            return DisplacementForecast(mean, unknown, unknown, memory.occurrences)
        spread = 1.0 + float(h @ pseudo_inverse(memory.fit.precision, self._tol) @ h)
        scale = np.sqrt(memory.rate / memory.shape * spread)
        dof = np.full(self._n, 2.0 * memory.shape)
        return DisplacementForecast(self._bound(category, q, mean), scale, dof, memory.occurrences)

    def observe(self, category: Category, q: FloatArray, x: FloatArray) -> None:
        """Blocks 6 to 15, 17 and 18: learn that the primitive from q (n,) went x (n,).

        Raises:
            ValueError: q or x have the wrong length or are not finite; nothing is learned.
        """
        if q.shape != (self._n,) or x.shape != (self._n,):
            raise ValueError(f"q and x have shapes {q.shape} and {x.shape}, need ({self._n},)")
        if not (np.isfinite(q).all() and np.isfinite(x).all()):
            raise ValueError(f"q={q} and x={x} must be finite")
        h = self._regressor(q)
        memory = self._memory.get(category) or self._begin(category)  # block 6
        if memory.fit is None:
            updated = self._initialise(memory, h, x)
        else:
            updated = self._recurse(memory, memory.fit, h, x)
        self._memory[category] = replace(updated, occurrences=memory.occurrences + 1)  # 17, 18

    def _begin(self, category: Category) -> CategoryMemory:
        if self._mode == "faithful":
            return CategoryMemory(None, np.nan, np.full(self._n, np.nan), 0)
        prior = self._prior
        theta = np.zeros((self._n + 1, self._n))
        theta[-1] = np.array(category) * prior.displacement * 2 * self._half
        weights = np.append(np.full(self._n, prior.slope_weight), prior.weight)
        variance = (prior.spread * 2 * self._half) ** 2
        fit = LeastSquares(theta, np.diag(weights))
        return CategoryMemory(fit, _PRIOR_SHAPE, _PRIOR_SHAPE * variance, 0)

    def _initialise(self, memory: CategoryMemory, h: FloatArray, x: FloatArray) -> CategoryMemory:
        first_h, first_x = (*memory.first_h, h), (*memory.first_x, x)  # blocks 7 and 8
        if len(first_h) < self._n_init:
            return replace(memory, first_h=first_h, first_x=first_x)
        weights = np.sqrt(self._forgetting ** np.arange(len(first_h) - 1, -1, -1.0))[:, None]
        fit = from_batch(weights * first_h, weights * first_x, self._tol)  # blocks 9 to 12
        return replace(memory, fit=fit, first_h=(), first_x=())

    def _recurse(
        self, memory: CategoryMemory, fit: LeastSquares, h: FloatArray, x: FloatArray
    ) -> CategoryMemory:
        lam = self._forgetting
        inverse = pseudo_inverse(lam * fit.precision, self._tol)
        surprise = (x - fit.predict(h)) ** 2 / (1.0 + float(h @ inverse @ h))
        return replace(
            memory,
            fit=fit.update(h, x, lam, self._tol),  # blocks 13 to 15
            shape=_PRIOR_SHAPE + lam * (memory.shape - _PRIOR_SHAPE) + 0.5,
            rate=lam * memory.rate + 0.5 * surprise,
        )

    def _regressor(self, q: FloatArray) -> FloatArray:
        if self._mode == "faithful":
            return np.append(q, 1.0)
        return np.append((q - self._center) / self._half, 1.0)

    def _bound(self, category: Category, q: FloatArray, mean: FloatArray) -> FloatArray:
        """Never against the sign of Ω, never past a limit, no drift of a static actuator."""
        sign = np.array(category, dtype=np.float64)
        room = np.where(sign > 0, self._limits[:, 1] - q, q - self._limits[:, 0])
        return sign * np.clip(sign * mean, 0.0, np.maximum(room, 0.0))
