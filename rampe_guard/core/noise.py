"""R(Ω), the covariance of the displacements about their model: given or learned.

Equation (5) weighs actuators against each other by G = R⁻¹. Learned, R comes from the errors
of estimates made before their displacement was known. Such an error has the covariance
R + HP⁻¹Hᵀ. Brought to the covariance R by ẽ = T e, T (R + HP⁻¹Hᵀ) Tᵀ = R, the errors give

    R = (c R₀ + Σ λ^age ẽẽᵀ) / (c + Σ λ^age),     c = 1 occurrence

with R₀ diagonal: a tenth of the root mean square displacement of the first occurrences, so
that it has each actuator's units and R stays positive definite. Nothing is known of how
errors hang together until errors were made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from rampe_guard.core.types import FloatArray, Indices

_EPS = float(np.finfo(np.float64).eps)
_SYMMETRY = 1e-9
"""Largest difference of R_ij and R_ji [√(R_ii R_jj)] that counts as rounding."""
_PRIOR_WEIGHT = 1.0
"""Occurrences c that R₀ is worth."""
_PRIOR_SHARE = 0.1
"""√R₀_jj as a share of the root mean square displacement."""
_STILL = 1e-6
"""Least share of the largest displacement that an actuator that stood still counts with."""
_DECOUPLING = 1e-6
"""Share by which learned correlations are lowered: bounds their condition number."""


@dataclass(frozen=True, slots=True)
class Weighting:
    """G = R⁻¹ of equation (5), taken apart: R = D C D.

    Attributes:
        covariance: R (n, n).
        deviation: diagonal of D (n,) [unit].
        inverse: C⁻¹ (n, n), C the correlation.
        values: eigenvalues of C⁻¹ (n,).
        vectors: its eigenvectors (n, n), one a column.
        relative: each eigenvalue as a share of the largest of its component (n,).
        least: the smallest of them.
        components: actuators that R couples, directly or through others.
    """

    covariance: FloatArray
    deviation: FloatArray
    inverse: FloatArray
    values: FloatArray
    vectors: FloatArray
    relative: FloatArray
    least: float
    components: tuple[Indices, ...]

    def restricted(self, actuators: Indices) -> Weighting:
        """The same for ``actuators`` only, a union of components."""
        if len(actuators) == len(self.deviation):
            return self
        return weighting(self.covariance[np.ix_(actuators, actuators)])


def weighting(covariance: FloatArray, *, coupled: bool = False) -> Weighting:
    """Take R (n, n) apart.

    Args:
        covariance: R, symmetric and positive definite.
        coupled: treat all actuators as one component, whatever R's pattern.

    Raises:
        ValueError: R is not square, finite, symmetric or positive definite.
    """
    r = np.asarray(covariance, dtype=np.float64)
    if r.ndim != 2 or r.shape[0] != r.shape[1]:  # noqa: PLR2004 - a matrix
        raise ValueError(f"R has shape {r.shape}, must be square")
    n = len(r)
    variance = r.diagonal()
    if not (np.isfinite(r).all() and (variance > 0.0).all()):
        raise ValueError(f"R must be finite with a positive diagonal, is {r.tolist()}")
    deviation = np.sqrt(variance)
    correlation = r / deviation[:, None] / deviation
    if np.abs(correlation - correlation.T).max(initial=0.0) > _SYMMETRY:
        raise ValueError(f"R must be symmetric, is {r.tolist()}")
    correlation = (correlation + correlation.T) / 2
    np.fill_diagonal(correlation, 1.0)
    groups = (np.arange(n),) if coupled else _components(correlation)
    values, relative, vectors = np.ones(n), np.ones(n), np.eye(n)
    for group in groups:
        if len(group) == 1:
            continue
        block = np.ix_(group, group)
        c, vectors[block] = np.linalg.eigh(correlation[block])
        if c[0] <= n * _EPS * c[-1]:
            raise ValueError(f"R must be positive definite, is {r.tolist()}")
        values[group], relative[group] = 1.0 / c, c[0] / c
    inverse = (vectors * values) @ vectors.T
    return Weighting(
        r, deviation, inverse, values, vectors, relative, float(relative.min()), groups
    )


def _components(correlation: FloatArray) -> tuple[Indices, ...]:
    count, label = connected_components(correlation != 0.0, directed=False)
    return tuple(np.flatnonzero(label == i) for i in range(count))


@dataclass(slots=True)
class LearnedNoise:
    """R(Ω) of one category from its errors; see the module.

    Attributes:
        prior: diagonal of R₀ (n,) [unit²].
        scatter: Σ λ^age ẽẽᵀ (n, n) [unit²].
        weight: Σ λ^age.
    """

    prior: FloatArray
    scatter: FloatArray
    weight: float

    @staticmethod
    def begin(x: FloatArray) -> LearnedNoise:
        """R₀ from the first displacements (N, n)."""
        size = np.sqrt(np.mean(np.square(x), axis=0))
        largest = float(size.max())
        size = np.maximum(size, _STILL * largest) if largest > 0.0 else np.ones(x.shape[1])
        n = x.shape[1]
        return LearnedNoise(np.square(_PRIOR_SHARE * size), np.zeros((n, n)), 0.0)

    def learn(self, error: FloatArray, spread: FloatArray, w: Weighting, forgetting: float) -> None:
        """Take the error x - x̂ (n,) of an estimate.

        Args:
            error: [unit].
            spread: covariance HP⁻¹Hᵀ (n, n) of the estimate itself [unit²].
            w: the noise so far, taken apart.
            forgetting: λ.
        """
        root = np.sqrt(w.values)[:, None] * w.vectors.T / w.deviation  # rootᵀ root = R⁻¹
        a, u = np.linalg.eigh(root @ spread @ root.T)
        whitened = u @ ((u.T @ (root @ error)) / np.sqrt(1.0 + np.maximum(a, 0.0)))
        pure = w.deviation * (w.vectors @ (whitened / np.sqrt(w.values)))
        self.scatter = forgetting * self.scatter + pure[:, None] * pure
        self.weight = forgetting * self.weight + 1.0

    def covariance(self) -> FloatArray:
        """R (n, n), positive definite."""
        total = np.diag(_PRIOR_WEIGHT * self.prior) + self.scatter
        r: FloatArray = (1.0 - _DECOUPLING) * total
        np.fill_diagonal(r, total.diagonal())
        return r / (_PRIOR_WEIGHT + self.weight)
