"""The paper's recursion begun from a prior: bases of finitely many functions.

For the actuators of one category that share a basis, with observations centred and scaled:

    P ← λP + hᵀh,   r ← λr + hᵀx           equation (4), and (3) in information form
    Θ̂ = (P₀ + P)⁻¹ (r + P₀Θ₀)

P₀ is the prior's precision, in units of the noise, and does not fade with λ: however long
ago the last occurrence was, the system stays well conditioned. Θ₀ says "as far as this
actuator usually goes, wherever it starts". With P₀ = 0 this is equations (2) to (4).
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
        basis: regressor of the scaled observation; its last entry is the constant 1.
        columns: which of the category's active actuators (k,).
        center: of the observations (d,).
        width: their scale (d,).
        prior: precision P₀, diagonal (p,).
        precision: P (p, p).
        moment: r (p, k).
    """

    basis: Regressor
    columns: Indices
    center: FloatArray
    width: FloatArray
    prior: FloatArray
    precision: FloatArray
    moment: FloatArray

    @staticmethod
    def begin(
        basis: Regressor,
        columns: Indices,
        center: FloatArray,
        width: FloatArray,
        weights: tuple[float, float],
    ) -> Ridge:
        """A recursion without data; ``weights`` are the prior's, of the constant and the rest."""
        p = basis.size
        prior = np.full(p, weights[1])
        prior[-1] = weights[0]
        moment = np.zeros((p, len(columns)))
        return Ridge(basis, columns, center, width, prior, np.zeros((p, p)), moment)

    def learn(self, y: FloatArray, move: FloatArray, forgetting: float) -> None:
        """Take the displacement ``move`` (m,) of the active actuators from y (d,)."""
        h = self.regressor(y)
        self.precision = forgetting * self.precision + h[:, None] * h
        self.moment = forgetting * self.moment + h[:, None] * move[self.columns]

    def discount(self, share: float) -> None:
        """Let what was learned count only ``share`` of what it did."""
        self.precision = share * self.precision
        self.moment = share * self.moment

    def predict(self, y: FloatArray, usual: FloatArray) -> tuple[FloatArray, float, float]:
        """Deviation from ``usual`` (k,), its variance, and the prior's; in units of the noise."""
        h = self.regressor(y)
        factor, _ = dpotrf(self.precision + np.diag(self.prior), lower=1)
        gain, _ = dpotrs(factor, h, lower=1)
        # the constant's column of P is Σ hᵀ: what the usual displacement explains
        deviation = gain @ (self.moment - self.precision[:, -1:] * usual)
        return deviation, float(h @ gain), float(h @ (h / self.prior))

    def regressor(self, y: FloatArray) -> FloatArray:
        """H's row h(y) (p,)."""
        return self.basis((y - self.center) / self.width)
