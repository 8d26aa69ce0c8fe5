"""Parts of a triangle mesh, and whether each has an inside: edges only, no file, no FCL."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

LEAST_FILL = 1e-6
"""Share of its box that a closed part must fill to count as a solid."""


@dataclass(frozen=True, slots=True)
class Parts:
    """Parts of a mesh that share no vertex.

    Attributes:
        label: of each triangle, its part (f,).
        balanced: parts (p,) whose every edge is walked as often one way as the other.
        volume: signed volume of each part (p,) [m³]; it means something for balanced ones only.
        low, high: box of each part (p, 3) [m].
    """

    label: IntArray
    balanced: BoolArray
    volume: FloatArray
    low: FloatArray
    high: FloatArray

    @property
    def closed(self) -> BoolArray:
        """Parts with an inside (p,): balanced, and not a skin folded onto itself."""
        box = np.asarray(np.prod(self.high - self.low, axis=1))
        return np.asarray(self.balanced & (np.abs(self.volume) > LEAST_FILL * box))

    def __len__(self) -> int:
        return len(self.balanced)


def parts_of(vertices: FloatArray, faces: IntArray) -> Parts:
    """Find the parts of a mesh of vertices (v, 3) and triangles (f, 3), f >= 1."""
    label = part_labels(faces, len(vertices))
    count = int(label.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    order = np.argsort(label, kind="stable")
    starts = np.searchsorted(label[order], np.arange(count))
    for axis in range(3):
        along = vertices[:, axis][faces[order]]
        low[:, axis] = np.minimum.reduceat(along.min(axis=1), starts)
        high[:, axis] = np.maximum.reduceat(along.max(axis=1), starts)
    balanced = np.ones(count, dtype=bool)
    balanced[label[unbalanced(faces, len(vertices))]] = False
    # about the middle of each part, so that far from the origin nothing cancels
    middle = (0.5 * (low + high))[label]
    a, b, c = (vertices[faces[:, corner]] - middle for corner in range(3))
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = np.bincount(label, weights=six, minlength=count) / 6.0
    return Parts(label, balanced, volume, low, high)


def part_labels(faces: IntArray, vertex_count: int) -> IntArray:
    """Part of each triangle (f,), numbered in the order of their first triangles."""
    a, b = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(vertex_count, vertex_count))
    _, of_vertex = connected_components(graph, directed=False)
    _, first, label = np.unique(of_vertex[faces[:, 0]], return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[label])


def unbalanced(faces: IntArray, vertex_count: int) -> BoolArray:
    """Triangles (f,) on an edge that is not walked as often one way as the other."""
    key, forth = edges(faces, vertex_count)
    order = np.argsort(key)
    key = key[order]
    begins = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    surplus = np.add.reduceat(np.where(forth[order], 1, -1), begins)
    odd = np.repeat(surplus != 0, np.diff(np.append(begins, len(key))))
    result = np.zeros(len(faces), dtype=bool)
    result[order[odd] // 3] = True
    return result


def edges(faces: IntArray, vertex_count: int) -> tuple[IntArray, BoolArray]:
    """All edges (3f,), triangle by triangle: a number whichever way, and whether walked upwards."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    return np.minimum(tail, head) * vertex_count + np.maximum(tail, head), tail < head
