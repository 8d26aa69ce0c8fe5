"""Weighted recursive least squares, equations (2) to (5) of the paper.

The model of a category is x = H(y) Θ (n,), H block-diagonal with the row regressor h_j(y)
(p_j,) of actuator j, Θ stacked (Σp_j,), and noise of covariance R(Ω) (n, n) (5):

    (2)  x̂ = H Θ̂
    (4)  P ← λ P + Hᵀ G H                    G = R⁻¹
    (3)  Θ̂ ← Θ̂ + P⁻¹ Hᵀ G (x - H Θ̂)

P⁻¹ is a pseudo-inverse by SVD: singular values below ``tol`` times the largest count as
zero, so each update ends in a fixed number of steps whatever the data.

**Units.** With D = diag(√R_jj) and R = D C D, (3) and (4) are solved in units of each
actuator's own noise: D P D has the blocks (C⁻¹)_ij Σ λ^age h_iᵀ h_j. ``tol`` acts on that
matrix. Degrees beside metres in x then cut nothing, and where singular values are exactly
zero the minimum-norm solution is the same in both units, since D only scales whole blocks.
The sums Σ λ^age h_iᵀ h_j do not contain R, so a new R applies to the past as well.

**Three ways to the same result**, chosen for speed:

* Actuators that R does not couple (connected components of its pattern) are systems of their
  own, each with its own largest singular value. Hence a diagonal R never matters to Θ̂.
* Where all actuators of a system have one regressor h, P = C⁻¹ ⊗ S with S = Σ λ^age hᵀh
  (``Shared``). Its singular values are all products of one of C⁻¹ and one of S, so S alone is
  decomposed; R cancels from the gain, and matters only to which products ``tol`` cuts.
  Systems with the same regressor share one S. Else P is ``Stacked`` in full.
* Where no singular value is cut, P⁺ = P⁻¹ and Cholesky gives it. None is cut if
  1/κ₂(P) > tol. LAPACK's ``dpocon`` estimates 1/κ₁, and κ₂ ≤ κ₁ for a symmetric P, so
  1/κ₁ > tol suffices. Its estimate of ‖P⁻¹‖₁ is a lower bound, hence rcond may be too
  large: by a factor below 3 as a rule, 10 at worst in practice. So rcond > 10 tol is asked
  for; what lies between is left to the SVD, which gives the same where nothing is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import lapack

from rampe_guard.core.noise import Weighting
from rampe_guard.core.types import FloatArray, Indices

_EPS = float(np.finfo(np.float64).eps)
_ESTIMATE_SLACK = 10.0
"""How far LAPACK's estimate of 1/κ₁ may lie above the true one."""


def cholesky_if_uncut(p: FloatArray, tol: float) -> FloatArray | None:
    """Cholesky factor of the symmetric P (p, p) if surely no singular value is cut."""
    # P is symmetric: its transpose is the same in the order that LAPACK wants
    factor, failed = lapack.dpotrf(p.T, 0, 0)
    if failed:
        return None
    norm = lapack.dlange("1", p.T)  # type: ignore[call-arg]  # the stub knows no arguments
    rcond, _ = lapack.dpocon(factor, norm)
    return factor if rcond > _ESTIMATE_SLACK * tol else None


def solve(p: FloatArray, b: FloatArray, tol: float) -> FloatArray:
    """P⁺ b for a symmetric positive semidefinite P (p, p) and b (p,) or (p, k)."""
    tol = _at_least_rounding(tol, len(p))
    factor = cholesky_if_uncut(p, tol)
    if factor is not None:
        solution: FloatArray = lapack.dpotrs(factor, b)[0]
        return solution
    # of a symmetric positive semidefinite matrix this is the SVD
    s, v = np.linalg.eigh(p)
    kept = s > tol * s[-1]
    v = v[:, kept]
    least: FloatArray = v @ ((v.T @ b).T / s[kept]).T
    return least


def _at_least_rounding(tol: float, size: int) -> float:
    """Singular values of the size of rounding errors mean nothing, even with tol = 0."""
    return max(tol, size * _EPS)


