"""Weighted recursive least squares, equations (2) to (4) of the paper.

One regressor row h(y) (p,) serves all n actuators of a category (the paper's affine test
does so too), hence Θ is (p, n) and P (p, p) is shared: with block-diagonal H and diagonal
R the paper's stacked recursion falls apart into exactly these columns, and R cancels from Θ̂.

    (2)  x̂ = h Θ̂
    (4)  P ← λ P + hᵀh
    (3)  Θ̂ ← Θ̂ + P⁻¹ hᵀ (x - h Θ̂)

P⁻¹ is a pseudo-inverse by SVD: singular values below ``tol`` times the largest count as
zero, so each update ends in a fixed number of steps whatever the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rampe_guard.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class LeastSquares:
    """State of the recursion: Θ̂ (p, n) and P (p, p)."""

    theta: FloatArray
    precision: FloatArray

    def predict(self, h: FloatArray) -> FloatArray:
        """Equation (2): x̂ (n,) for the regressor h (p,)."""
        return h @ self.theta

    def update(self, h: FloatArray, x: FloatArray, forgetting: float, tol: float) -> LeastSquares:
        """Equations (4) and (3): take the observation x (n,) at h (p,)."""
        precision = forgetting * self.precision + np.outer(h, h)
        gain = pseudo_inverse(precision, tol) @ h
        theta = self.theta + np.outer(gain, x - h @ self.theta)
        return LeastSquares(theta, precision)


def from_batch(h: FloatArray, x: FloatArray, tol: float) -> LeastSquares:
    """Flow-chart blocks 10 to 12: Θ̂ and P from the first observations, by SVD.

    Args:
        h: regressors (N, p).
        x: displacements (N, n).
        tol: relative size below which singular values count as zero.
    """
    u, s, vt = np.linalg.svd(h, full_matrices=False)
    # tol acts on P = HᵀH, whose singular values are the squares
    keep = s * s > tol * (s[0] * s[0] if s.size else 0.0)
    theta = vt[keep].T @ ((u[:, keep].T @ x) / s[keep, None])
    return LeastSquares(theta, h.T @ h)


def pseudo_inverse(p: FloatArray, tol: float) -> FloatArray:
    """Pseudo-inverse of the symmetric (p, p) matrix by SVD, relative threshold ``tol``."""
    u, s, vt = np.linalg.svd(p, hermitian=True)
    inverse = np.zeros_like(s)
    keep = s > tol * s[0]
    inverse[keep] = 1.0 / s[keep]
    result: FloatArray = (vt.T * inverse) @ u.T
    return result
