"""Shapes of few vertices that provably contain a set of points: hull, thinned hull, or box.

A hull comes as the vertices to keep and a radius: no given point is farther than the radius
from the hull of the vertices. That holds whatever Qhull or an eigenvector did: what was left out
is measured against a point of the hull that is written out, and rounding is paid for by the
radius.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from rampe_guard.collision.mesh_topology import IntArray

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

FEW = 40
"""So many vertices need no hull."""
MOST = 96
"""Hulls of more vertices are thinned out."""
KEPT = 64
"""Directions in which a thinned hull keeps its outermost vertex."""
_ADDED = (16, 16)
"""Vertices that are added to a thinned hull in one go after the other, where it misses most."""
_EXACT_REACH = 500
"""So many points are measured while vertices are being chosen; more only at the end."""
_FACETS = 4
"""Facets that are looked at for the nearest one."""
ROUNDING = 1e-13
"""Share of the largest coordinate that the arithmetic here may err by."""


def hull_points(points: FloatArray) -> tuple[IntArray, float]:
    """Which of some points (k, 3) span their hull, and the radius [m] that covers the others.

    Falls back to all points where they are too flat for Qhull, and few.
    """
    try:
        found = ConvexHull(points)
    except QhullError:
        return _flat_hull(points)
    kept = np.sort(found.vertices)
    rest = np.delete(np.arange(len(points)), kept)
    # Qhull drops vertices within its precision of a facet; those are measured like any other
    outside = np.zeros(len(rest), dtype=bool)
    for block in np.array_split(np.arange(len(found.equations)), 1 + len(rest) // 500):
        plane = found.equations[block]
        outside |= (points[rest] @ plane[:, :3].T + plane[:, 3] > 0.0).any(axis=1)
    reach = _reaches(points[rest[outside]], points[found.simplices], found.equations)
    return kept.astype(np.int64), float(reach.max(initial=0.0)) + ROUNDING * float(
        np.abs(points).max()
    )


def thinned(points: FloatArray) -> tuple[IntArray, float]:
    """At most MOST of the vertices (k, 3) of a hull, and the radius [m] that covers the others."""
    local = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(local, full_matrices=False)
    # outermost as seen after stretching the set to a round one, or a long one keeps only its ends
    whitened = local @ axes.T / np.maximum(spread, 1e-6 * spread[0])
    kept = np.unique(np.argmax(whitened @ _DIRECTIONS.T, axis=0))
    for more in (*_ADDED, 0):
        rest = np.delete(np.arange(len(points)), kept)
        try:
            found = ConvexHull(points[kept])
        except QhullError:
            return np.arange(len(points)), 0.0
        if more:
            facets = points[kept[found.simplices]]
            kept = np.union1d(kept, rest[_farthest(points[rest], facets, found.equations, more)])
    reach = _reaches(points[rest], points[kept[found.simplices]], found.equations)
    return kept, float(reach.max(initial=0.0)) + ROUNDING * float(np.abs(points).max())


def _farthest(points: FloatArray, triangles: FloatArray, planes: FloatArray, most: int) -> IntArray:
    """Of the points (k, 3) the farthest beyond each facet, and of those the ``most`` farthest."""
    beyond = points @ planes[:, :3].T + planes[:, 3]
    facet = np.argmax(beyond, axis=1)
    # beyond a sharp edge the planes say too little; of many points some will do
    near = len(points) <= _EXACT_REACH
    reach = _reaches(points, triangles, planes) if near else beyond.max(axis=1)
    order = np.argsort(-reach, kind="stable")
    _, first = np.unique(facet[order], return_index=True)
    return np.asarray(order[np.sort(first)[:most]])


def boxes(points: FloatArray, starts: IntArray) -> FloatArray:
    """Corners (n, 8, 3) of a box round each run of points (k, 3): upright or along its axes.

    Args:
        points: of all runs, one after the other [m].
        starts: where each run begins (n,).
    """
    count = np.diff(np.append(starts, len(points)))
    low, high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    run = np.repeat(np.arange(len(starts)), count)
    axes = principal_axes(points, starts)
    local = np.einsum("kc,kca->ka", points, axes[run])
    low_p, high_p = np.minimum.reduceat(local, starts), np.maximum.reduceat(local, starts)
    # by volume, flat ones by area: the first sides are compared with a grain of thickness
    grain = 1e-3 * (high - low).max(axis=1, keepdims=True)
    upright = np.prod(high - low + grain, axis=1) <= np.prod(high_p - low_p + grain, axis=1)
    axes = np.where(upright[:, None, None], np.eye(3), axes)
    low, high = np.where(upright[:, None], low, low_p), np.where(upright[:, None], high, high_p)
    pad = ROUNDING * 10.0 * np.maximum(np.abs(low), np.abs(high)).max(axis=1)[:, None]
    sides = np.stack([low - pad, high + pad], axis=1)
    corners = np.stack([sides[:, _CORNERS[:, axis], axis] for axis in range(3)], axis=2)
    return np.asarray(np.einsum("nka,nca->nkc", corners, axes))


def principal_axes(points: FloatArray, starts: IntArray) -> FloatArray:
    """Principal axes of each run of points as columns (n, 3, 3), the thinnest first."""
    count = np.diff(np.append(starts, len(points)))
    mean = np.add.reduceat(points, starts) / count[:, None]
    local = points - np.repeat(mean, count, axis=0)
    spread = np.empty((len(starts), 3, 3))
    for i in range(3):
        for j in range(i, 3):
            spread[:, i, j] = np.add.reduceat(local[:, i] * local[:, j], starts)
            spread[:, j, i] = spread[:, i, j]
    return np.asarray(np.linalg.eigh(spread)[1])


def _flat_hull(points: FloatArray) -> tuple[IntArray, float]:
    """The hull of points in or near a plane, or on a line."""
    if len(points) <= FEW:
        return np.arange(len(points)), 0.0
    local = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(local, full_matrices=False)
    flat = local @ axes[:2].T
    try:
        kept = ConvexHull(flat).vertices  # in their order round the polygon
    except QhullError:  # a line: its two ends
        kept = np.array([np.argmin(flat[:, 0]), np.argmax(flat[:, 0])])
    fan = [[kept[0], kept[i], kept[min(i + 1, len(kept) - 1)]] for i in range(1, len(kept))]
    rest = np.delete(np.arange(len(points)), kept)
    radius = _reach(points[rest], points[np.array(fan)])
    return kept.astype(np.int64), radius + ROUNDING * float(np.abs(points).max())


def _reach(points: FloatArray, triangles: FloatArray) -> float:
    """Farthest of some points (k, 3) from the hull of some triangles (t, 3, 3), at most [m]."""
    facets = np.tile(np.arange(len(triangles)), (len(points), 1))
    return float(_to_facets(points, triangles, facets).min(axis=1, initial=np.inf).max(initial=0.0))


def _reaches(points: FloatArray, triangles: FloatArray, planes: FloatArray) -> FloatArray:
    """At most how far each point (k, 3) is from a hull (k,) [m].

    Only the facets are looked at whose planes (t, 4) the point is farthest beyond: another one
    may be nearer, so the answer may be too large, never too small.
    """
    beyond = points @ planes[:, :3].T + planes[:, 3]
    count = min(_FACETS, len(triangles))
    facets = np.argpartition(-beyond, count - 1, axis=1)[:, :count]
    return np.asarray(_to_facets(points, triangles, facets).min(axis=1))


def _to_facets(points: FloatArray, triangles: FloatArray, facets: IntArray) -> FloatArray:
    """Distances (k, m) of points (k, 3) to the triangles that ``facets`` (k, m) names [m].

    Never too small: each is measured to a point that is written as a mixture of three corners.
    """
    a = triangles[facets, 0]
    ab, ac = triangles[facets, 1] - a, triangles[facets, 2] - a
    offset = points[:, None] - a
    v, w = _nearest_weights(offset, ab, ac)
    gap = offset - (v[..., None] * ab + w[..., None] * ac)
    return np.asarray(np.sqrt(np.einsum("kti,kti->kt", gap, gap)))


def _nearest_weights(
    offset: FloatArray, ab: FloatArray, ac: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weights (k, t) of two edges that lead from a corner to about the nearest point.

    Args:
        offset: from a corner of a triangle to a point (k, t, 3).
        ab: edge from that corner (k, t, 3).
        ac: the other edge from it (k, t, 3).
    """
    bb, cc, bc = (_dot(x, y) for x, y in ((ab, ab), (ac, ac), (ab, ac)))
    pb, pc = _dot(offset, ab), _dot(offset, ac)
    tiny = np.finfo(float).tiny
    area = bb * cc - bc * bc
    solid = area > 1e-12 * bb * cc
    area = np.where(solid, area, 1.0)
    v, w = (cc * pb - bc * pc) / area, (bb * pc - bc * pb) / area
    inside = solid & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    # else the nearest point is on one of the edges
    on_b = np.clip(pb / np.maximum(bb, tiny), 0.0, 1.0)
    on_c = np.clip(pc / np.maximum(cc, tiny), 0.0, 1.0)
    length = np.maximum(bb + cc - 2.0 * bc, tiny)
    along = np.clip((pc - pb + bb - bc) / length, 0.0, 1.0)
    choices = [(on_b, 0.0 * on_b), (0.0 * on_c, on_c), (1.0 - along, along)]
    best_v, best_w, least = v, w, np.where(inside, -np.inf, np.inf)
    for x, y in choices:
        # squared distance less that of the corner: enough to compare
        value = x * x * bb + y * y * cc + 2.0 * x * y * bc - 2.0 * (x * pb + y * pc)
        better = value < least
        best_v, best_w = np.where(better, x, best_v), np.where(better, y, best_w)
        least = np.where(better, value, least)
    return best_v, best_w


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("kti,kti->kt", a, b))


def _even_directions(count: int) -> FloatArray:
    """Unit vectors spread evenly (count, 3), by the golden angle."""
    k = np.arange(count) + 0.5
    height = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - height * height)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])


_DIRECTIONS = _even_directions(KEPT)
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
