"""Gaussian process over the newest occurrences of a category: the radial basis.

The same least squares from a prior as everywhere, in its dual form: one radial function sits
on each remembered start, so that the functions lie where this operator works and need no grid.
With starts scaled by the range that was worked in, and variances in units of the noise:

    k(y, y') = c + a exp(-|z - z'|² / 2L²)
    f̂(y) = k(y)ᵀ (K + W⁻¹)⁻¹ (x - x₀),   v(y) = k(y, y) - k(y)ᵀ (K + W⁻¹)⁻¹ k(y)

W holds the weights λ^age. K + W⁻¹ has no eigenvalue below 1, so it is never ill-conditioned.
A category remembers a bounded number of starts, so an update is bounded in time and memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from rampe_guard.core.experience import Experience
from rampe_guard.core.types import FloatArray

_CONSTANT_SHARE = 0.25
"""Share of the prior variance that is one offset for the whole category."""
_LENGTH = 0.25
"""L as a share of the range worked in, per square root of a dimension."""


@dataclass(frozen=True, slots=True)
class RadialFit:
    """Posterior of one category; valid for one version of it and of the scales.

    Attributes:
        version: of the experience and of the scales.
        starts: scaled starts (k, d).
        squares: their squared norms (k,).
        factor: Cholesky factor of K + W⁻¹ (k, k), lower.
        solved: (K + W⁻¹)⁻¹ [x, 1] (k, m + 1).
    """

    version: tuple[int, int]
    starts: FloatArray
    squares: FloatArray
    factor: FloatArray
    solved: FloatArray


class RadialKernel:
    """The kernel and the posterior that follows from it.

    Args:
        variance: prior variance c + a, in units of the noise.
    """

    def __init__(self, variance: float) -> None:
        self.variance = variance
        self._constant = _CONSTANT_SHARE * variance
        self._radial = variance - self._constant

    def fit(
        self, experience: Experience, inverse: FloatArray, version: tuple[int, int]
    ) -> RadialFit:
        """Posterior of a category whose starts are multiplied by ``inverse`` (d,)."""
        z = experience.starts * inverse
        squares = np.einsum("kd,kd->k", z, z)
        gram = self._kernel(squares[:, None] + squares - 2.0 * (z @ z.T), z.shape[1])
        gram.flat[:: len(z) + 1] += 1.0 / experience.trust
        factor, _ = dpotrf(gram, lower=1)
        targets = np.concatenate((experience.moves, np.ones((len(z), 1))), axis=1)
        solved, _ = dpotrs(factor, targets, lower=1)
        return RadialFit(version, z, squares, factor, solved)

    def predict(self, fit: RadialFit, z: FloatArray, usual: FloatArray) -> tuple[FloatArray, float]:
        """Deviation from ``usual`` (m,) at the scaled start z (d,), and its variance."""
        k = self.near(fit, z)
        projected = k @ fit.solved
        gain, _ = dpotrs(fit.factor, k, lower=1)
        return projected[:-1] - projected[-1] * usual, self.variance - float(k @ gain)

    def near(self, fit: RadialFit, z: FloatArray) -> FloatArray:
        """Kernel between z (d,) and the remembered starts (k,)."""
        return self._kernel(fit.squares + z @ z - 2.0 * (fit.starts @ z), len(z))

    def closeness(self, fit: RadialFit, z: FloatArray) -> FloatArray:
        """How near the remembered starts are to z, 1 at the same place and 0 far away (k,)."""
        return (self.near(fit, z) - self._constant) / self._radial

    def _kernel(self, squared: FloatArray, dimensions: int) -> FloatArray:
        # rounding may leave a distance of -1e-17: harmless below an exponential
        return self._constant + self._radial * np.exp(
            squared * (-0.5 / (_LENGTH * _LENGTH * dimensions))
        )
