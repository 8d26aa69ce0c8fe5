"""FCL's own shapes of links and obstacles: what the sweep's answers are held against.

Only kinds of pairs that python-fcl answers rightly are built: halfspaces are not asked of it,
and meshes are surfaces of triangles, without an inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import fcl
import numpy as np

from rampe_guard.core.scene import Box, Capsule, Cylinder, Sphere

if TYPE_CHECKING:
    from rampe_guard.collision.mesh import IntArray
    from rampe_guard.core.types import FloatArray


def exact_shape(item: Box | Sphere | Cylinder | Capsule) -> fcl.CollisionObject:
    """An object as FCL's own kind of shape, placed as the scene places it."""
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


def surface(vertices: FloatArray, faces: IntArray) -> fcl.CollisionObject:
    """Triangles (f, 3) of vertices (v, 3) [m], finite and at least one of them."""
    model = fcl.BVHModel()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(vertices, faces)
    model.endModel()
    return fcl.CollisionObject(model)


def place(body: fcl.CollisionObject, pose: FloatArray) -> fcl.CollisionObject:
    """The body, moved to ``pose`` (4, 4)."""
    body.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
    return body


def inverse(pose: FloatArray) -> FloatArray:
    """The inverse of a rigid motion (4, 4)."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def touching(a: fcl.CollisionObject, b: fcl.CollisionObject) -> bool:
    """Whether two bodies touch where they are."""
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()))


def _object(shape: fcl.CollisionGeometry, pose: FloatArray) -> fcl.CollisionObject:
    return fcl.CollisionObject(shape, fcl.Transform(pose[:3, :3], pose[:3, 3]))


def _turned_z(way: FloatArray) -> FloatArray:
    """A rotation that takes z to a unit vector."""
    side = np.cross(np.eye(3)[np.argmin(np.abs(way))], way)
    side /= np.linalg.norm(side)
    return np.column_stack([side, np.cross(way, side), way])
