"""How much of the space that one object keeps clear another one, in its place, does not.

An object with its margin is a shape grown by a distance. The new one holds the old one's space if
no point of the old shape is farther from the new shape than the new growth exceeds the old. That
distance is a convex function wherever the new shape is convex, so it is greatest at a corner of
the old one; corners of round shapes are those of a solid round them.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rampe_guard.collision.mesh import load_mesh
from rampe_guard.collision.zones import CORNERS
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from rampe_guard.core.types import FloatArray

_SIDES: Final = 64
_SAME: Final = 1e-9


def given_up_m(old: SolidObject, new: SolidObject) -> float:
    """How deep the old space sticks out of the new at the most [m], 0 or more.

    Infinite where that has no end, or cannot be told (the new one is another mesh). Round shapes
    and meshes may be told up to a little more than it is, never less.
    """
    if isinstance(old, Halfspace):
        return _between_halfspaces(old, new)
    if isinstance(new, Mesh):
        return _between_meshes(old, new)
    points, radius = _corners(old)
    grown = radius + old.margin_m - new.margin_m
    return max(0.0, float(_distance(points, new).max()) + grown)


def _between_halfspaces(old: Halfspace, new: SolidObject) -> float:
    if not isinstance(new, Halfspace) or not np.allclose(old.normal, new.normal, atol=_SAME):
        return math.inf
    return max(0.0, old.offset_m + old.margin_m - new.offset_m - new.margin_m)


def _between_meshes(old: SolidObject, new: Mesh) -> float:
    """Between two placings of the same mesh; of others nothing can be said."""
    if not isinstance(old, Mesh) or not _same_file(old, new) or (new.open and not old.open):
        return math.inf
    vertices = load_mesh(old.file).vertices
    there, here = (
        vertices * mesh.scale @ mesh.pose[:3, :3].T + mesh.pose[:3, 3] for mesh in (old, new)
    )
    moved = float(np.linalg.norm(there - here, axis=1).max())
    return max(0.0, moved + old.margin_m - new.margin_m)


def _same_file(old: Mesh, new: Mesh) -> bool:
    with open(old.file, "rb") as a, open(new.file, "rb") as b:  # noqa: PTH123 - a pair
        return a.read() == b.read()


def _corners(item: SolidObject) -> tuple[FloatArray, float]:
    """Points (n, 3) and a radius [m] whose hull, grown by the radius, holds the shape."""
    match item:
        case Box():
            return _posed(CORNERS * np.asarray(item.size_m), item.pose), 0.0
        case Sphere():
            return np.array([item.center_m]), item.radius_m
        case Capsule():
            return np.array([item.start_m, item.end_m]), item.radius_m
        case Cylinder():
            angle = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
            ring = np.column_stack([np.cos(angle), np.sin(angle)]) * item.radius_m
            ring /= np.cos(np.pi / _SIDES)
            half = np.full(_SIDES, 0.5 * item.height_m)
            ends = np.concatenate([np.column_stack([ring, z]) for z in (half, -half)])
            return _posed(ends, item.pose), 0.0
        case Mesh():
            return _posed(load_mesh(item.file).vertices * item.scale, item.pose), 0.0
    raise TypeError(f"{type(item).__name__} has no corners")


def _distance(points: FloatArray, item: SolidObject) -> FloatArray:
    """How far points (n, 3) are from a convex shape (n,) [m], negative inside: so deep."""
    match item:
        case Box():
            beyond = np.abs(_local(points, item.pose)) - 0.5 * np.asarray(item.size_m)
        case Cylinder():
            local = _local(points, item.pose)
            across = np.hypot(local[:, 0], local[:, 1]) - item.radius_m
            beyond = np.column_stack([across, np.abs(local[:, 2]) - 0.5 * item.height_m])
        case Sphere():
            away = np.linalg.norm(points - np.asarray(item.center_m), axis=1)
            return np.asarray(away - item.radius_m)
        case Capsule():
            start, axis = np.asarray(item.start_m), np.subtract(item.end_m, item.start_m)
            square = float(axis @ axis)
            along = (points - start) @ axis / square if square > 0.0 else np.zeros(len(points))
            foot = start + np.clip(along, 0.0, 1.0)[:, None] * axis
            return np.asarray(np.linalg.norm(points - foot, axis=1) - item.radius_m)
        case Halfspace():
            return np.asarray(points @ np.asarray(item.normal) - item.offset_m)
        case Mesh():
            raise TypeError("a mesh is not convex")
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))


def _posed(points: FloatArray, pose: FloatArray) -> FloatArray:
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def _local(points: FloatArray, pose: FloatArray) -> FloatArray:
    return np.asarray((points - pose[:3, 3]) @ pose[:3, :3])
