"""Who is right: dense samples of the motion every millimetre, and exact distances.

The samples are asked of coal's `collide` (of FCL's where coal is missing) on the exact meshes, the
distances of FCL between triangles, boxes and points: what was measured to be right to 0.3 µm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import fcl
import numpy as np

from tests.benchmarks.peers.posing import Posing
from tests.benchmarks.peers.work import Solid

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Item, Motion, Work

STEP_M = 0.001
TOUCHING_M = 1e-9
SPECK_M = 1e-7
FAR_M = 1e3


@dataclass(frozen=True, slots=True)
class Verdict:
    """How one answer compares with the truth.

    Attributes:
        missed: contact, called free.
        false: called contact where the exact clearance is more than twice the tolerance.
        late_m: by how much motion it was called after the first sample in contact; None if not.
        early_m: by how much before it.
    """

    missed: bool
    false: bool
    late_m: float | None
    early_m: float | None


class Judge:
    """Exact clearances of a machine in a scene."""

    def __init__(self, work: Work, posing: Posing | None = None) -> None:
        self.work = work
        self.posing = Posing(work.machine) if posing is None else posing
        machine = work.machine
        self._links = [fcl.CollisionObject(bvh(mesh)) for mesh in machine.meshes]
        self._hulls = [hull.vertices for hull in machine.hulls]
        self._balls = np.array([_ball(vertices) for vertices in self._hulls])
        self._bodies = [_body(item) for item in work.items]
        self._item_balls = np.array([_item_ball(item) for item in work.items]).reshape(-1, 4)
        self._request = fcl.DistanceRequest()

    def clearance(self, motion: Motion, fraction: float, far: float = FAR_M) -> float:
        """Least distance of any link from any object there [m], or ``far`` if that is less."""
        rotations, translations = self.posing.poses(motion, np.array([fraction]))
        best = far
        for k, link in enumerate(self._links):
            rotation, translation = rotations[0, k], translations[0, k]
            center = rotation @ self._balls[k, :3] + translation
            away = np.linalg.norm(self._item_balls[:, :3] - center, axis=1)
            away -= self._item_balls[:, 3] + self._balls[k, 3]
            link.setTransform(fcl.Transform(rotation, translation))
            for i in np.argsort(away):
                if away[i] >= best:
                    break
                best = min(best, self._distance(link, int(i)))
        return best

    def starts_free(self, motion: Motion) -> bool:
        """Whether the start is clear by three tolerances, and nothing is inside anything."""
        enough = 3.0 * self.work.machine.tolerance_m
        if self.clearance(motion, 0.0, far=2.0 * enough) < enough:
            return False
        rotations, translations = self.posing.poses(motion, np.zeros(1))
        points = np.array(
            [
                rotations[0, k] @ vertices[0] + translations[0, k]
                for k, vertices in enumerate(self._hulls)
            ]
        )
        for piece in self.work.pieces:
            local = (points - piece.pose[:3, 3]) @ piece.pose[:3, :3]
            vertices = piece.solid.vertices
            inside = (local > vertices.min(axis=0)) & (local < vertices.max(axis=0))
            if inside.all(axis=1).any():
                return False
        centers = self._item_balls[:, None, :3] - translations[0]
        near = np.linalg.norm(centers - _turned(rotations[0], self._balls), axis=2)
        return not bool((near < 0.3 * self._balls[:, 3]).any())

    def verdict(
        self,
        motion: Motion,
        truth: float | None,
        said: float | None,
        way: tuple[FloatArray, FloatArray],
    ) -> Verdict:
        """Compare an answer with the first sample in contact, ``truth``."""
        if said is None:
            return Verdict(truth is not None, false=False, late_m=None, early_m=None)
        tolerance = self.work.machine.tolerance_m
        false = self.clearance(motion, said, far=3.0 * tolerance) > 2.0 * tolerance
        if truth is None:
            return Verdict(missed=False, false=false, late_m=None, early_m=None)
        here, there = (float(np.interp(at, way[0], way[1])) for at in (said, truth))
        gone = here - there
        if gone > TOUCHING_M:
            # past the contact the arm may be clear again: late is late, not false
            return Verdict(missed=False, false=False, late_m=gone, early_m=None)
        return Verdict(missed=False, false=false, late_m=None, early_m=-gone)

    def _distance(self, link: Any, i: int) -> float:
        body, radius = self._bodies[i]
        result = fcl.DistanceResult()
        distance = fcl.distance(link, body, self._request, result) - radius
        return 0.0 if not distance > TOUCHING_M else float(distance)


def bvh(solid: Solid) -> Any:
    """FCL's tree of triangles."""
    model = fcl.BVHModel()
    model.beginModel(len(solid.vertices), len(solid.faces))
    model.addSubModel(solid.vertices, solid.faces)
    model.endModel()
    return model


def _body(item: Item) -> tuple[Any, float]:
    """An FCL object, and by how much it has to be grown [m]: a ball is a point that is grown."""
    pose = fcl.Transform(item.pose[:3, :3], item.pose[:3, 3])
    piece = item.pieces[0]
    if piece.kind == "ball":
        speck = Solid(SPECK_M * np.eye(3), np.array([[0, 1, 2]]))
        return fcl.CollisionObject(bvh(speck), pose), float(piece.size[0])
    if piece.kind == "box" and len(item.pieces) == 1:
        return fcl.CollisionObject(fcl.Box(*piece.size), pose), 0.0
    return fcl.CollisionObject(bvh(item.surface), pose), 0.0


def _ball(vertices: FloatArray) -> list[float]:
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    return [*middle.tolist(), float(np.linalg.norm(vertices - middle, axis=1).max())]


def _item_ball(item: Item) -> list[float]:
    x, y, z, radius = _ball(item.surface.vertices)
    center = item.pose[:3, :3] @ np.array([x, y, z]) + item.pose[:3, 3]
    return [*center.tolist(), radius * 1.01]


def _turned(rotations: FloatArray, balls: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("lij,lj->li", rotations, balls[:, :3]))
