"""Ground of the demo quarry: uneven, with a trench ahead of the machine and a spoil heap.

World frame: the machine stands on z = 0 at the origin and looks along x. [m]
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from manifold3d import Manifold, Mesh
from parts import FloatArray, write_stl

IntArray = npt.NDArray[np.int64]

BOTTOM_M = -4.0
TRENCH_X, TRENCH_Y, TRENCH_DEPTH_M = (5.3, 8.6), (-1.1, 1.1), 1.5
HEAP_XY, HEAP_RADIUS_M, HEAP_HEIGHT_M = (2.7, 7.1), 2.0, 1.2
LINES_X = (-12, -10, -8, -6, -4.5, -3, -1.5, -0.5, 0.3, 1.0, 1.8, 2.6, 3.3, 4.1, 4.8, 5.1, 5.4, 5.9,
           6.4, 6.9, 7.4, 7.9, 8.4, 8.7, 9.0, 9.6, 10.4, 11.2, 12)  # fmt: skip
LINES_Y = (-12, -10.5, -9, -7.5, -6, -4.8, -3.6, -2.6, -1.8, -1.3, -1.0, -0.5, 0, 0.5, 1.0, 1.3,
           1.8, 2.6, 3.6, 4.6, 5.3, 6.0, 6.5, 7.0, 7.6, 8.3, 9.2, 10.5, 12)  # fmt: skip


def height(x: FloatArray, y: FloatArray) -> FloatArray:
    """Ground height over the world's z = 0; level where the tracks stand."""
    far = np.clip((np.hypot(x, y) - 3.2) / 4.0, 0.0, 1.0)
    rough = 0.10 * np.sin(0.9 * x + 0.4) * np.cos(0.7 * y) + 0.06 * np.sin(2.1 * x - 1.3 * y)
    heap = np.clip(1.0 - np.hypot(x - HEAP_XY[0], y - HEAP_XY[1]) / HEAP_RADIUS_M, 0.0, 1.0)
    inside = np.minimum(_ramp(x, *TRENCH_X), _ramp(y, *TRENCH_Y))
    level = -0.03 + far * (rough - 0.05)
    return level + HEAP_HEIGHT_M * heap - inside * (TRENCH_DEPTH_M + level)


def _ramp(value: FloatArray, low: float, high: float) -> FloatArray:
    """1 inside [low, high], 0 outside, sloped over 0.35 m."""
    return np.clip(np.minimum(value - low, high - value) / 0.35 + 0.5, 0.0, 1.0)


def terrain() -> Manifold:
    """Closed solid under the ground surface."""
    nx, ny = len(LINES_X), len(LINES_Y)
    x, y = (grid.ravel() for grid in np.meshgrid(LINES_X, LINES_Y, indexing="ij"))
    top = np.column_stack([x, y, height(x, y)])
    number = np.arange(nx * ny).reshape(nx, ny)
    edge = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    foot = top[edge] * (1.0, 1.0, 0.0) + (0.0, 0.0, BOTTOM_M)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    upper = np.concatenate([_triangles(a, b, c), _triangles(a, c, d)])
    low = nx * ny + np.arange(len(edge))
    after, low_after = np.roll(edge, -1), np.roll(low, -1)
    walls = np.concatenate([_triangles(edge, low, low_after), _triangles(edge, low_after, after)])
    centre = np.full(len(low), nx * ny + len(edge))
    floor = _triangles(low_after, low, centre)
    points = np.vstack([top, foot, [(0.0, 0.0, BOTTOM_M)]])
    faces = np.concatenate([upper, walls, floor])
    return Manifold(Mesh(points.astype(np.float32), faces.astype(np.uint32)))


def _triangles(*corners: IntArray) -> IntArray:
    return np.column_stack([corner.ravel() for corner in corners])


def build(folder: Path) -> int:
    """Write the mesh; return the number of triangles."""
    return write_stl(terrain(), folder / "yard_terrain.stl")
