"""coal, FCL's successor: dense with its broad phase, and conservative advancement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import coal
import numpy as np

from tests.benchmarks.peers.dense import Dense
from tests.benchmarks.peers.posing import Posing, way_of
from tests.benchmarks.peers.walking import advance, begin, cover_of, new_walk

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Item, Piece, Solid, Work


class DenseCoal(Dense):
    """Exact meshes of the links against a dynamic tree of the scene, all in C++."""

    def __init__(self, work: Work, step_m: float = 0.005) -> None:
        super().__init__(work, step_m)
        self._shapes = [mesh_of(mesh) for mesh in work.machine.meshes]
        self._links = [coal.CollisionObject(shape) for shape in self._shapes]
        self._geometries = [_exact(item) for item in work.items]
        self._objects = [
            coal.CollisionObject(shape, item.pose[:3, :3], item.pose[:3, 3])
            for shape, item in zip(self._geometries, work.items, strict=True)
        ]
        self._scene = _manager(self._objects)
        self._arm = _manager([self._links[link] for link in self.moving])
        self._callback = coal.CollisionCallBackDefault()

    def touches(self, rotations: FloatArray, translations: FloatArray) -> bool:
        """Tree against tree."""
        for link in self.moving:
            body = self._links[link]
            body.setRotation(rotations[link])
            body.setTranslation(translations[link])
            body.computeAABB()
        self._arm.update()
        self._callback.init()
        self._scene.collide(self._arm, self._callback)
        return bool(self._callback.data.result.isCollision())


class AdvancingCoal:
    """Distances of hulls as long as they are apart, of the exact meshes once hulls touch."""

    def __init__(self, work: Work) -> None:
        self._posing = Posing(work.machine)
        self._tables, self._cover = self._posing.tables, cover_of(work)
        self._walk = new_walk(self._posing, self._cover)
        self._ways = [way_of(motion) for motion in work.motions]
        self._tolerance = work.machine.tolerance_m
        self._hulls = [hull_of(hull) for hull in work.machine.hulls]
        self._meshes = [mesh_of(mesh) for mesh in work.machine.meshes]
        self._pieces = [_convex(piece) for piece in work.pieces]
        self._owner = [piece.item if piece.exact else None for piece in work.pieces]
        self._poses = [coal.Transform3s(p.pose[:3, :3], p.pose[:3, 3]) for p in work.pieces]
        self._exact = [
            shape if piece.exact else mesh_of(work.items[piece.item].surface)
            for shape, piece in zip(self._pieces, work.pieces, strict=True)
        ]
        self._near: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._pose = coal.Transform3s()
        self._request = coal.DistanceRequest(False)  # noqa: FBT003  # positional in C++
        self._result = coal.DistanceResult()

    def first_contact(self, number: int) -> float | None:
        """Step the pair that is certified least far until one is within the tolerance."""
        tables, walk, tolerance = self._tables, self._walk, self._tolerance
        way = self._ways[number]
        count = begin(tables, self._cover, way, walk, tolerance)
        pair = advance(tables, way, walk, count, -1, 0.0)
        while pair >= 0:
            link, piece = int(walk.pairs[pair, 0]), int(walk.pairs[pair, 1])
            pose = self._pose
            pose.setRotation(walk.rotations[link])
            pose.setTranslation(walk.translations[link])
            rough, exact = self._pair(link, piece)
            distance = self._distance(rough, piece)
            if distance <= tolerance:
                distance = self._distance(exact, piece)
                if distance <= tolerance:
                    return float(walk.now[0])
            pair = advance(tables, way, walk, count, pair, distance)
        return None

    def _pair(self, link: int, piece: int) -> tuple[Any, Any]:
        known = self._near.get((link, piece))
        if known is None:
            known = (
                coal.ComputeDistance(self._hulls[link], self._pieces[piece]),
                coal.ComputeDistance(self._meshes[link], self._exact[piece]),
            )
            self._near[link, piece] = known
        return known

    def _distance(self, ask: Any, piece: int) -> float:
        self._result.clear()
        return float(ask(self._pose, self._poses[piece], self._request, self._result))


def _manager(bodies: list[Any]) -> Any:
    manager = coal.DynamicAABBTreeCollisionManager()
    for body in bodies:
        body.computeAABB()
        manager.registerObject(body)
    manager.setup()
    return manager


def mesh_of(solid: Solid) -> Any:
    """A tree of triangles."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(solid.faces), len(solid.vertices))
    model.addVertices(np.ascontiguousarray(solid.vertices))
    model.addTriangles(np.ascontiguousarray(solid.faces))
    model.endModel()
    model.computeLocalAABB()
    return model


def hull_of(solid: Solid) -> Any:
    """A convex polyhedron with its neighbours known, for supports by hill climbing."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in solid.vertices:
        points.append(vertex)
    for face in solid.faces.tolist():
        triangles.append(coal.Triangle(*face))
    shape = coal.Convex(points, triangles)
    shape.computeLocalAABB()
    return shape


def _convex(piece: Piece) -> Any:
    if piece.kind == "ball":
        shape = coal.Sphere(float(piece.size[0]))
    elif piece.kind == "box":
        shape = coal.Box(*piece.size.tolist())
    else:
        return hull_of(piece.solid)
    shape.computeLocalAABB()
    return shape


def _exact(item: Item) -> Any:
    piece = item.pieces[0]
    if piece.kind == "hull" or len(item.pieces) > 1:
        return mesh_of(item.surface)
    return _convex(piece)