@dataclass(frozen=True, slots=True)
class Shared:
    """State of a system in which one regressor h (p,) serves all n actuators.

    Attributes:
        theta: Θ̂ (n, p), one actuator a row [unit].
        moment: S = Σ λ^age hᵀh (p, p).
    """

    theta: FloatArray
    moment: FloatArray

    @staticmethod
    def start(h: FloatArray, x: FloatArray, w: Weighting, tol: float) -> Shared:
        """Blocks 10 to 12: SVD of W₀H₀, Σ r = Uᵀ W₀ x_init, Θ̂ = V r, P = H₀ᵀG₀H₀.

        Args:
            h: regressors (N, p), each row times √λ^age.
            x: displacements (N, n), likewise.
            w: the noise.
            tol: relative size below which singular values of P count as zero.
        """
        # W₀ = (√values Eᵀ D⁻¹) ⊗ I, so the SVD of W₀H₀ is that of h times the √values
        u, s, vt = np.linalg.svd(h, full_matrices=False)
        s = np.maximum(s, np.finfo(np.float64).tiny)  # division of what is cut below
        kept = _uncut(w, s * s, _at_least_rounding(tol, h.shape[1]))
        r = _where_uncut(x.T @ u, kept, w) / s
        theta = r @ vt
        return Shared(np.ascontiguousarray(theta), np.ascontiguousarray(h.T @ h))

    def predict(self, h: FloatArray) -> FloatArray:
        """Equation (2): x̂ (n,)."""
        return self.theta @ h

    def update(
        self, h: FloatArray, x: FloatArray, w: Weighting, forgetting: float, tol: float
    ) -> Shared:
        """Blocks 13 to 15, equations (4) and (3): take x (n,) at h (p,)."""
        moment = forgetting * self.moment + h[:, None] * h
        error = x - self.theta @ h
        tol = _at_least_rounding(tol, len(h))
        factor = cholesky_if_uncut(moment, tol / w.least)
        if factor is not None:
            # (C⁻¹ ⊗ S)⁻¹ (C⁻¹ e ⊗ h) = e ⊗ S⁻¹h
            gain = lapack.dpotrs(factor, h)[0]
            return Shared(self.theta + error[:, None] * gain, moment)
        s, v = np.linalg.eigh(moment)
        kept = _uncut(w, s, tol)
        along = (v.T @ h) / np.where(kept.any(axis=0), s, 1.0)
        step = _where_uncut(error[:, None] * along, kept, w)
        return Shared(self.theta + step @ v.T, moment)

    def reweighted(self, w: Weighting, tol: float) -> Shared:
        """Of the same observations under another R: the same, for R cancels."""
        del w, tol
        return self

    def spread(self, h: FloatArray, w: Weighting, tol: float) -> FloatArray:
        """Covariance H P⁻¹ Hᵀ (n, n) of the estimate at h (p,)."""
        tol = _at_least_rounding(tol, len(h))
        factor = cholesky_if_uncut(self.moment, tol / w.least)
        if factor is not None:
            return float(h @ lapack.dpotrs(factor, h)[0]) * w.covariance
        s, v = np.linalg.eigh(self.moment)
        kept = _uncut(w, s, tol)
        along = (v.T @ h) ** 2 / np.where(kept.any(axis=0), s, 1.0)
        root = w.deviation[:, None] * w.vectors
        spread: FloatArray = (root * ((kept @ along) / w.values)) @ root.T
        return spread

    def precision(self, w: Weighting) -> FloatArray:
        """P (np, np) in the units of equation (4)."""
        g = w.inverse / w.deviation[:, None] / w.deviation
        return np.asarray(np.kron(g, self.moment), dtype=np.float64)


def _uncut(w: Weighting, s: FloatArray, tol: float) -> npt.NDArray[np.bool_]:
    """Which products of eigenvalues of C⁻¹ and singular values s (p,) of S count: (n, p)."""
    uncut: npt.NDArray[np.bool_] = w.relative[:, None] * s > tol * s.max()
    return uncut


def _where_uncut(a: FloatArray, kept: npt.NDArray[np.bool_], w: Weighting) -> FloatArray:
    """Columns of a (n, p) [unit], of each that part which lies in the directions kept (n, p)."""
    whole = kept * a
    # where R decides what is kept, each direction is a mixture of actuators
    split = kept.any(axis=0) & ~kept.all(axis=0)
    if split.any():
        mixed = w.vectors.T @ (a[:, split] / w.deviation[:, None])
        whole[:, split] = w.deviation[:, None] * (w.vectors @ (kept[:, split] * mixed))
    return whole


