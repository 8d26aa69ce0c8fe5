"""What each predictor said of every primitive before it was made (prequential).

First the estimate x̂[k] by equation (2), from the start q[k] and all earlier occurrences, then
the true x[k] is shown for the update (3), (4). Where a predictor says nothing, x̂ = 0, as in
the paper's test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_primitives import Primitives
from rampe_guard.evaluate.running_mean import MeanByCategory

N_INIT = 3
"""Occurrences of a category before the paper's first estimate."""

TOL = 1e-6
"""Threshold of the paper's pseudo-inverse."""

PredictorName: TypeAlias = Literal["faithful", "default", "running mean"]
PREDICTORS: tuple[PredictorName, ...] = ("faithful", "default", "running mean")
MODES: tuple[PredictorName, ...] = ("faithful", "default")
"""The two modes of RAMPE; the running mean is what they are measured against."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run: its primitives, and x̂ (K, n) [unit] of every predictor.

    ``two_futures`` marks the forecasts (K,) in which the default mode saw two ends, not one.
    """

    seed: int
    primitives: Primitives
    estimate: dict[PredictorName, FloatArray]
    two_futures: npt.NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def error(self, predictor: PredictorName) -> FloatArray:
        """E = x - x̂ (K, n) [unit]."""
        return self.primitives.displacement - self.estimate[predictor]

    @property
    def initialised(self) -> npt.NDArray[np.bool_]:
        """Occurrences after the first `N_INIT` of their category (K,)."""
        return self.primitives.occurrence > N_INIT


class _Predictor(Protocol):
    def estimate(self, category: Category, q: FloatArray) -> FloatArray: ...
    def learn(self, category: Category, q: FloatArray, x: FloatArray) -> None: ...


def judge(seed: int, primitives: Primitives, limits: FloatArray) -> Run:
    """Let every predictor go through the primitives of a run once, in order.

    Args:
        seed: of the run.
        primitives: K of them, n actuators.
        limits: end stops (n, 2) [unit], which the default mode knows.
    """
    n = limits.shape[0]
    default = _ByRampe(Rampe(n, limits=limits), n)
    made: dict[PredictorName, _Predictor] = {
        "faithful": _ByRampe(Rampe(n, mode="faithful", n_init=N_INIT, tol=TOL), n),
        "default": default,
        "running mean": _RunningMean(),
    }
    estimate = {name: _ask(p, primitives) for name, p in made.items()}
    return Run(seed, primitives, estimate, np.array(default.two_futures, dtype=bool))


def _ask(predictor: _Predictor, primitives: Primitives) -> FloatArray:
    said = np.zeros_like(primitives.displacement)
    rows: Sequence[tuple[Category, FloatArray, FloatArray]] = list(
        zip(primitives.category, primitives.start, primitives.displacement, strict=True)
    )
    for k, (category, q, x) in enumerate(rows):
        said[k] = predictor.estimate(category, q)
        predictor.learn(category, q, x)
    return said


class _ByRampe:
    def __init__(self, model: Rampe, n: int) -> None:
        self._model = model
        self._n = n
        self.two_futures: list[bool] = []

    def estimate(self, category: Category, q: FloatArray) -> FloatArray:
        forecast = self._model.predict(category, q)
        self.two_futures.append(forecast is not None and forecast.bimodal)
        return np.zeros(self._n) if forecast is None else forecast.mean

    def learn(self, category: Category, q: FloatArray, x: FloatArray) -> None:
        self._model.observe(category, q, x)


class _RunningMean:
    def __init__(self) -> None:
        self._means = MeanByCategory()

    def estimate(self, category: Category, q: FloatArray) -> FloatArray:
        mean = self._means.of(category)
        return np.zeros_like(q) if mean is None else mean

    def learn(self, category: Category, q: FloatArray, x: FloatArray) -> None:  # noqa: ARG002
        self._means.learn(category, x)
