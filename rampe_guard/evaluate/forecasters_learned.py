"""Forecasters from the shelf: nearest neighbours, Gaussian processes, another library's RLS.

All of them see positions and displacements in units of the range that the logs cover. That
range is known to them beforehand, which favours them a little over RAMPE: it has to scale by
the limits of the actuators.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.extra import missing
from rampe_guard.evaluate.segments import Segment, Start

try:
    from river.linear_model import BayesianLinearRegression
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
except ModuleNotFoundError as error:
    raise missing(error) from error

_LENGTH, _LENGTH_BOUNDS = 0.3, (0.05, 10.0)
_WHITE, _WHITE_BOUNDS = 0.5, (1e-3, 2.0)
_SIGNAL_BOUNDS = (1e-2, 10.0)
_FEWEST = 5
"""Occurrences below which three hyper-parameters cannot be told from noise."""
_JITTER = 1e-10
"""Added to the diagonal, as scikit-learn does."""
_NO_SCATTER = 10 * np.finfo(np.float64).eps
_GROWTH = 1.5
"""Hyper-parameters are sought anew when a category has grown by this factor."""


@dataclass(slots=True)
class _Past:
    """What a category did: starts and displacements, both in units of the range."""

    q: list[FloatArray] = field(default_factory=list)
    x: list[FloatArray] = field(default_factory=list)


class NearestNeighbours:
    """The mean of what the category did at its k nearest starts.

    Args:
        width: range of each actuator (n,) [unit].
        k: neighbours; all there are while these are fewer.
    """

    def __init__(self, width: FloatArray, k: int = 5) -> None:
        self._width = width
        self._k = k
        self._past: dict[Category, _Past] = {}

    def predict(self, start: Start) -> FloatArray | None:
        """Mean displacement of the nearest (n,) [unit]."""
        past = self._past.get(start.category)
        if past is None:
            return None
        distance = np.linalg.norm(np.array(past.q) - start.q / self._width, axis=1)
        nearest = np.argsort(distance, kind="stable")[: self._k]
        mean: FloatArray = np.array(past.x)[nearest].mean(axis=0)
        return mean * self._width

    def observe(self, segment: Segment) -> None:
        """Remember it."""
        past = self._past.setdefault(segment.start.category, _Past())
        past.q.append(segment.start.q / self._width)
        past.x.append(segment.displacement / self._width)


class GaussianProcess:
    """A Gaussian process of each category, constant times RBF plus white noise.

    Displacements are centred and scaled by the category's own mean and deviation.

    Args:
        width: range of each actuator (n,) [unit].
        optimise: seek the hyper-parameters by marginal likelihood, instead of the fixed ones.
    """

    def __init__(self, width: FloatArray, *, optimise: bool = False) -> None:
        self._width = width
        self._optimise = optimise
        self._past: dict[Category, _Past] = {}
        self._kernels: dict[Category, tuple[int, _Kernel]] = {}

    def predict(self, start: Start) -> FloatArray | None:
        """Mean of the process at the start (n,) [unit]."""
        past = self._past.get(start.category)
        if past is None:
            return None
        q, x = np.array(past.q), np.array(past.x)
        mean = _mean(self._kernel(start.category, q, x), q, x, start.q / self._width)
        return mean * self._width

    def observe(self, segment: Segment) -> None:
        """Remember it; the process is fitted when it is next asked."""
        past = self._past.setdefault(segment.start.category, _Past())
        past.q.append(segment.start.q / self._width)
        past.x.append(segment.displacement / self._width)

    def _kernel(self, category: Category, q: FloatArray, x: FloatArray) -> _Kernel:
        """The fixed hyper-parameters, or those found when the category was last sought anew."""
        sought, found = self._kernels.get(category, (0, _Kernel()))
        if self._optimise and len(q) >= max(_FEWEST, _GROWTH * sought):
            found = _sought(found, q, x)
            self._kernels[category] = (len(q), found)
        return found


@dataclass(frozen=True, slots=True)
class _Kernel:
    """Hyper-parameters: variance and length of the RBF, variance of the white noise."""

    signal: float = 1.0
    length: float = _LENGTH
    white: float = _WHITE


def _sought(start: _Kernel, q: FloatArray, x: FloatArray) -> _Kernel:
    """The hyper-parameters of the greatest marginal likelihood, by scikit-learn."""
    signal = ConstantKernel(start.signal, _SIGNAL_BOUNDS) * RBF(start.length, _LENGTH_BOUNDS)
    kernel = signal + WhiteKernel(start.white, _WHITE_BOUNDS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # at a bound is an answer, too
        fit = GaussianProcessRegressor(kernel, normalize_y=True).fit(q, x)
    found = fit.kernel_
    return _Kernel(
        float(found.k1.k1.constant_value),
        float(found.k1.k2.length_scale),
        float(found.k2.noise_level),
    )


def _mean(kernel: _Kernel, q: FloatArray, x: FloatArray, at: FloatArray) -> FloatArray:
    """Mean (n,) at a start of the process through starts q (m, n) and displacements x (m, n).

    What scikit-learn's regressor gives (a test holds them together), without its checks, which
    cost more than all the arithmetic.
    """
    middle, scale = x.mean(axis=0), x.std(axis=0)
    scale = np.where(scale < _NO_SCATTER, 1.0, scale)
    covariance = kernel.signal * np.exp(-0.5 * cdist(q, q, "sqeuclidean") / kernel.length**2)
    covariance[np.diag_indices(len(q))] += kernel.white + _JITTER
    weights = cho_solve(cho_factor(covariance, lower=True), (x - middle) / scale)
    near = kernel.signal * np.exp(-0.5 * ((q - at) ** 2).sum(axis=1) / kernel.length**2)
    mean: FloatArray = middle + scale * (near @ weights)
    return mean


class RiverLeastSquares:
    """River's Bayesian linear regression, an exact recursion, on (q, 1) of each category.

    One regression for each actuator, with that library's own prior: coefficients of unit
    variance about zero.

    Args:
        width: range of each actuator (n,) [unit].
        middle: middle of each actuator's range (n,) [unit].
    """

    def __init__(self, width: FloatArray, middle: FloatArray) -> None:
        self._width = width
        self._middle = middle
        self._models: dict[Category, list[BayesianLinearRegression]] = {}

    def predict(self, start: Start) -> FloatArray | None:
        """Mean of the posterior predictive (n,) [unit]."""
        models = self._models.get(start.category)
        if models is None:
            return None
        h = self._regressor(start)
        return np.array([m.predict_one(h) for m in models]) * self._width

    def observe(self, segment: Segment) -> None:
        """One step of the recursion."""
        start = segment.start
        if start.category not in self._models:
            self._models[start.category] = [BayesianLinearRegression() for _ in self._width]
        h = self._regressor(start)
        x = segment.displacement / self._width
        for model, value in zip(self._models[start.category], x.tolist(), strict=True):
            model.learn_one(h, value)

    def _regressor(self, start: Start) -> dict[str, float]:
        scaled = (start.q - self._middle) / (self._width / 2)
        h = {f"q{j}": value for j, value in enumerate(scaled.tolist())}
        return {**h, "one": 1.0}
