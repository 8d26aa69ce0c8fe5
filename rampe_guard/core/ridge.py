"""The paper's recursion begun from a prior: bases of finitely many functions.

For the actuators of one category that share a basis, with observations counted from the middle
of what had been seen when the category began:

    P ← λP + hᵀh,   r ← λr + hᵀx           equation (4), and (3) in information form
    Θ̂ = (P₀ + P)⁻¹ (r + P₀Θ₀)

P₀ is the prior's precision, in units of the noise, and does not fade with λ: however long
ago the last occurrence was, the system stays well conditioned. It is the same for each
function of the *scaled* observation; the sums are kept unscaled, and solved in the scales that
hold now, so that it does not matter when these were learned. Θ₀ says "as far as this actuator
usually goes, wherever it starts". With P₀ = 0 this is equations (2) to (4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from rampe_guard.core.basis import Regressor
from rampe_guard.core.types import FloatArray, Indices


@dataclass(slots=True)
class Ridge:
    """Recursion of the actuators ``columns`` of one category.

    Attributes:
        basis: regressor of the observation; products of its entries, the last one the
            constant 1.
        columns: which of the category's active actuators (k,).
        weights: P₀ of each function of the scaled observation (p,).
        center: what observations are counted from (d,).
        precision: P (p, p).
        moment: r (p, k).
    """

    basis: Regressor
    columns: Indices
    weights: FloatArray
    center: FloatArray
    precision: FloatArray
    moment: FloatArray

    @staticmethod
    def begin(
        basis: Regressor, columns: Indices, center: FloatArray, constant: float, slope: float
    ) -> Ridge:
        """A recursion without data; ``constant`` and ``slope`` are the prior's weights."""
        p = basis.size
        weights = np.full(p, slope)
        weights[-1] = constant
        moment = np.zeros((p, len(columns)))
        return Ridge(basis, columns, weights, center, np.zeros((p, p)), moment)

    def learn(self, y: FloatArray, move: FloatArray, forgetting: float) -> None:
        """Take the displacement ``move`` (m,) of the active actuators from y (d,)."""
        h = self.basis(y - self.center)
        self.precision = forgetting * self.precision + h[:, None] * h
        self.moment = forgetting * self.moment + h[:, None] * move[self.columns]

    def discount(self, share: float) -> None:
        """Let what was learned count only ``share`` of what it did."""
        self.precision = share * self.precision
        self.moment = share * self.moment

    def predict(
        self, y: FloatArray, inverse: FloatArray, usual: FloatArray
    ) -> tuple[FloatArray, float, float]:
        """Estimate at y (d,), with scales 1 / ``inverse`` (d,).

        Returns:
            Deviation from ``usual`` (k,), its variance, and the prior's variance; variances
            in units of the noise.
        """
        # a product of scaled entries is the product of the entries times that of the factors
        factors = self.basis(inverse)
        h = factors * self.basis(y - self.center)
        scaled = factors[:, None] * self.precision * factors
        scaled.flat[:: len(h) + 1] += self.weights
        factor, _ = dpotrf(scaled, lower=1)
        gain, _ = dpotrs(factor, h, lower=1)
        # the constant's column of P is Σ hᵀ: what the usual displacement explains
        deviation = (gain * factors) @ (self.moment - self.precision[:, -1:] * usual)
        return deviation, float(h @ gain), float(h @ (h / self.weights))
