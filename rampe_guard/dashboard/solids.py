"""Keep-out objects as triangles to draw: the body, and round it the shell of its margin.

Only for the eye: the guard sweeps the shapes themselves, never these. A shell is left out
where growing the shape is not simple (meshes, halfspaces).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from rampe_guard.collision.mesh import IntArray, load_mesh
from rampe_guard.core.scene import (
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    KeepOut,
    Mesh,
    SceneObject,
    Sphere,
)
from rampe_guard.core.types import FloatArray, Point

_SIDES = 32


@dataclass(frozen=True, slots=True)
class Triangles:
    """Vertices (v, 3) [m] and faces (f, 3)."""

    vertices: FloatArray
    faces: IntArray


@dataclass(frozen=True, slots=True)
class Solid:
    """One keep-out object to draw, in the world, or in its own frame if it moves.

    Attributes:
        name: of the zone.
        body: the object.
        shell: its margin round it, or None.
        top: where its label stands [m].
        flat: a wide floor or wall, drawn so that the arm stands out before it.
        moves: it is placed by messages.
    """

    name: str
    body: Triangles
    shell: Triangles | None
    top: Point
    flat: bool
    moves: bool


def solids(objects: tuple[SceneObject, ...], reach_m: float) -> tuple[Solid, ...]:
    """All objects of a scene that have a body, in its order.

    Args:
        objects: of the scene; actuator limits have no body.
        reach_m: how far the arm can reach: an endless halfspace is drawn as far [m].

    Raises:
        GeometryError: a mesh file cannot be used.
    """
    return tuple(_solid(o, reach_m) for o in objects if not isinstance(o, ActuatorLimit))


def _solid(item: KeepOut, reach_m: float) -> Solid:
    body = _grown(item, 0.0, reach_m)
    assert body is not None  # noqa: S101 - every kind has a body
    shell = _grown(item, item.margin_m, reach_m) if item.margin_m > 0.0 else None
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    middle = 0.5 * (low + high)
    return Solid(
        name=item.name,
        body=body,
        shell=shell,
        top=(float(middle[0]), float(middle[1]), float(high[2])),
        flat=isinstance(item, (Mesh, Halfspace)),
        moves=item.key is not None,
    )


def _grown(  # noqa: PLR0911 - one return for each kind
    item: KeepOut, by_m: float, reach_m: float
) -> Triangles | None:
    """The shape, grown by a distance; None where that is not simple."""
    match item:
        case Box():
            size = np.asarray(item.size_m) + 2.0 * by_m
            return _placed(trimesh.creation.box(size), item.pose)
        case Sphere():
            ball = trimesh.creation.icosphere(3, item.radius_m + by_m)
            return _moved(ball, np.asarray(item.center_m))
        case Cylinder():
            radius, height = item.radius_m + by_m, item.height_m + 2.0 * by_m
            return _placed(trimesh.creation.cylinder(radius, height, sections=_SIDES), item.pose)
        case Capsule():
            return _capsule(np.asarray(item.start_m), np.asarray(item.end_m), item.radius_m + by_m)
        case Mesh() if by_m == 0.0:
            mesh = load_mesh(item.file).moved(item.pose, item.scale)
            return Triangles(mesh.vertices, mesh.faces)
        case Halfspace() if by_m == 0.0:
            return _plate(np.asarray(item.normal), item.offset_m, 2.0 * reach_m)
    return None


def _capsule(start: FloatArray, end: FloatArray, radius_m: float) -> Triangles:
    axis = end - start
    length = float(np.linalg.norm(axis))
    rod = trimesh.creation.capsule(length, radius_m, count=[_SIDES, _SIDES])
    middle = rod.vertices.mean(axis=0)  # along z, wherever the library lets it begin
    pose = np.eye(4)
    if length > 0.0:
        pose[:3, :3] = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], axis / length)[:3, :3]
    pose[:3, 3] = 0.5 * (start + end)
    return _placed(trimesh.Trimesh(rod.vertices - middle, rod.faces, process=False), pose)


def _plate(normal: FloatArray, offset_m: float, side_m: float) -> Triangles:
    """A thin plate whose upper face is the halfspace's, about the point nearest to the origin."""
    thick_m = 0.002 * side_m
    pose = np.eye(4)
    pose[:3, :3] = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], normal)[:3, :3]
    pose[:3, 3] = normal * (offset_m - 0.5 * thick_m)
    return _placed(trimesh.creation.box((side_m, side_m, thick_m)), pose)


def _placed(mesh: trimesh.Trimesh, pose: FloatArray) -> Triangles:
    vertices = np.asarray(mesh.vertices) @ pose[:3, :3].T + pose[:3, 3]
    return Triangles(vertices, np.asarray(mesh.faces))


def _moved(mesh: trimesh.Trimesh, by: FloatArray) -> Triangles:
    return Triangles(np.asarray(mesh.vertices) + by, np.asarray(mesh.faces))
