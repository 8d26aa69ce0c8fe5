"""Two futures from one (q, Ω): the limits of the method (Fig. 2) made visible.

Paths that are tangent where they part cannot be told apart by start and category: the mean
lies between two ends that the operator goes to, and is where he never stops. Among the
occurrences that began near here, the displacements of one actuator are split in two at the
place that leaves the least scatter, of the actuator that this suits best. They are two
futures, and not one wide one, if that takes away nearly all scatter (an even spread would
keep a quarter of it) and each side has a fair share of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.types import FloatArray

_NEAR = 0.5
"""Closeness from which an occurrence began "here"."""
_LEAST = 8
_NO_SCATTER = 1e-300
_LEAST_SIDE = 3
_LEAST_SHARE = 0.25
_LEFT_SCATTER = 0.08
_LEAST_GAP = 0.5
"""Two ends closer than this share of the usual displacement are one."""


@dataclass(frozen=True, slots=True)
class TwoFutures:
    """The two ends (2, m) [unit], likelier first, their shares (2,), and their scatter (m,)."""

    ends: FloatArray
    shares: FloatArray
    scatter: FloatArray


def two_futures(moves: FloatArray, closeness: FloatArray, usual: FloatArray) -> TwoFutures | None:
    """Look for two futures.

    Args:
        moves: displacements of a category's occurrences (k, m) [unit].
        closeness: how near each began to here, 0 to 1 (k,).
        usual: usual displacement (m,) [unit].
    """
    near = closeness > _NEAR
    count = int(np.count_nonzero(near))
    if count < _LEAST:
        return None
    here = moves[near]
    centred = np.sort(here - here.mean(axis=0), axis=0)
    total = np.maximum((centred * centred).sum(axis=0), _NO_SCATTER)
    left = np.arange(1.0, count)
    sums = np.cumsum(centred, axis=0)[:-1]
    # share of the scatter within both sides, for every place of the split (k - 1, m)
    within = 1.0 - sums * sums * (count / (left * (count - left)))[:, None] / total
    fair = max(_LEAST_SIDE, math.ceil(_LEAST_SHARE * count))
    within = within[fair - 1 : count - fair]
    cut, column = np.unravel_index(np.argmin(within), within.shape)
    if not within[cut, column] <= _LEFT_SCATTER:
        return None
    order = np.argsort(here[:, column])
    size = int(cut) + fair
    low, high = here[order[:size]], here[order[size:]]
    ends = np.stack((low.mean(axis=0), high.mean(axis=0)))
    if float(np.max(np.abs(ends[1] - ends[0]) / usual)) < _LEAST_GAP:
        return None
    shares = np.array([len(low), len(high)]) / count
    scatter = np.sqrt((shares[:, None] * np.stack((low.var(axis=0), high.var(axis=0)))).sum(axis=0))
    first = [0, 1] if shares[0] >= shares[1] else [1, 0]
    return TwoFutures(ends[first], shares[first], scatter)
