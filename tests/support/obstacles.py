"""Exact keep-out objects for the oracle: distance to a link, and coarse bounds of many points.

Cylinders are prisms inscribed in them: a distance may be above the truth by ARROW_M, for a round
link against a round object by twice that, and is never below it.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fcl
import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from tests.support.bodies import (
    ARROW_M,
    Surface,
    cylinder_surface,
    outermost,
    read_surface,
    segment,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from rampe_guard.core.types import FloatArray
    from tests.support.bodies import LinkBody

SLAB_M = 1000.0
ERROR_M = 2.0 * ARROW_M
"""How far a distance may be above the truth [m]."""
_REQUEST = fcl.DistanceRequest(enable_nearest_points=True)


class Obstacle:
    """One solid object, without its margin.

    Attributes:
        item: as in the scene.
        solid: FCL object for `collide`.
        inner: points (p, 3) of it, one in each part [m].
        middle: about its middle (3,) [m].
    """

    def __init__(self, item: SolidObject) -> None:
        self.item = item
        self.solid, self._body, self._thick, self.inner = _build(item)
        self._parts: list[Surface] = []
        self._box = (np.zeros(3), np.eye(4))
        self._corners = self.inner
        if isinstance(item, Mesh):
            surface = _placed(item)
            self._parts = surface.parts()
            low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
            pose = np.eye(4)
            pose[:3, 3] = 0.5 * (low + high)
            self._box = 0.5 * (high - low), pose
            self.inner = np.array([part.vertices[part.faces[0, 0]] for part in self._parts])
            self._corners = outermost(surface.vertices)
        elif isinstance(item, Box):
            self._box = 0.5 * np.array(item.size_m), item.pose
            signs = np.array(list(product((-0.5, 0.5), repeat=3)))
            self._corners = (signs * item.size_m) @ item.pose[:3, :3].T + item.pose[:3, 3]
        elif isinstance(item, Cylinder):
            half = np.array([item.radius_m, item.radius_m, 0.5 * item.height_m])
            self._box = half, item.pose
        self.middle = self._box[1][:3, 3]
        if isinstance(item, Sphere | Capsule):
            self.middle = self.inner[0]
        if isinstance(item, Capsule):
            self._corners = np.array([item.start_m, item.end_m])

    def distance(self, link: LinkBody, pose: FloatArray) -> tuple[float, FloatArray | None]:
        """Distance [m] of surfaces from a link at ``pose`` (4, 4), 0 in contact; and whereto.

        The second is about the unit direction (3,) from link to obstacle, where one is known.
        """
        if isinstance(self.item, Halfspace):
            normal = np.array(self.item.normal)
            lowest = float((link.hull @ (pose[:3, :3].T @ normal)).min() + normal @ pose[:3, 3])
            return max(lowest - self.item.offset_m - link.reach, 0.0), -normal
        least, whereto = np.inf, None
        for piece in link.pieces:
            result = fcl.DistanceResult()
            fcl.distance(piece.place(pose), self._body, _REQUEST, result)
            found = float(result.min_distance)
            assert found < SLAB_M, f"distance {found} from {self.item}"
            if found - piece.radius < least:
                least = found - piece.radius
                p, q = (np.asarray(point) for point in result.nearest_points)
                length = float(np.linalg.norm(q - p))
                whereto = (q - p) / length if found > 0.0 and 0.0 < length < np.inf else None
        return max(least - self._thick, 0.0), whereto  # FCL says -1 or 0 of an overlap

    def support(self, direction: FloatArray) -> float:
        """How far the object extends towards a unit direction (3,) from the origin [m]."""
        item = self.item
        match item:
            case Halfspace():
                same = np.array_equal(item.normal, direction)
                return item.offset_m if same else float(np.inf)
            case Cylinder():
                along = float(item.pose[:3, 2] @ direction)
                across = item.radius_m * float(np.sqrt(max(1.0 - along * along, 0.0)))
                center = float(item.pose[:3, 3] @ direction)
                return center + 0.5 * item.height_m * abs(along) + across
            case _:
                return float((self._corners @ direction).max()) + self._thick

    def away(self, points: FloatArray) -> FloatArray:
        """Lower bound (...) [m] of the distance of points (..., 3), exact or that of a box."""
        item = self.item
        match item:
            case Halfspace():
                return np.asarray(points @ np.array(item.normal)) - item.offset_m
            case Sphere():
                gap = np.linalg.norm(points - np.array(item.center_m), axis=-1)
                return np.asarray(gap - item.radius_m)
            case Capsule():
                a, b = np.array(item.start_m), np.array(item.end_m)
                along = b - a
                share = np.clip((points - a) @ along / float(along @ along), 0.0, 1.0)
                gap = np.linalg.norm(points - a - share[..., None] * along, axis=-1)
                return np.asarray(gap - item.radius_m)
            case _:
                half, pose = self._box
                local = np.abs((points - pose[:3, 3]) @ pose[:3, :3])
                return np.asarray(np.linalg.norm(np.maximum(local - half, 0.0), axis=-1))

    def holds(self, points: FloatArray) -> npt.NDArray[np.bool_]:
        """Which points (n, 3) are inside."""
        if isinstance(self.item, Mesh):
            held = np.array([part.holds(points) for part in self._parts])
            return np.asarray(held.any(axis=0))
        inside = np.asarray(self.away(points) <= 0.0)
        if isinstance(self.item, Cylinder) and inside.any():
            pose = self.item.pose
            local = (points - pose[:3, 3]) @ pose[:3, :3]
            inside &= np.hypot(local[:, 0], local[:, 1]) <= self.item.radius_m
        return np.asarray(inside)


def contained(link: LinkBody, pose: FloatArray, obstacle: Obstacle) -> bool:
    """Whether link or obstacle is within the other, by a point of each of their parts."""
    if not len(obstacle.inner):
        return False
    local = (obstacle.inner - pose[:3, 3]) @ pose[:3, :3]
    if any(part.holds(local).any() for part in link.closed):
        return True
    points = link.inner @ pose[:3, :3].T + pose[:3, 3]
    return bool(len(points) and obstacle.holds(points).any())


def _placed(item: Mesh) -> Surface:
    return read_surface(Path(item.file), item.scale).moved(item.pose)


def _build(item: SolidObject) -> tuple[Any, Any, float, FloatArray]:
    """Solid for `collide`, body for `distance`, thickness round it [m], a point inside (1, 3)."""
    match item:
        case Box():
            solid = fcl.CollisionObject(fcl.Box(*item.size_m), _transform(item.pose))
            return solid, solid, 0.0, item.pose[None, :3, 3]
        case Sphere():
            center = np.array(item.center_m)
            solid = fcl.CollisionObject(fcl.Sphere(item.radius_m), fcl.Transform(center))
            body = fcl.CollisionObject(segment(center, center).bvh())
            return solid, body, item.radius_m, center[None]
        case Capsule():
            a, b = np.array(item.start_m), np.array(item.end_m)
            length = float(np.linalg.norm(b - a))
            turn = Rotation.align_vectors([(b - a) / length], [[0, 0, 1]])[0].as_matrix()
            shape = fcl.Capsule(item.radius_m, length)
            solid = fcl.CollisionObject(shape, fcl.Transform(turn, 0.5 * (a + b)))
            return solid, fcl.CollisionObject(segment(a, b).bvh()), item.radius_m, a[None]
        case Cylinder():
            solid = fcl.CollisionObject(
                fcl.Cylinder(item.radius_m, item.height_m), _transform(item.pose)
            )
            prism = cylinder_surface(item.radius_m, item.height_m)
            body = fcl.CollisionObject(prism.bvh(), _transform(item.pose))
            return solid, body, 0.0, item.pose[None, :3, 3]
        case Mesh():
            body = fcl.CollisionObject(_placed(item).bvh())
            return body, body, 0.0, np.zeros((0, 3))
        case Halfspace():
            normal = np.array(item.normal)
            turn = Rotation.align_vectors([normal], [[0, 0, 1]])[0].as_matrix()
            middle = normal * (item.offset_m - 0.5 * SLAB_M)
            slab = fcl.Box(SLAB_M, SLAB_M, SLAB_M)
            solid = fcl.CollisionObject(slab, fcl.Transform(turn, middle))
            return solid, solid, 0.0, np.zeros((0, 3))


def _transform(pose: FloatArray) -> Any:
    return fcl.Transform(pose[:3, :3], pose[:3, 3])
