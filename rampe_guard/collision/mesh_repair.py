"""What is mended in a mesh before anyone computes with it; each repair comes with a word.

Nothing here opens a closed mesh: a repair that would is left undone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rampe_guard.collision.mesh_topology import (
    BoolArray,
    IntArray,
    Parts,
    edges,
    parts_of,
    unbalanced,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from rampe_guard.core.types import FloatArray

NEEDLE = 1e-12
"""A triangle whose height is below this share of its coordinates is a line, or a point."""

Repaired = tuple["IntArray", list[str]]


def first_of_equal(rows: npt.NDArray[np.generic]) -> tuple[IntArray, IntArray]:
    """Equal rows found: the first of each kind (u,), in order, and the kind of each row (n,).

    Args:
        rows: (n, 3) of an 8-byte type, compared by their bits.
    """
    words = np.ascontiguousarray(rows).view(np.uint64)
    number = mixed(words)
    order = np.argsort(number, kind="stable")
    same, number = _same_as_before(words[order]), number[order]
    if ((number[1:] == number[:-1]) & ~same).any():  # different rows with one number
        order = np.lexsort(words.T)
        same = _same_as_before(words[order])
    begins = np.concatenate([[True], ~same])
    first = order[begins]
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    kind = np.empty(len(order), dtype=np.int64)
    kind[order] = rank[np.cumsum(begins) - 1]
    return np.sort(first), kind


def mixed(words: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """A number of each row (n, 3), another one for almost every other row."""
    number = words[:, 0] * np.uint64(0x9E3779B97F4A7C15)
    number ^= number >> np.uint64(29)
    number += words[:, 1] * np.uint64(0xBF58476D1CE4E5B9)
    number ^= number >> np.uint64(31)
    number += words[:, 2] * np.uint64(0x94D049BB133111EB)
    number ^= number >> np.uint64(32)
    return np.asarray(number)


def _same_as_before(rows: npt.NDArray[np.uint64]) -> BoolArray:
    same = rows[1:, 0] == rows[:-1, 0]
    for column in (1, 2):
        same &= rows[1:, column] == rows[:-1, column]
    return np.asarray(same)


def without_collapsed(faces: IntArray) -> Repaired:
    """Drop triangles that name a vertex twice. They bound nothing, and leave no gap."""
    a, b, c = faces.T
    fine = (a != b) & (b != c) & (c != a)
    if fine.all():
        return faces, []
    gone = len(faces) - int(fine.sum())
    return faces[fine], [f"{_count(gone)} with equal corners left out"]


def without_duplicates(faces: IntArray, vertex_count: int) -> Repaired:
    """Keep one of all triangles alike, and one each way of those back to back (a thin sheet)."""
    order = np.argsort(faces, axis=1)
    ordered = np.take_along_axis(faces, order, axis=1)
    first, kind = first_of_equal(ordered)
    if len(first) == len(faces):
        return faces, []
    # how often the order of the corners is turned to sort them says which way it faces
    turned = (order[:, 0] > order[:, 1]) ^ (order[:, 1] > order[:, 2])
    turned ^= order[:, 0] > order[:, 2]
    _, keep = np.unique(2 * kind + turned, return_index=True)
    keep.sort()
    if len(keep) == len(faces):
        return faces, []
    gone = len(faces) - len(keep)
    before, after = (unbalanced(some, vertex_count) for some in (faces, faces[keep]))
    if int(after.sum()) > int(before.sum()):
        return faces, [f"{_count(gone)} given twice kept: the surface closes only with them"]
    return faces[keep], [f"{_count(gone)} given twice left out"]


def without_needles(vertices: FloatArray, faces: IntArray) -> Repaired:
    """Drop triangles without area where the surface is no less closed without them."""
    thin = needles(vertices, faces)
    if not thin.any():
        return faces, []
    if thin.all():
        return faces[:0], []
    # a needle bridges a vertex on another's edge: without it that edge would stand open
    before, after = (unbalanced(some, len(vertices)) for some in (faces, faces[~thin]))
    if int(after.sum()) > int(before.sum()):
        return faces, [f"{_count(int(thin.sum()))} without area kept: they bridge open edges"]
    return faces[~thin], [f"{_count(int(thin.sum()))} without area left out"]


def needles(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Triangles (f,) whose height is lost in rounding."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.sqrt(np.max([((y - x) ** 2).sum(axis=1) for x, y in ((a, b), (b, c), (c, a))], 0))
    scale = np.max([np.abs(x).max(axis=1) for x in (a, b, c)], axis=0)
    return np.asarray(double_area <= NEEDLE * scale * longest)


def oriented(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, list[str], Parts]:
    """Turn triangles so that closed parts face outwards.

    Returns:
        The triangles, words, and the parts of the mesh.
    """
    words = []
    parts = parts_of(vertices, faces)
    if not parts.balanced.all():
        open_part = ~parts.balanced[parts.label]
        flip = np.zeros(len(faces), dtype=bool)
        flip[open_part] = _against_neighbours(faces[open_part], len(vertices))
        mended = parts_of(vertices, _turned(faces, flip))
        flip &= mended.balanced[parts.label]
        if flip.any():
            faces = _turned(faces, flip)
            parts = parts_of(vertices, faces)
            words.append(f"{_count(int(flip.sum()))} turned over to face as their neighbours do")
    inverted = parts.closed & (parts.volume < 0.0) & ~_within_another(parts)
    if inverted.any():
        faces = _turned(faces, inverted[parts.label])
        parts = parts_of(vertices, faces)
        part = "the surface" if len(parts) == 1 else f"{int(inverted.sum())} of {len(parts)} parts"
        words.append(f"{part} turned inside out to face outwards")
    return faces, words, parts


def _within_another(parts: Parts) -> BoolArray:
    """Parts whose box lies inside that of a part that faces outwards: cavities, if inverted."""
    result = np.zeros(len(parts), dtype=bool)
    hosts = np.flatnonzero(parts.closed & (parts.volume > 0.0))
    for part in np.flatnonzero(parts.closed & (parts.volume < 0.0)):
        holds = (parts.low[hosts] < parts.low[part]) & (parts.high[part] < parts.high[hosts])
        result[part] = bool(holds.all(axis=1).any())
    return result


def _against_neighbours(faces: IntArray, vertex_count: int) -> BoolArray:
    """Triangles (f,) to turn over so that neighbours face the same way, where that can be.

    Each triangle stands for two, itself and itself turned over; across an edge of two triangles
    each way round of the one goes with one way round of the other. A connected set of these is a
    choice for all its triangles; if a triangle is in one set both ways, no choice is right, and
    any will do.
    """
    key, forth = edges(faces, vertex_count)
    order = np.argsort(key, kind="stable")
    begins = np.flatnonzero(np.concatenate([[True], np.diff(key[order]) != 0]))
    pair = begins[np.diff(np.append(begins, len(key))) == 2]  # noqa: PLR2004
    one, other = order[pair], order[pair + 1]
    # neighbours that walk their edge the same way face differently
    differ = forth[one] == forth[other]
    count = len(faces)
    f, g = one // 3, other // 3
    rows = np.concatenate([f, f + count])
    columns = np.concatenate([np.where(differ, g + count, g), np.where(differ, g, g + count)])
    graph = coo_array(
        (np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * count, 2 * count)
    )
    _, label = connected_components(graph, directed=False)
    # of the two mirror choices the one that turns fewer triangles, or has the first as it is
    sets = int(label.max()) + 1
    _, first = np.unique(label, return_index=True)
    cost = np.bincount(label[count:], minlength=sets) * 2 * count + first
    return np.asarray(cost[label[count:]] < cost[label[:count]])


def _turned(faces: IntArray, flip: BoolArray) -> IntArray:
    return np.where(flip[:, None], faces[:, ::-1], faces)


def _count(triangles: int) -> str:
    return "1 triangle" if triangles == 1 else f"{triangles} triangles"
