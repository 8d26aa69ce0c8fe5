"""A hilly ground of any number of triangles, closed by a skirt and a floor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.benchmarks.peers.work import Solid

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import IntArray


def terrain(triangles: int, half_m: float, relief_m: float, top_m: float) -> Solid:
    """The same hills whatever the number of triangles.

    Args:
        triangles: about how many the surface has; skirt and floor add few.
        half_m: half the side of the square.
        relief_m: from the lowest to the highest place, about.
        top_m: height that no place exceeds; hills begin away from the middle.
    """
    side = max(int(np.sqrt(triangles / 2.0)) + 1, 4)
    line = np.linspace(-half_m, half_m, side)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    u, v = x / half_m, y / half_m
    waves = np.sin(7.0 * u + 1.0) * np.cos(5.0 * v) + 0.3 * np.sin(23.0 * u) * np.sin(19.0 * v + 2)
    z = top_m + relief_m * (0.5 * waves / 1.3 - 0.5)
    surface = np.column_stack([x, y, z])
    index = np.arange(side * side).reshape(side, side)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    )
    upper = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    rim = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    skirt, floor = _below(surface, rim, top_m - 2.0 * relief_m)
    vertices = np.concatenate([surface, floor])
    return Solid(vertices, np.concatenate([upper, skirt]).astype(np.int64))


def _below(surface: FloatArray, rim: IntArray, depth_m: float) -> tuple[IntArray, FloatArray]:
    """Faces of skirt and floor, and the vertices that they add; the rim goes counterclockwise."""
    count = len(surface)
    size = len(rim)
    ring = surface[rim].copy()
    ring[:, 2] = depth_m
    middle = np.array([[0.0, 0.0, depth_m]])
    here, there = np.arange(size), (np.arange(size) + 1) % size
    low, low_next = count + here, count + there
    walls = [
        np.column_stack([rim[there], rim[here], low]),
        np.column_stack([rim[there], low, low_next]),
    ]
    fan = np.column_stack([np.full(size, count + size), low_next, low])
    return np.concatenate([*walls, fan]), np.concatenate([ring, middle])
