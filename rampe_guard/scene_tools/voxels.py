"""Points → the voxels that hold them → few boxes that hold exactly these voxels.

A voxel is a cube of the grid that has a corner at the origin; it is named by one number, so that
sorting, counting and merging are numpy's.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray

Index = npt.NDArray[np.int64]

_BITS: Final = 21
MOST: Final = 2 ** (_BITS - 1) - 2
"""Voxels from the origin along each axis: room for a neighbour on either side is left."""
_HALF: Final = 2 ** (_BITS - 1)
_MASK: Final = 2**_BITS - 1


@dataclass(frozen=True, slots=True)
class Voxels:
    """Occupied voxels.

    Attributes:
        side_m: of a voxel [m].
        keys: (v,), sorted, each once.
        counts: points in each (v,).
    """

    side_m: float
    keys: Index
    counts: Index

    @property
    def index(self) -> Index:
        """Where each is on the grid (v, 3)."""
        return unpack(self.keys)


def pack(index: Index) -> Index:
    """The numbers of voxels (n, 3) within MOST of the origin (n,)."""
    x, y, z = (index[:, axis] + _HALF for axis in range(3))
    return np.asarray((z << 2 * _BITS) | (y << _BITS) | x)


def unpack(keys: Index) -> Index:
    """The other way round."""
    parts = [keys & _MASK, (keys >> _BITS) & _MASK, keys >> 2 * _BITS]
    return np.stack(parts, axis=1) - _HALF


def gather(pieces: Iterable[FloatArray], side_m: float) -> Voxels:
    """The voxels that hold the points of all pieces (n, 3) [m].

    Raises:
        ValueError: a point lies too far away for voxels so small.
    """
    keys, counts = np.empty(0, np.int64), np.empty(0, np.int64)
    for points in pieces:
        index = np.floor(points / side_m)
        if len(index) and not np.abs(index).max() <= MOST:
            raise ValueError("too far")
        fresh, number = np.unique(pack(index.astype(np.int64)), return_counts=True)
        keys, counts = _added(np.append(keys, fresh), np.append(counts, number))
    return Voxels(side_m, keys, counts)


def coarser(voxels: Voxels, factor: int) -> Voxels:
    """Voxels ``factor`` times as large, which hold all of these."""
    keys, counts = _added(pack(voxels.index // factor), voxels.counts)
    return Voxels(voxels.side_m * factor, keys, counts)


def alone(voxels: Voxels, fewer_than: int) -> npt.NDArray[np.bool_]:
    """Which hold fewer points than that, and touch no other occupied voxel (v,)."""
    found = voxels.counts < fewer_than
    where = np.flatnonzero(found)
    index = voxels.index[where]
    for step in itertools.product((-1, 0, 1), repeat=3):
        if any(step):
            near = pack(index + np.array(step))
            at = np.minimum(np.searchsorted(voxels.keys, near), len(voxels.keys) - 1)
            found[where[voxels.keys[at] == near]] = False
    return found


def boxes(voxels: Voxels) -> Index:
    """Boxes (b, 2, 3) of voxel indices, first and last + 1, that hold these voxels and no other.

    Neighbours along one axis become rods, equal rods plates, equal plates boxes; of the six orders
    of axes the one that leaves the fewest is taken.
    """
    index = voxels.index
    cells = np.stack([index, index + 1], axis=1)
    found = cells
    for order in itertools.permutations(range(3)):
        merged = cells
        for axis in order:
            merged = _merged(merged, axis)
        if len(merged) < len(found) or found is cells:
            found = merged
    return found


def _merged(parts: Index, axis: int) -> Index:
    """Boxes that touch along ``axis``, and are equal across it, as one."""
    across = [a for a in range(3) if a != axis]
    ends = [parts[:, end, a] for a in across for end in (0, 1)]
    order = np.lexsort([parts[:, 0, axis], *ends])
    parts = parts[order]
    same = np.ones(len(parts) - 1, dtype=bool)
    for a in across:
        same &= (parts[1:, :, a] == parts[:-1, :, a]).all(axis=1)
    same &= parts[1:, 0, axis] == parts[:-1, 1, axis]
    first = np.flatnonzero(np.append(True, ~same)) if len(parts) else np.empty(0, np.int64)
    last = np.append(first[1:] - 1, len(parts) - 1)
    result = parts[first].copy()
    result[:, 1, axis] = parts[last, 1, axis]
    return np.asarray(result)


def _added(keys: Index, counts: Index) -> tuple[Index, Index]:
    """Equal keys once, with the sum of their counts."""
    if not len(keys):
        return keys, counts
    order = np.argsort(keys, kind="stable")
    keys, counts = keys[order], counts[order]
    first = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    return keys[first], np.add.reduceat(counts, first)
