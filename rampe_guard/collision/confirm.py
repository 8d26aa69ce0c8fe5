"""A second opinion on contacts: FCL's `collide` on the exact shapes, where the sweep saw one.

The sweep ends in the exact triangles, so a contact with a link's hollow or bend is none for it
either. That is confirmed here by code that shares nothing with it. What FCL denies stays a
contact: it may be a graze that is none at the very posture that is asked about.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from rampe_guard.collision.exact import exact_shape, inverse, place, surface, touching
from rampe_guard.core.bounding_tree import NONE
from rampe_guard.core.kinematics import skew
from rampe_guard.core.scene import Halfspace, Mesh

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import fcl

    from rampe_guard.core.bounding_tree import BoundingTree
    from rampe_guard.core.kinematics import Chain, JointMap
    from rampe_guard.core.scene import SolidObject
    from rampe_guard.core.types import FloatArray

    _Joint = tuple[JointMap, FloatArray, FloatArray, FloatArray | None]

WHOLE = 4_000
"""A surface of at most so many triangles is asked about as a whole: some 30 ms to build, once."""
PATCH = 2_000
"""Of a larger one, so many triangles nearest to the contact."""
KEPT = 16
"""Patches of one surface that are kept."""


class Confirmer:
    """Exact shapes of an arm and its scene, built when first asked about."""

    def __init__(
        self,
        links: Sequence[BoundingTree | None],
        zones: Iterable[tuple[SolidObject, BoundingTree]],
    ) -> None:
        """Take trees of links in their own frames, and each object with its tree."""
        self._links = [None if tree is None else _Surface(tree) for tree in links]
        self._zones = {
            item.name: _Surface(tree) if isinstance(item, Mesh) else exact_shape(item)
            for item, tree in zones
            if not isinstance(item, Halfspace)  # not safe in FCL
        }

    def knows(self, zone: str) -> bool:
        """Whether there is an object of this name that FCL may be asked about."""
        return zone in self._zones

    def touches(self, link: int, pose: FloatArray, zone: str, point: FloatArray) -> bool:
        """Whether a link with geometry touches an object that is known.

        Args:
            link: its index.
            pose: where it is (4, 4), in the frame in which the scene gives the object.
            zone: name of the object.
            point: about where it touches (3,), in that frame [m].
        """
        mine, other = self._links[link], self._zones[zone]
        assert mine is not None  # noqa: S101  # for the reader of types
        back = inverse(pose)
        body = mine.near(back[:3, :3] @ point + back[:3, 3])
        return touching(
            place(body, pose), other.near(point) if isinstance(other, _Surface) else other
        )


class LinkPoses:
    """Where one link is, without posing all others."""

    def __init__(self, chain: Chain, joints: Sequence[JointMap]) -> None:
        self._chain, self._joints = chain, joints
        self._ways = [self._way(frame) for frame in chain.link_frame]

    def pose(self, link: int, q: FloatArray) -> FloatArray:
        """World pose (4, 4) of a link at actuator values (n,)."""
        pose = np.eye(4)
        for joint, origin, first, second in self._ways[link]:
            theta = joint.scalar(float(q[joint.actuator]))
            if second is None:  # it slides
                pose = pose @ (origin + theta * first)
            else:
                turned = math.sin(theta) * first + (1.0 - math.cos(theta)) * second
                pose = pose @ (origin + turned)
        return np.asarray(pose @ self._chain.link_origin[link])

    def _way(self, frame: int) -> list[_Joint]:
        """The joints from the world to a frame; `kinematics.ForwardKinematics` has the formula."""
        way: list[_Joint] = []
        while frame:
            j, chain = frame - 1, self._chain
            first, second = np.zeros((4, 4)), None
            if chain.revolute[j]:
                first[:3, :3] = skew(chain.axis[j])
                second = chain.origin[j] @ first @ first
            else:
                first[:3, 3] = chain.axis[j]
            way.insert(0, (self._joints[j], chain.origin[j], chain.origin[j] @ first, second))
            frame = chain.parent[j]
        return way


@dataclass(frozen=True, slots=True)
class _Patch:
    """A body that holds all of its surface within ``reach`` of ``center`` [m]."""

    body: fcl.CollisionObject
    center: FloatArray
    reach: float


class _Surface:
    """A mesh, whole or, if it is large, its parts near a point."""

    def __init__(self, tree: BoundingTree) -> None:
        self._tree = tree
        self._patches: list[_Patch] = []

    def near(self, point: FloatArray) -> fcl.CollisionObject:
        """What there is of it about a point (3,) [m]."""
        for patch in reversed(self._patches):
            if 2.0 * math.dist(point, patch.center) <= patch.reach:
                return patch.body
        corners, reach = triangles_near(self._tree, point)
        body = surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        self._patches = [*self._patches[1 - KEPT :], _Patch(body, point, reach)]
        return body


def triangles_near(tree: BoundingTree, point: FloatArray) -> tuple[FloatArray, float]:
    """Triangles (k, 3, 3) of a mesh's tree about a point (3,) [m].

    Returns:
        All of them and infinity, or, of more than WHOLE, at least the PATCH nearest, and the
        distance within which none is missing [m].
    """
    most = np.inf if len(tree.corners) <= WHOLE else PATCH
    balls = tree.ball
    waiting = [(0.0, 0)]
    found: list[FloatArray] = []
    count = 0
    while waiting and count < most:
        _, node = heapq.heappop(waiting)
        if tree.left[node] == NONE:
            found.append(_leaf(tree, node))
            count += len(found[-1])
            continue
        for child in (int(tree.left[node]), int(tree.right[node])):
            away = float(np.linalg.norm(balls[child, :3] - point)) - float(balls[child, 3])
            heapq.heappush(waiting, (away, child))
    return np.concatenate(found), max(waiting[0][0], 0.0) if waiting else np.inf


def _leaf(tree: BoundingTree, node: int) -> FloatArray:
    """Triangles (k, 3, 3) of a leaf; those of its hull if it is a convex part."""
    first, count = int(tree.triangle_first[node]), int(tree.triangle_count[node])
    if count:
        return tree.corners[first : first + count]
    first, count = int(tree.first[node]), int(tree.count[node])
    vertices = tree.vertices[first : first + count]
    return np.asarray(vertices[ConvexHull(vertices).simplices])
