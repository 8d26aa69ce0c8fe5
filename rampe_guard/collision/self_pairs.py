"""Which links of an arm could hit each other.

All pairs but those that nothing can be said about: neighbours in the URDF, links that never move
against each other, pairs that the site allows, and pairs that touch in nearly all postures, since
their pins and bushes do.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.exact import inverse, place, surface, touching
from rampe_guard.core.scene import SELF_ZONE
from rampe_guard.core.sweep_problem import SelfZone
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    import fcl

    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.arm_motion import ArmMotion
    from rampe_guard.core.scene import SelfCollision
    from rampe_guard.core.types import FloatArray

POSTURES = 200
"""Drawn at random within the limits, the same ones at each start."""
ALWAYS = 0.95
"""A pair that touches in a larger share of them cannot help it."""

INSIDE = 0.5
"""Between the winding numbers outside and inside of a closed surface."""

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True)
class SelfZones:
    """Zones of an arm against itself.

    Attributes:
        zones: one for each link that others could hit, named for it; of two links the zone is
            the one nearer to the base.
        always: names of the pairs that were found to touch always, and are left out.
    """

    zones: tuple[SelfZone, ...] = ()
    always: tuple[tuple[str, str], ...] = ()


def self_zones(arm: Arm, motion: ArmMotion, asked: SelfCollision) -> SelfZones:
    """The zones of an arm against itself; none unless that is asked for.

    Raises:
        GeometryError: if a link that the site allows to touch is not there.
    """
    allowed = {frozenset(_named(arm, name) for name in pair) for pair in asked.allow}
    if not asked.enabled:
        return SelfZones()
    pairs = [pair for pair in movable_pairs(arm) if frozenset(pair) not in allowed]
    always = _always_touching(arm, motion, pairs)
    others: dict[int, list[int]] = {}
    for near, far in pairs:
        if (near, far) not in always:
            others.setdefault(near, []).append(far)
    names = arm.link_names
    return SelfZones(
        tuple(
            SelfZone(f"{SELF_ZONE}{names[near]}", asked.margin_m, near, tuple(far))
            for near, far in sorted(others.items())
        ),
        tuple((names[near], names[far]) for near, far in pairs if (near, far) in always),
    )


def movable_pairs(arm: Arm) -> list[Pair]:
    """Pairs of links with geometry that move against each other and are no neighbours."""
    frame = arm.chain.link_frame
    solid = [link for link, mesh in enumerate(arm.meshes) if mesh is not None]
    # links come parents first, level by level: the lower index is nearer to the base
    return [
        (near, far)
        for near, far in combinations(solid, 2)
        if frame[near] != frame[far] and _above(arm, far) != near
    ]


def _above(arm: Arm, link: int) -> int:
    """The next link with geometry on the way to the base, -1 if there is none."""
    link = arm.parents[link]
    while link >= 0 and arm.meshes[link] is None:
        link = arm.parents[link]
    return link


def _named(arm: Arm, name: str) -> int:
    if name not in arm.link_names:
        raise GeometryError(
            f"self_collision allows link '{name}' to touch; the arm has {', '.join(arm.link_names)}"
        )
    return arm.link_names.index(name)


def _always_touching(arm: Arm, motion: ArmMotion, pairs: list[Pair]) -> set[Pair]:
    """Pairs that touch in more than ALWAYS of all postures."""
    if not pairs:
        return set()
    bodies = {
        link: _Body(mesh)
        for link, mesh in enumerate(arm.meshes)
        if mesh is not None and any(link in pair for pair in pairs)
    }
    poses = motion.link_poses(_postures(arm.limits))
    enough = round(POSTURES * (1.0 - ALWAYS))
    found = set()
    for near, far in pairs:
        apart = 0
        for near_pose, far_pose in zip(poses[:, near], poses[:, far], strict=True):
            apart += not bodies[near].meets(near_pose, bodies[far], far_pose)
            if apart >= enough:
                break
        else:
            found.add((near, far))
    return found


def _postures(limits: FloatArray) -> FloatArray:
    """Actuator values (POSTURES, n) within the limits; a turn where there are none."""
    low = np.where(np.isfinite(limits[:, 0]), limits[:, 0], -np.pi)
    high = np.where(np.isfinite(limits[:, 1]), limits[:, 1], np.pi)
    return np.random.default_rng(1).uniform(low, high, size=(POSTURES, len(limits)))


class _Body:
    """A link as a surface in FCL, and as a solid that another may be wholly inside of."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._body: fcl.CollisionObject = surface(mesh.vertices, mesh.faces)
        self._mesh = mesh
        self._low, self._high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)

    def meets(self, pose: FloatArray, other: _Body, other_pose: FloatArray) -> bool:
        """Whether the two touch, or one is inside the other."""
        if touching(place(self._body, pose), place(other._body, other_pose)):
            return True
        between = inverse(pose) @ other_pose
        return self._holds(other, between) or other._holds(self, inverse(between))

    def _holds(self, other: _Body, pose: FloatArray) -> bool:
        """Whether another, apart from this surface and at ``pose`` in its frame, is inside."""
        point = pose[:3, :3] @ other._mesh.vertices[other._mesh.faces[0, 0]] + pose[:3, 3]
        if ((point < self._low) | (point > self._high)).any():
            return False
        return bool(abs(self._mesh.winding(point[None])[0]) > INSIDE)
