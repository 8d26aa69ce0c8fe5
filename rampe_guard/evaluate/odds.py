"""Reliability of probabilities: what was said against what came, with bootstrap intervals.

Answers that follow one another within seconds are about the same motion, so intervals come from
blocks of time (`points`), never from single answers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.points import Interval, draws, interval

BINS: Final = 10


@dataclass(frozen=True, slots=True)
class Bin:
    """Answers of one tenth of the probabilities.

    Attributes:
        said: mean probability.
        happened: share that came true.
        count: answers.
        spread: 95 % bootstrap interval of ``happened``.
    """

    said: float
    happened: float
    count: int
    spread: Interval | None


@dataclass(frozen=True, slots=True)
class Odds:
    """Reliability of m answers.

    Attributes:
        answers: m.
        error: expected calibration error: mean over the bins of the difference between what was
            said and what happened, weighted by answers; None without any.
        spread: its 95 % bootstrap interval.
        bins: those that have answers, in order.
    """

    answers: int
    error: float | None
    spread: Interval | None
    bins: tuple[Bin, ...]


def odds(said: FloatArray, came: npt.NDArray[np.bool_], block: npt.NDArray[np.int64]) -> Odds:
    """Hold probabilities against what came.

    Args:
        said: probabilities (m,).
        came: whether it came true (m,).
        block: block of time that each answer lies in (m,), counted from 0.
    """
    if not len(said):
        return Odds(0, None, None, ())
    bins = np.minimum((said * BINS).astype(np.int64), BINS - 1)
    blocks = int(block.max()) + 1
    cell = block * BINS + bins

    def table(weights: FloatArray | None) -> FloatArray:
        filled = np.bincount(cell, weights, blocks * BINS)
        return filled.reshape(blocks, BINS).astype(np.float64)

    count, total_said, total_came = table(None), table(said), table(came.astype(np.float64))
    weight = draws(blocks)
    drawn, drawn_came = weight @ count, weight @ total_came
    gap = np.abs(weight @ total_said - drawn_came).sum(axis=1)
    found = []
    for k in range(BINS):
        n = int(count[:, k].sum())
        if n:
            sums = (float(total_said[:, k].sum()), float(total_came[:, k].sum()))
            around = interval(drawn_came[:, k], drawn[:, k])
            found.append(Bin(sums[0] / n, sums[1] / n, n, around))
    error = float(np.abs(total_said.sum(axis=0) - total_came.sum(axis=0)).sum()) / len(said)
    return Odds(len(said), error, interval(gap, drawn.sum(axis=1)), tuple(found))
