"""Positions that stand still to the last digit while a lever is moved: frozen, not measured.

A sensor that hangs, or a machine that is switched off, goes on saying its last position. Whoever
takes that for motion, or for rest, measures a deadband that is none, and noise that is too small.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray

_ANSWER_S = 1.0
"""A machine may take so long to answer its lever; only then it should have moved [s]."""
_PUSHED = 0.5
"""A lever that is pushed so much further out is beyond any deadband [-]."""

Stretch = tuple[int, int]
"""First and last of some samples."""


def frozen(
    time_s: FloatArray, position: FloatArray, lever_s: FloatArray, axes: FloatArray, gap_s: float
) -> list[Stretch]:
    """Where no position changed, though a lever was pushed long enough before the end of it.

    To let a lever go is no reason to move: so it stays after it ran against an end stop.

    Args:
        time_s: of the positions (l,), rising [s].
        position: (l, n) [unit].
        lever_s: of the levers (k,), rising [s].
        axes: (k, m) [-].
        gap_s: silence for longer is no standing still.
    """
    if not (len(time_s) and axes.size):
        return []
    same = (np.diff(position, axis=0) == 0.0).all(axis=1) & (np.diff(time_s) <= gap_s)
    found = []
    for first, last in runs(same):
        answered_s = time_s[last] - _ANSWER_S
        if answered_s <= time_s[first]:
            continue
        begin = max(0, int(np.searchsorted(lever_s, time_s[first], side="right")) - 1)
        end = int(np.searchsorted(lever_s, answered_s, side="right"))
        size = np.abs(axes[begin:end])
        if len(size) and (size - np.minimum.accumulate(size, axis=0)).max() > _PUSHED:
            found.append((first, last))
    return found


def within(stretches: list[Stretch], count: int) -> npt.NDArray[np.bool_]:
    """Whether each of ``count`` samples is in one of them."""
    mask = np.zeros(count, dtype=bool)
    for first, last in stretches:
        mask[first : last + 1] = True
    return mask


def runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches [first, end) in which ``mask`` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
