"""A mesh of a foreign file as a scene can hold it: closed, or said to be a mere surface."""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np

from rampe_guard.collision.mesh import ZONE_MOST_M, TriangleMesh, check_extent, checked_mesh
from rampe_guard.errors import GeometryError

IfOpen = Literal["refuse", "surface", "hull"]
_FLAT_M: Final = 1e-6
IF_OPEN: Final[tuple[IfOpen, ...]] = ("refuse", "surface", "hull")
LARGE_M: Final = 100.0
"""From here on it is said that the unit may be the millimetre [m]."""


def solid_mesh(
    mesh: TriangleMesh, name: str, if_open: IfOpen
) -> tuple[TriangleMesh, dict[str, Any], tuple[str, ...]]:
    """A mesh [m], the keys that its object needs, and sentences about it.

    Args:
        mesh: in metres.
        name: what errors and notes call it.
        if_open: what becomes of a mesh that has no inside.

    Raises:
        GeometryError: it is of no likely size, or open and that is refused.
    """
    size = np.ptp(mesh.vertices, axis=0)
    notes = list(check_extent(float(size.max()), name, ZONE_MOST_M))
    words = " x ".join(f"{side:.3g}" for side in size)
    if not notes and size.max() > LARGE_M:
        notes.append(f"{name}: is {words} m; if that is in millimetres, give --scale 0.001")
    if mesh.is_closed():
        notes.append(f"{name}: {len(mesh.faces)} triangles, closed, {words} m")
        return mesh, {}, tuple(notes)
    if if_open == "hull":
        mesh = hull(mesh, name)
        notes.append(f"{name}: not closed, so its convex hull stands for it, {words} m")
        return mesh, {}, tuple(notes)
    if if_open == "refuse":
        raise GeometryError(
            f"{name}: is not closed, so inside and outside cannot be told apart; close it, or say"
            " --if-open hull (its convex hull, larger and solid) or --if-open surface (its"
            " triangles only, such as a scanned terrain: what is behind them is free)"
        )
    notes.append(f"{name}: {len(mesh.faces)} triangles, a surface without an inside, {words} m")
    return mesh, {"open": True}, tuple(notes)


def hull(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """The convex hull of a mesh.

    Raises:
        GeometryError: it is flat.
    """
    import trimesh  # noqa: PLC0415 - half a second that most imports need not wait for
    from scipy.spatial import QhullError  # noqa: PLC0415

    try:
        round_it = trimesh.convex.convex_hull(mesh.vertices)
    except (QhullError, ValueError):
        raise GeometryError(f"{name}: is flat and has no convex hull; give a box") from None
    if np.ptp(round_it.vertices, axis=0).min() <= _FLAT_M:
        raise GeometryError(f"{name}: is flat and has no convex hull; give a box")
    vertices, faces = np.asarray(round_it.vertices), np.asarray(round_it.faces, dtype=np.int64)
    return checked_mesh(vertices, faces, name, most=ZONE_MOST_M)
