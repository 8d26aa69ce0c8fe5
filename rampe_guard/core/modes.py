"""Two futures from one (q, Ω): the limits of the method (Fig. 2) made visible.

Paths that are tangent where they part cannot be told apart by start and category: the mean
lies between two ends that the operator goes to, and is where he never stops. Among the
occurrences that began near here, the displacements are split in two along their principal
axis, at the place that leaves the least scatter. They are two futures, and not one wide one,
if that takes away nearly all scatter (an even spread would keep a quarter of it) and each
side has a fair share of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rampe_guard.core.types import FloatArray

_NEAR = 0.5
"""Closeness from which an occurrence began "here"."""
_LEAST = 8
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
    scaled = (here - here.mean(axis=0)) / usual
    axis = np.linalg.svd(scaled, full_matrices=False)[2][0] if scaled.shape[1] > 1 else np.ones(1)
    along = scaled @ axis
    order = np.argsort(along)
    ranked = along[order]
    total = float(ranked @ ranked)
    left = np.arange(1, count)
    sums = np.cumsum(ranked)[:-1]
    # scatter within both sides for every place of the split; the mean of all is 0
    within = total - sums * sums / left - sums * sums / (count - left)
    side = np.minimum(left, count - left)
    allowed = side >= max(_LEAST_SIDE, _LEAST_SHARE * count)
    within = np.where(allowed, within, np.inf)
    cut = int(np.argmin(within))
    if not within[cut] <= _LEFT_SCATTER * total:
        return None
    low, high = here[order[: cut + 1]], here[order[cut + 1 :]]
    ends = np.stack((low.mean(axis=0), high.mean(axis=0)))
    if float(np.max(np.abs(ends[1] - ends[0]) / usual)) < _LEAST_GAP:
        return None
    shares = np.array([len(low), len(high)]) / count
    scatter = np.sqrt((shares[:, None] * np.stack((low.var(axis=0), high.var(axis=0)))).sum(axis=0))
    first = [0, 1] if shares[0] >= shares[1] else [1, 0]
    return TwoFutures(ends[first], shares[first], scatter)
