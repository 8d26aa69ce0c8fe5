"""Runs of the paper's experiment with outcomes made to order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_estimates import PREDICTORS, Run
from rampe_guard.evaluate.paper_primitives import Primitives
from rampe_guard.evaluate.paper_report import Experiment

SPAN = np.array([64.4, 0.35])


def made_primitives(category: Sequence[Category], start: FloatArray, x: FloatArray) -> Primitives:
    """Primitives of one second each, in this order."""
    seen: Counter[Category] = Counter()
    occurrence = []
    for c in category:
        seen[c] += 1
        occurrence.append(seen[c])
    time_s = np.arange(float(len(category)))
    k = np.array(occurrence, dtype=np.int64)
    return Primitives(tuple(category), k, time_s, time_s + 1.0, start, x)


def made_run(
    category: Sequence[Category],
    start: FloatArray,
    x: FloatArray,
    said: FloatArray | None = None,
    seed: int = 1,
) -> Run:
    """A run in which every predictor said ``said`` (0 if None)."""
    estimate = np.zeros_like(x) if said is None else said
    primitives = made_primitives(category, start, x)
    return Run(seed, primitives, {p: estimate.copy() for p in PREDICTORS})


def made_experiment(cycles: int = 23) -> Experiment:
    """The experiment as the command describes it."""
    return Experiment(
        cycles=cycles,
        actuators=("swing", "boom"),
        units=("deg", "m"),
        span=SPAN,
        targets={"A": (64.4, 2.79), "B": (22.7, 2.95), "C": (0.0, 2.79), "D": (0.0, 2.60)},
        way=("A", "B", "C", "D", "C", "B", "A"),
        minutes=6.0,
        corrections=3,
    )


def two_blobs(
    rng: np.random.Generator, count: int
) -> tuple[list[Category], FloatArray, FloatArray]:
    """Category (0, +) alternating between two places, each with a displacement of its own."""
    at = np.arange(count) % 2 == 1
    start = np.where(at[:, None], [0.0, 2.60], [22.7, 2.93]) + rng.normal(
        0.0, [1.0, 0.005], (count, 2)
    )
    x = np.where(at[:, None], [0.0, 0.19], [0.0, 0.02]) + rng.normal(0.0, [0.1, 0.004], (count, 2))
    return [(0, 1)] * count, start, x
