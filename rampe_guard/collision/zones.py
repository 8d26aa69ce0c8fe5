"""Scene objects to zones: bounding trees for the sweep, exact FCL shapes for its confirmation.

Spheres and capsules are a point or a segment with a radius, cylinders and halfspaces nodes of
their own kind: all of them exact. A closed mesh is solid; one that the scene calls open, like a
scanned terrain, is a surface with no inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import fcl
import numpy as np

from rampe_guard.collision.mesh import checked_mesh, load_mesh
from rampe_guard.collision.tree_build import build_tree
from rampe_guard.core.bounding_tree import cylinder, halfspace, single
from rampe_guard.core.kinematics import apply
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from rampe_guard.core.sweep_problem import Zone
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.bounding_tree import BoundingTree
    from rampe_guard.core.types import FloatArray

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
ROUNDING = 1e-6


def build_zone(item: SolidObject, link_names: Sequence[str]) -> Zone:
    """The zone of a scene object.

    Raises:
        GeometryError: naming the object and what is wrong with it.
    """
    unknown = [name for name in item.ignore_links if name not in link_names]
    if unknown:
        raise GeometryError(
            f"object '{item.name}' ignores link '{unknown[0]}'; the arm has {', '.join(link_names)}"
        )
    if not (np.isfinite(item.margin_m) and item.margin_m >= 0.0):
        raise GeometryError(f"object '{item.name}' has margin_m {item.margin_m}; use 0 or more")
    ignored = frozenset(link_names.index(name) for name in item.ignore_links)
    return Zone(item.name, item.margin_m, _tree(item), ignored, placed=item.key is not None)


def _tree(item: SolidObject) -> BoundingTree:
    match item:
        case Box():
            size, pose = _positive(item, item.size_m), _pose(item, item.pose)
            return single(apply(pose, CORNERS * size))
        case Sphere():
            (radius,) = _positive(item, [item.radius_m])
            return single(_finite(item, item.center_m)[None], float(radius))
        case Capsule():
            (radius,) = _positive(item, [item.radius_m])
            ends = np.stack([_finite(item, item.start_m), _finite(item, item.end_m)])
            return single(np.unique(ends, axis=0), float(radius))
        case Cylinder():
            radius, height = (float(x) for x in _positive(item, [item.radius_m, item.height_m]))
            pose = _pose(item, item.pose)
            return cylinder(pose[:3, 3], 0.5 * height * pose[:3, 2], radius)
        case Halfspace():
            return _halfspace(item)
        case Mesh():
            return _mesh(item)


def _halfspace(item: Halfspace) -> BoundingTree:
    normal, (offset,) = _finite(item, item.normal), _finite(item, [item.offset_m])
    norm = float(np.linalg.norm(normal))
    if not abs(norm - 1.0) < ROUNDING:  # settings has normed it
        raise GeometryError(f"object '{item.name}' has a normal of length {norm:.6g}; norm it")
    return halfspace(normal / norm, float(offset))


def _mesh(item: Mesh) -> BoundingTree:
    (scale,) = _positive(item, [item.scale])
    placed = load_mesh(item.file).moved(_pose(item, item.pose), float(scale))
    mesh = checked_mesh(placed.vertices, placed.faces, f"object '{item.name}': {item.file}")
    parts = mesh.components()
    closed = tuple(part for part in parts if part.is_closed())
    if len(closed) < len(parts):
        raise GeometryError(
            f"object '{item.name}': {item.file}: {len(parts) - len(closed)} of {len(parts)} parts"
            " are not closed (an edge is open, or a triangle is turned over), so inside"
            " and outside cannot be told apart; close the mesh, or use boxes"
        )
    return build_tree(mesh)


def exact_shape(item: SolidObject) -> fcl.CollisionObject | None:
    """The same in FCL's own shapes, placed in the world; None where FCL has none to be trusted.

    Halfspaces are not asked of FCL, and meshes are the business of `confirm`.
    """
    match item:
        case Box():
            return _object(fcl.Box(*item.size_m), item.pose)
        case Sphere():
            pose = np.eye(4)
            pose[:3, 3] = item.center_m
            return _object(fcl.Sphere(item.radius_m), pose)
        case Cylinder():
            return _object(fcl.Cylinder(item.radius_m, item.height_m), item.pose)
        case Capsule():
            a, b = np.array(item.start_m), np.array(item.end_m)
            length = float(np.linalg.norm(b - a))
            pose = np.eye(4)
            pose[:3, 3] = 0.5 * (a + b)
            if length == 0.0:
                return _object(fcl.Sphere(item.radius_m), pose)
            pose[:3, :3] = _turned_z((b - a) / length)
            return _object(fcl.Capsule(item.radius_m, length), pose)
        case _:
            return None


def _object(shape: fcl.CollisionGeometry, pose: FloatArray) -> fcl.CollisionObject:
    return fcl.CollisionObject(shape, fcl.Transform(pose[:3, :3], pose[:3, 3]))


def _turned_z(way: FloatArray) -> FloatArray:
    """A rotation that takes z to a unit vector."""
    side = np.cross(np.eye(3)[np.argmin(np.abs(way))], way)
    side /= np.linalg.norm(side)
    return np.column_stack([side, np.cross(way, side), way])


def _finite(item: SolidObject, values: Sequence[float]) -> FloatArray:
    array = np.asarray(values, dtype=float)
    if not np.isfinite(array).all():
        raise GeometryError(f"object '{item.name}' has {array.tolist()}: not finite")
    return array


def _positive(item: SolidObject, values: Sequence[float]) -> FloatArray:
    array = _finite(item, values)
    if not (array > 0.0).all():
        raise GeometryError(f"object '{item.name}' has a size of {array.tolist()}; use more than 0")
    return array


def _pose(item: SolidObject, pose: FloatArray) -> FloatArray:
    pose = np.asarray(pose, dtype=float)
    rotation = pose[:3, :3]
    if not (
        np.isfinite(pose).all() and np.allclose(rotation @ rotation.T, np.eye(3), atol=ROUNDING)
    ):
        raise GeometryError(f"object '{item.name}' has a pose that is no rigid motion")
    return pose
