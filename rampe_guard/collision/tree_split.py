"""Divide many items top-down in two and two again, all nodes of a level at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rampe_guard.collision.mesh_topology import BoolArray, IntArray

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

LEAF = 8
"""Most items of a leaf."""
LEAST_SHARE = 0.2
"""A half with a smaller share of a node's items is refused: the tree would be too deep."""
CHOSEN_LEVELS = 6
"""Levels on which the cut is chosen with care, where it pays most."""
CHOSEN_ITEMS = 24
"""Nodes of fewer items are cut by rule."""

Choose: TypeAlias = Callable[[IntArray], "BoolArray | None"]
"""Of some items (k,), which go right; None to leave it to the rule."""
Progress: TypeAlias = Callable[[str, float], None]
"""Is told what is being done and which share of it is done."""


@dataclass(frozen=True, slots=True)
class Division:
    """A binary tree over items, level by level from the root, node 0.

    Attributes:
        order: all items (n,); those of node i are ``order[first[i] : last[i]]``.
        first, last: (N,).
        left, right: children (N,), -1 for leaves.
        levels: number of the first node of each level, and N at the end.
    """

    order: IntArray
    first: IntArray
    last: IntArray
    left: IntArray
    right: IntArray
    levels: tuple[int, ...]


def divide(points: FloatArray, lone: BoolArray, choose: Choose) -> Division:
    """Divide items until a leaf holds at most LEAF of them, or a single lone one.

    Args:
        points: where the items are (n, 3) [m].
        lone: items that must be a leaf each (n,).
        choose: picks the cuts of the upper levels.
    """
    order = np.arange(len(points))
    first, last = [np.zeros(1, dtype=np.int64)], [np.full(1, len(points))]
    left: list[IntArray] = []
    levels = [0, 1]
    for depth in range(len(points)):
        begin, end = first[-1], last[-1]
        inner = end - begin > LEAF
        if lone.any():
            before = np.concatenate([[0], np.cumsum(lone[order])])
            inner |= (end - begin > 1) & (before[end] > before[begin])
        children = np.full(len(begin), -1)
        children[inner] = levels[-1] + 2 * np.arange(inner.sum())
        left.append(children)
        if not inner.any():
            break
        begin, end = begin[inner], end[inner]
        middle = _part(order, points, begin, end, choose if depth < CHOSEN_LEVELS else None)
        first.append(np.column_stack([begin, middle]).ravel())
        last.append(np.column_stack([middle, end]).ravel())
        levels.append(levels[-1] + len(first[-1]))
    lefts = np.concatenate(left)
    rights = np.where(lefts < 0, -1, lefts + 1)
    return Division(
        order, np.concatenate(first), np.concatenate(last), lefts, rights, tuple(levels)
    )


def spans(begin: IntArray, end: IntArray) -> tuple[IntArray, IntArray]:
    """The numbers of several ranges one after the other, and where each range starts there."""
    count = end - begin
    starts = np.cumsum(count) - count
    return np.arange(count.sum()) + np.repeat(begin - starts, count), starts


def _part(
    order: IntArray, points: FloatArray, begin: IntArray, end: IntArray, choose: Choose | None
) -> IntArray:
    """Sort the items of each range of ``order``, in place, into left and right; where right begins.

    The rule: at the middle of the longest side of the box of the range's points; at their median
    if that leaves too few on one side.
    """
    rows, starts = spans(begin, end)
    count = end - begin
    node = np.repeat(np.arange(len(begin)), count)
    items = order[rows]
    place = points[items]
    low = np.minimum.reduceat(place, starts)
    high = np.maximum.reduceat(place, starts)
    axis = np.argmax(high - low, axis=1)
    key = np.take_along_axis(place, axis[node][:, None], axis=1)[:, 0]
    cut = np.take_along_axis(0.5 * (low + high), axis[:, None], axis=1)[:, 0]
    right: BoolArray = np.asarray(key > cut[node])
    chosen = np.zeros(len(begin), dtype=bool)
    if choose is not None:
        for i in np.flatnonzero(count >= CHOSEN_ITEMS):
            span = slice(starts[i], starts[i] + count[i])
            side = choose(items[span])
            if side is not None:
                right[span], chosen[i] = side, True
    most = np.add.reduceat(right, starts, dtype=np.int64)
    uneven = ~chosen & (np.minimum(most, count - most) < LEAST_SHARE * count)
    if uneven.any():
        some = np.flatnonzero(uneven[node])
        ranked = some[np.lexsort((key[some], node[some]))]
        # both lists run node by node: the k-th of a node by key, k counted from its first
        rank = np.empty(len(rows), dtype=np.int64)
        rank[ranked] = some - starts[node[some]]
        right[some] = (2 * rank >= count[node])[some]
    toward = np.cumsum(right)
    toward = toward - np.repeat(toward[starts] - right[starts], count)
    rights: IntArray = toward[starts + count - 1]
    within = np.arange(len(rows)) - starts[node]
    target = np.where(right, (count - rights)[node] + toward - 1, within - toward)
    order[rows[starts[node] + target]] = items
    return np.asarray(begin + count - rights)
