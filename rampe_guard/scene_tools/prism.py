"""Outlines with holes → closed prisms; outlines that are a rectangle → boxes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rampe_guard.collision.mesh import TriangleMesh
from rampe_guard.collision.mesh_topology import IntArray
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    import shapely

GROWN_M: Final = 1e-3
"""Outlines are made larger by this, so that no rounding leaves a point of theirs outside [m]."""
_AREA: Final = 1e-6
_RIGHT: Final = 1e-6
_QUARTER: Final = 8
"""Sides of a quarter of a circle."""


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle: middle (2,) [m], edge lengths (2,) [m] and the turn of the first edge [rad]."""

    middle: FloatArray
    sides: FloatArray
    yaw: float


def polygon(rings: tuple[FloatArray, ...], where: str) -> Any:
    """A polygon of rings (n, 2) [m], the first of which is its outline, the others holes.

    Raises:
        GeometryError: it crosses itself, or encloses nothing.
    """
    shapely = _shapely(where)
    for ring in rings:
        if len(np.unique(ring, axis=0)) < 3:  # noqa: PLR2004 - a triangle at the least
            raise GeometryError(f"{where}: an outline of fewer than three corners")
    found = shapely.Polygon(rings[0], rings[1:])
    if not found.is_valid:
        raise GeometryError(
            f"{where}: the outline is not valid ({shapely.is_valid_reason(found)}); draw it so that"
            " it does not cross itself"
        )
    return _grown(found, where)


def band(line: FloatArray, width_m: float, where: str) -> Any:
    """All within half of ``width_m`` [m] of a line (n, 2) [m], or a little more.

    Raises:
        GeometryError: the line has no length.
    """
    shapely = _shapely(where)
    if len(np.unique(line, axis=0)) < 2:  # noqa: PLR2004
        raise GeometryError(f"{where}: a line of one point; give a Point with radius_m")
    # rounds are drawn with corners on the circle; so much larger they are outside of it
    radius = 0.5 * width_m / np.cos(np.pi / (4.0 * _QUARTER))
    return _grown(shapely.LineString(line).buffer(radius, quad_segs=_QUARTER), where)


def rectangle(outline: Any) -> Rectangle | None:
    """The rectangle that a polygon is; None if it is none."""
    corners = np.asarray(outline.exterior.coords)[:-1, :2]
    if outline.interiors or len(corners) != 4:  # noqa: PLR2004
        return None
    first, second = corners[1] - corners[0], corners[2] - corners[1]
    sides = np.array([np.linalg.norm(first), np.linalg.norm(second)])
    skew = corners[0] + corners[2] - corners[1] - corners[3]
    if np.abs(skew).max() > _RIGHT or abs(first @ second) > _RIGHT * sides.prod():
        return None
    return Rectangle(corners.mean(axis=0), sides, float(np.arctan2(first[1], first[0])))


def prism(outline: Any, low_m: float, high_m: float, where: str) -> TriangleMesh:
    """The closed prism of a polygon between two heights [m].

    Raises:
        GeometryError: the outline cannot be cut into triangles.
    """
    flat, triangles = _triangles(outline, where)
    count = len(flat)
    below = np.column_stack([flat, np.full(count, low_m)])
    above = np.column_stack([flat, np.full(count, high_m)])
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = np.sort(sides, axis=1) @ np.array([count, 1])
    _, where_first, number = np.unique(key, return_index=True, return_counts=True)
    a, b = sides[where_first[number == 1]].T  # edges of one triangle only: the rims
    walls = np.concatenate(
        [np.column_stack([a, b, b + count]), np.column_stack([a, b + count, a + count])]
    )
    faces = np.concatenate([triangles[:, ::-1], triangles + count, walls])
    mesh = TriangleMesh(np.concatenate([below, above]), faces.astype(np.int64)).compact()
    if not mesh.is_closed():
        raise GeometryError(f"{where}: its outline makes no closed solid; draw it simpler")
    return mesh


def _triangles(outline: Any, where: str) -> tuple[FloatArray, IntArray]:
    """Corners (n, 2) [m] and triangles (t, 3), counter-clockwise, that fill a polygon."""
    import mapbox_earcut  # noqa: PLC0415 - comes with shapely, for plans only

    rings = [np.asarray(r.coords)[:-1, :2] for r in (outline.exterior, *outline.interiors)]
    flat = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    triangles = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    a, b, c = (flat[triangles[:, corner]] for corner in range(3))
    u, v = b - a, c - a
    area = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    if not abs(np.abs(area).sum() - outline.area) <= _AREA * outline.area:
        raise GeometryError(f"{where}: its outline cannot be cut into triangles; draw it simpler")
    triangles[area < 0.0] = triangles[area < 0.0][:, ::-1]
    return flat, triangles


def _grown(found: shapely.Geometry, where: str) -> Any:
    grown = found.buffer(GROWN_M, join_style="mitre")
    if grown.geom_type != "Polygon" or not grown.is_valid or grown.is_empty:
        raise GeometryError(f"{where}: its outline makes no solid; draw it simpler")
    return grown


def _shapely(where: str) -> Any:
    try:
        import shapely  # noqa: PLC0415 - an extra
    except ImportError:
        raise GeometryError(
            f"{where}: plans need shapely: pip install 'rampe-guard[scene]'"
        ) from None
    return shapely