@dataclass(frozen=True, slots=True)
class Stacked:
    """State of a system whose actuators have regressors of different structure.

    Attributes:
        theta: Θ̂ stacked (Σp_j,) [unit].
        moment: Σ λ^age hᵀh (Σp_j, Σp_j), h all regressors in a row.
        cross: Σ λ^age hᵀx (Σp_j, n), for a change of R.
        owner: which actuator each parameter belongs to (Σp_j,).
    """

    theta: FloatArray
    moment: FloatArray
    cross: FloatArray
    owner: Indices

    @staticmethod
    def start(h: FloatArray, x: FloatArray, owner: Indices, w: Weighting, tol: float) -> Stacked:
        """Blocks 10 to 12: SVD of W₀H₀, Σ r = Uᵀ W₀ x_init, Θ̂ = V r, P = H₀ᵀG₀H₀.

        Args:
            h: regressors of all actuators in a row (N, Σp_j), each row times √λ^age.
            x: displacements (N, n), likewise.
            owner: see the class.
            w: the noise.
            tol: relative size below which singular values of P count as zero.
        """
        root = np.sqrt(w.values)[:, None] * w.vectors.T  # rootᵀ root = C⁻¹
        whitened = (root[:, None, owner] * h).reshape(-1, len(owner))  # W₀H₀ (nN, Σp_j)
        u, s, vt = np.linalg.svd(whitened, full_matrices=False)
        kept = s * s > _at_least_rounding(tol, len(owner)) * s[0] * s[0]
        r = (u[:, kept].T @ (root @ (x / w.deviation).T).ravel()) / s[kept]
        theta = w.deviation[owner] * (vt[kept].T @ r)
        return Stacked(theta, np.ascontiguousarray(h.T @ h), np.ascontiguousarray(h.T @ x), owner)

    def predict(self, h: FloatArray) -> FloatArray:
        """Equation (2): x̂ (n,) for all regressors in a row (Σp_j,)."""
        return np.asarray(np.bincount(self.owner, h * self.theta), dtype=np.float64)

    def update(
        self, h: FloatArray, x: FloatArray, w: Weighting, forgetting: float, tol: float
    ) -> Stacked:
        """Blocks 13 to 15, equations (4) and (3): take x (n,) at h (Σp_j,)."""
        moment = forgetting * self.moment + h[:, None] * h
        cross = forgetting * self.cross + h[:, None] * x
        error = (x - self.predict(h)) / w.deviation
        push = h * (w.inverse @ error)[self.owner]
        step = solve(self._scaled(moment, w), push, tol)
        return Stacked(self.theta + w.deviation[self.owner] * step, moment, cross, self.owner)

    def reweighted(self, w: Weighting, tol: float) -> Stacked:
        """The least-squares solution of the same observations under another R.

        Θ̂ goes on by P⁺ (Σ HᵀGx - P Θ̂), zero where R did not change.
        """
        scaled = self._scaled(self.moment, w)
        pull = (w.inverse[self.owner] * (self.cross / w.deviation)).sum(axis=1)
        deviation = w.deviation[self.owner]
        step = solve(scaled, pull - scaled @ (self.theta / deviation), tol)
        return Stacked(self.theta + deviation * step, self.moment, self.cross, self.owner)

    def spread(self, h: FloatArray, w: Weighting, tol: float) -> FloatArray:
        """Covariance H P⁻¹ Hᵀ (n, n) of the estimate at h (Σp_j,)."""
        scaled = self._scaled(self.moment, w)
        rows = np.where(self.owner == np.arange(len(w.deviation))[:, None], h, 0.0)
        rows *= w.deviation[:, None]
        spread: FloatArray = rows @ solve(scaled, rows.T, tol)
        return spread

    def precision(self, w: Weighting) -> FloatArray:
        """P (Σp_j, Σp_j) in the units of equation (4)."""
        deviation = w.deviation[self.owner]
        return self._scaled(self.moment, w) / deviation[:, None] / deviation

    def _scaled(self, moment: FloatArray, w: Weighting) -> FloatArray:
        """D P D (Σp_j, Σp_j)."""
        return w.inverse[self.owner[:, None], self.owner] * moment
