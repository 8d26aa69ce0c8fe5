"""Dense sampling, the common way: is any link in collision at this sample, at the next one, ...

The fractions to look at are given to all of them for nothing, and poses come from one compiled
call. Links that stand still are not asked again. Each has its objects in its own best form and
its own broad phase over the scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import fcl
import numpy as np
import trimesh

from tests.benchmarks.peers.judge import bvh
from tests.benchmarks.peers.posing import Posing

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Item, Work


class Dense:
    """Samples of every motion ``step_m`` apart; subclasses know how to ask about one."""

    def __init__(self, work: Work, step_m: float = 0.005) -> None:
        self._posing = Posing(work.machine)
        self._motions = work.motions
        self.fractions = [self._posing.samples(motion, step_m) for motion in work.motions]
        frames = [work.machine.arm.chain.link_frame[link] for link in work.machine.links]
        self.moving = [k for k, frame in enumerate(frames) if frame > 0]

    def first_contact(self, number: int) -> float | None:
        """The first sample in collision."""
        fractions = self.fractions[number]
        rotations, translations = self._posing.poses(self._motions[number], fractions)
        for k in range(len(fractions)):
            if self.touches(rotations[k], translations[k]):
                return float(fractions[k])
        return None

    def touches(self, rotations: FloatArray, translations: FloatArray) -> bool:
        """Whether links at these poses (L, 3, 3), (L, 3) touch anything."""
        raise NotImplementedError


class DenseFcl(Dense):
    """python-fcl: meshes of the links against primitives and meshes in a dynamic tree."""

    def __init__(self, work: Work, step_m: float = 0.005) -> None:
        super().__init__(work, step_m)
        self._links = [fcl.CollisionObject(bvh(mesh)) for mesh in work.machine.meshes]
        self._scene = fcl.DynamicAABBTreeCollisionManager()
        self._keep = [_fcl_object(item) for item in work.items]
        self._scene.registerObjects(self._keep)
        self._scene.setup()
        self._arm = fcl.DynamicAABBTreeCollisionManager()
        self._arm.registerObjects([self._links[link] for link in self.moving])
        self._arm.setup()

    def touches(self, rotations: FloatArray, translations: FloatArray) -> bool:
        """Tree against tree."""
        for link in self.moving:
            pose = fcl.Transform(rotations[link], translations[link])
            self._links[link].setTransform(pose)
        self._arm.update()
        data = fcl.CollisionData()
        self._scene.collide(self._arm, data, fcl.defaultCollisionCallback)
        return bool(data.result.is_collision)


class DenseTrimesh(Dense):
    """trimesh's `CollisionManager`: meshes only, so balls are polyhedra."""

    def __init__(self, work: Work, step_m: float = 0.005) -> None:
        super().__init__(work, step_m)
        self._arm = trimesh.collision.CollisionManager()
        self._scene = trimesh.collision.CollisionManager()
        for link in self.moving:
            mesh = work.machine.meshes[link]
            shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
            self._arm.add_object(str(link), shape)
        for number, item in enumerate(work.items):
            surface = trimesh.Trimesh(item.surface.vertices, item.surface.faces, process=False)
            self._scene.add_object(str(number), surface, item.pose)
        self._pose = np.eye(4)

    def touches(self, rotations: FloatArray, translations: FloatArray) -> bool:
        """Both managers against each other."""
        for link in self.moving:
            self._pose[:3, :3], self._pose[:3, 3] = rotations[link], translations[link]
            self._arm.set_transform(str(link), self._pose)
        return bool(self._arm.in_collision_other(self._scene))


def _fcl_object(item: Item) -> Any:
    pose = fcl.Transform(item.pose[:3, :3], item.pose[:3, 3])
    piece = item.pieces[0]
    if piece.kind == "ball":
        return fcl.CollisionObject(fcl.Sphere(float(piece.size[0])), pose)
    if piece.kind == "box" and len(item.pieces) == 1:
        return fcl.CollisionObject(fcl.Box(*piece.size), pose)
    return fcl.CollisionObject(bvh(item.surface), pose)
