"""FCL behind the two questions of the sweep: a direction (never trusted), an exact distance.

What FCL 0.7 may be asked was measured: distances of a BVH to a BVH, a box or a convex are right
within 0.3 µm; distances of convex shapes can be centimetres too long, so of those only the
direction is used, and core/convex proves what it gives. Objects are built once and moved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import fcl
import numpy as np

from rampe_guard.collision.pieces import SKIN_M, fcl_bvh, fcl_convex
from rampe_guard.core.convex import HalfspacePiece
from rampe_guard.core.kinematics import apply
from rampe_guard.core.sweep_problem import Nearest, Zone

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.collision.zones import Solid
    from rampe_guard.core.convex import ObstaclePiece
    from rampe_guard.core.scene import ActuatorLimit
    from rampe_guard.core.sweep_problem import SweepProblem
    from rampe_guard.core.types import FloatArray, Point

EXACT_ERROR_M = 1e-6
"""Three times the largest error seen of a trusted distance [m]; taken off every one."""
INSIDE = 0.5
"""Winding number from which a point counts as inside a closed mesh."""


class FclOracle:
    """Implements `core.sweep_problem.ClearanceOracle` for fixed links and zones."""

    def __init__(
        self,
        problem: SweepProblem,
        meshes: Sequence[TriangleMesh | None],
        solids: Sequence[Solid | None],
    ) -> None:
        """``meshes``: one per link. ``solids``: one per zone, None for actuator limits."""
        self._bodies = [fcl.CollisionObject(fcl_convex(body.vertices)) for body in problem.bodies]
        self._obstacles = [_obstacle(piece) for piece in problem.obstacles]
        self._normals = [
            -piece.normal if isinstance(piece, HalfspacePiece) else None
            for piece in problem.obstacles
        ]
        self._planes = [_plane(zone) for zone in problem.zones]
        self._solids = list(solids)
        self._hulls = {
            int(link): body.vertices
            for link, body in zip(problem.solid_links, problem.bodies, strict=False)
        }
        self._surfaces = [None if m is None else fcl.CollisionObject(fcl_bvh(m)) for m in meshes]
        parts = [() if mesh is None else tuple(mesh.components()) for mesh in meshes]
        self._inner = [np.array([p.vertices[0] for p in own]).reshape(-1, 3) for own in parts]
        self._closed = [tuple(_Closed(p) for p in own if p.is_watertight()) for own in parts]
        self._hollow = [
            () if solid is None else tuple(_Closed(part) for part in solid.closed)
            for solid in solids
        ]
        self._request = fcl.DistanceRequest(enable_nearest_points=True)
        # the same once more in long arrays, for the question that spares most of the others
        self._inner_link = np.repeat(np.arange(len(meshes)), [len(own) for own in self._inner])
        self._all_inner = np.concatenate([*self._inner, np.zeros((0, 3))])
        self._link_boxes = np.array([_box(own) for own in self._closed]).reshape(-1, 2, 3)
        self._zone_boxes = [_box(own) for own in self._hollow]

    def direction(
        self, body: int, obstacle: int, pose: FloatArray, *, swapped: bool
    ) -> FloatArray | None:
        """A guess of the unit direction from a body to an obstacle piece."""
        normal = self._normals[obstacle]
        if normal is not None:
            return normal
        a, b = self._bodies[body], self._obstacles[obstacle]
        a.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        result = fcl.DistanceResult()
        if swapped:
            fcl.distance(b, a, self._request, result)
            q, p = result.nearest_points
        else:
            fcl.distance(a, b, self._request, result)
            p, q = result.nearest_points
        if not result.min_distance > 0.0:
            return None
        way = q - p
        length = float(np.sqrt(way @ way))
        if not 0.0 < length < np.inf:
            return None
        return np.asarray(way / length)

    def distance(self, link: int, zone: int, pose: FloatArray) -> Nearest:
        """Distance of the exact surfaces less EXACT_ERROR_M, 0 in contact or if not computable."""
        plane, solid = self._planes[zone], self._solids[zone]
        if plane is not None:
            points = apply(pose, self._hulls[link])
            lowest = points[np.argmin(points @ plane.normal)]
            height = float(lowest @ plane.normal) - plane.offset
            return Nearest(max(height, 0.0), _point(lowest - height * plane.normal))
        surface = self._surfaces[link]
        if solid is None or surface is None:
            raise ValueError(f"no distance is defined between link {link} and zone {zone}")
        surface.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        result = fcl.DistanceResult()
        fcl.distance(surface, solid.body, self._request, result)
        p, q = (np.asarray(point, dtype=float) for point in result.nearest_points)
        distance = float(result.min_distance) - solid.radius - EXACT_ERROR_M
        if not (0.0 < distance < FAR_M and np.isfinite(q).all()):
            return Nearest(0.0, self._touch(surface, solid, pose))
        way = p - q
        return Nearest(distance, _point(q + way * (solid.radius / float(np.linalg.norm(way)))))

    def contained(self, link: int, zone: int, pose: FloatArray) -> Point | None:
        """A point of the zone inside the link's closed mesh, or of the link inside the zone's."""
        solid = self._solids[zone]
        if solid is None:
            return None
        rotation, translation = pose[:3, :3], pose[:3, 3]
        local = (solid.inner - translation) @ rotation
        found = _inside(self._closed[link], local)
        if found is not None:
            return _point(solid.inner[found])
        points = apply(pose, self._inner[link])
        found = _inside(self._hollow[zone], points)
        return None if found is None else _point(points[found])

    def boxed(self, zone: int, poses: FloatArray) -> frozenset[int]:
        """Links with a point in the box of the zone, or in whose box the zone has a point."""
        solid = self._solids[zone]
        if solid is None:
            return frozenset()
        rotations, translations = poses[:, :3, :3], poses[:, :3, 3]
        local = (solid.inner[None] - translations[:, None]) @ rotations
        low, high = self._link_boxes[:, None, 0], self._link_boxes[:, None, 1]
        holding = np.all((local >= low) & (local <= high), axis=2)
        link = self._inner_link
        points = (rotations[link] @ self._all_inner[:, :, None])[..., 0] + translations[link]
        low, high = self._zone_boxes[zone]
        held = np.logical_and(points >= low, points <= high).all(axis=1)
        return frozenset(np.flatnonzero(np.any(holding, axis=1)).tolist()) | frozenset(
            link[held].tolist()
        )

    def _touch(self, surface: fcl.CollisionObject, solid: Solid, pose: FloatArray) -> Point:
        """A point of an overlap: where surfaces cross, else a corner of what is inside."""
        result = fcl.CollisionResult()
        fcl.collide(surface, solid.body, fcl.CollisionRequest(enable_contact=True), result)
        points = [np.asarray(contact.pos, dtype=float) for contact in result.contacts]
        finite = [point for point in points if np.isfinite(point).all()]
        if finite:
            return _point(finite[0])
        result = fcl.DistanceResult()
        fcl.distance(surface, solid.body, self._request, result)
        q = np.asarray(result.nearest_points[1], dtype=float)
        return _point(q if np.isfinite(q).all() and np.abs(q).max() < FAR_M else pose[:3, 3])


FAR_M = 1e7


def _plane(zone: Zone | ActuatorLimit) -> HalfspacePiece | None:
    first = zone.pieces[0].piece if isinstance(zone, Zone) else None
    return first if isinstance(first, HalfspacePiece) else None


def _obstacle(piece: ObstaclePiece) -> fcl.CollisionObject | None:
    """A hull for proposals of directions; a point or segment gets a skin, which errs by that."""
    if isinstance(piece, HalfspacePiece):
        return None
    return fcl.CollisionObject(fcl_convex(piece.vertices))


class _Closed:
    """A closed mesh with the box that spares most points the question."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh
        self.low = mesh.vertices.min(axis=0) - SKIN_M
        self.high = mesh.vertices.max(axis=0) + SKIN_M


def _box(closed: Sequence[_Closed]) -> FloatArray:
    """Lowest and highest corner (2, 3) of all; an empty box where there is none."""
    if not closed:
        return np.array([np.full(3, np.inf), np.full(3, -np.inf)])
    low = np.min([part.low for part in closed], axis=0)
    return np.array([low, np.max([part.high for part in closed], axis=0)])


def _inside(closed: Sequence[_Closed], points: FloatArray) -> int | None:
    """Index of the first point inside any of the closed meshes."""
    for part in closed:
        boxed = ((points >= part.low) & (points <= part.high)).all(axis=1)
        for index in np.flatnonzero(boxed):
            if abs(part.mesh.winding(points[index][None])[0]) > INSIDE:
                return int(index)
    return None


def _point(values: FloatArray) -> Point:
    x, y, z = values
    return float(x), float(y), float(z)
