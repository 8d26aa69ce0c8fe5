"""Parts of a mesh that are convex solids: their corners say all, no triangle is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.mesh_topology import IntArray, Parts

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

MOST_VERTICES = 256
"""Larger convex parts are cut up like any other: searching all corners would cost more."""
FLAT = 1e-9
"""A vertex may stand out of a face's plane by this share of the part's size."""


def convex_parts(vertices: FloatArray, faces: IntArray, parts: Parts) -> list[tuple[int, IntArray]]:
    """Parts that are exactly the hull of their vertices: part number and vertices (k,).

    A closed surface with every vertex on or below the plane of every face is the skin of a
    convex solid.
    """
    triangles = np.bincount(parts.label, minlength=len(parts))
    candidate = parts.closed & (triangles <= 2 * MOST_VERTICES - 4)
    order = np.argsort(parts.label, kind="stable")
    ends = np.cumsum(triangles)
    found = []
    for part in np.flatnonzero(candidate):
        own = faces[order[ends[part] - triangles[part] : ends[part]]]
        used = np.unique(own)
        # Euler: a triangulated ball, told before any plane is laid
        if len(own) == 2 * len(used) - 4 and _is_convex(vertices, own, used, parts.volume[part]):
            found.append((int(part), used))
    return found


def _is_convex(vertices: FloatArray, faces: IntArray, used: IntArray, volume: float) -> bool:
    points = vertices[used]
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a) * np.sign(volume)
    length = np.linalg.norm(normal, axis=1)
    size = float(np.ptp(points, axis=0).max())
    # a needle's plane says nothing; its corners are held against all the others
    plane = length > (FLAT * size) ** 2
    normal = normal[plane] / length[plane, None]
    above = normal @ points.T - np.einsum("ij,ij->i", normal, a[plane])[:, None]
    return bool(above.max() <= FLAT * size)
