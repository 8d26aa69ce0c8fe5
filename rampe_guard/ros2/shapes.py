"""What RViz can draw of a machine: its links as boxes, its zones as simple solids."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard.collision import Arm
from rampe_guard.collision.mesh import load_mesh
from rampe_guard.core.kinematics import ForwardKinematics
from rampe_guard.core.scene import (
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    Mesh,
    SceneObject,
    Sphere,
)
from rampe_guard.core.types import FloatArray, Point

CUBE, SPHERE, CYLINDER = 1, 2, 3
"""Types of a visualization_msgs/Marker."""
_PLATE_M = 0.02


@dataclass(frozen=True, slots=True)
class Solid:
    """A marker's kind, pose in the world (4, 4) [m] and edge lengths or diameters [m]."""

    kind: int
    pose: FloatArray
    size: Point


class Ghost:
    """The links of an arm as boxes, wherever its actuators are.

    Args:
        arm: as it was loaded.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm, self._kinematics = arm, ForwardKinematics(arm.chain)
        self._boxes: list[tuple[int, FloatArray, Point]] = []
        for link, mesh in enumerate(arm.meshes):
            if mesh is not None and arm.chain.link_frame[link] > 0:  # what never moves is no ghost
                low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
                middle = np.eye(4)
                middle[:3, 3] = 0.5 * (low + high)
                self._boxes.append((link, middle, _point(np.maximum(high - low, 1e-3))))
        self.foot: FloatArray = np.asarray(arm.chain.link_origin[0][:3, 3], dtype=float)
        self.size_m = max((max(size) for _, _, size in self._boxes), default=1.0)

    def at(self, position: FloatArray) -> list[Solid]:
        """Boxes at actuator values (n,) [unit]; one beyond its linkage is drawn at its end."""
        arm = self._arm
        inside = np.clip(position, arm.proven[:, 0], arm.proven[:, 1])
        joints = np.array([[float(j.value(inside[j.actuator])) for j in arm.joints]])
        poses = self._kinematics.links(joints)[0]
        return [Solid(CUBE, poses[link] @ middle, size) for link, middle, size in self._boxes]


def zones(objects: Iterable[SceneObject], reach_m: float) -> Mapping[str, tuple[Solid, ...]]:
    """Solids of every zone that stands still and has a body, by name.

    A mesh is drawn as the box about it, a halfspace as a plate as far as ``reach_m``. Objects that
    move, and limits of actuators, have none.
    """
    return {
        item.name: tuple(_solids(item, reach_m))
        for item in objects
        if not isinstance(item, ActuatorLimit) and item.key is None
    }


def quaternion(pose: FloatArray) -> tuple[float, float, float, float]:
    """Rotation of a pose as x, y, z, w."""
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
    return x, y, z, w


def _solids(  # noqa: PLR0911 - one return for each kind
    item: SceneObject, reach_m: float
) -> list[Solid]:
    match item:
        case Box():
            return [Solid(CUBE, item.pose, item.size_m)]
        case Sphere():
            return [_ball(item.center_m, item.radius_m)]
        case Cylinder():
            width = 2.0 * item.radius_m
            return [Solid(CYLINDER, item.pose, (width, width, item.height_m))]
        case Capsule():
            return _capsule(item)
        case Halfspace():
            normal = np.asarray(item.normal)
            pose = _along(normal, normal * (item.offset_m - 0.5 * _PLATE_M))
            return [Solid(CUBE, pose, (2.0 * reach_m, 2.0 * reach_m, _PLATE_M))]
        case Mesh():
            vertices = load_mesh(item.file).moved(item.pose, item.scale).vertices
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            pose = np.eye(4)
            pose[:3, 3] = 0.5 * (low + high)
            return [Solid(CUBE, pose, _point(np.maximum(high - low, 1e-3)))]
    return []


def _capsule(item: Capsule) -> list[Solid]:
    start, end = np.asarray(item.start_m), np.asarray(item.end_m)
    found = [_ball(item.start_m, item.radius_m), _ball(item.end_m, item.radius_m)]
    length = float(np.linalg.norm(end - start))
    if length > 0.0:
        pose = _along((end - start) / length, 0.5 * (start + end))
        width = 2.0 * item.radius_m
        found.append(Solid(CYLINDER, pose, (width, width, length)))
    return found


def _ball(center: Point, radius_m: float) -> Solid:
    pose = np.eye(4)
    pose[:3, 3] = center
    return Solid(SPHERE, pose, (2.0 * radius_m,) * 3)


def _along(axis: FloatArray, place: FloatArray) -> FloatArray:
    """A pose whose z is ``axis``."""
    pose = np.eye(4)
    turn, _ = Rotation.align_vectors(axis[None], np.array([[0.0, 0.0, 1.0]]))
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), place
    return pose


def _point(values: FloatArray) -> Point:
    x, y, z = values.tolist()
    return x, y, z
