"""`FclSweeper`: arm and scene, loaded and ready for certified sweeps."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.tree_build import build_tree
from rampe_guard.collision.zones import build_zone
from rampe_guard.core.arm_motion import ArmMotion
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.scene import ActuatorLimit, Scene
from rampe_guard.core.sweep import Sweep
from rampe_guard.core.sweep_problem import SweepProblem, Zone
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.bounding_tree import BoundingTree
    from rampe_guard.core.types import FloatArray, Placement, SweepResult


class FclSweeper:
    """Certified sweeps of one arm in one scene; implements `core.types.PathSweeper`.

    Not for use by several threads at once: the room that sweeps work in is shared.

    Attributes:
        arm: as given.
        scene: as given.
        zones: names of all zones, in scene order.
    """

    def __init__(self, arm: Arm, scene: Scene, config: SweepConfig | None = None) -> None:
        """Build all shapes.

        Raises:
            GeometryError: if an object of the scene cannot be used.
        """
        self.arm, self.scene = arm, scene
        self.zones = tuple(item.name for item in scene.objects)
        config = SweepConfig() if config is None else config
        links = [None if mesh is None else build_tree(mesh) for mesh in arm.meshes]
        points = [_points(tree) for tree in links]
        motion = ArmMotion(arm.chain, arm.joints, points, arm.proven[:, 0], arm.proven[:, 1])
        zones: list[Zone | ActuatorLimit] = []
        for item in scene.objects:
            if isinstance(item, ActuatorLimit):
                zones.append(_checked(item, len(arm.limits)))
            else:
                built = build_zone(item, arm.link_names)
                zones.append(built.zone)
        self._motion = motion
        self._sweep = Sweep(SweepProblem(motion, arm.link_names, links, zones), config)

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
        worst: bool = False,
    ) -> SweepResult:
        """Sweep from ``start`` (n,) along ``displacement`` (n,), both in actuator units.

        Args:
            start: actuator values; NaN or infinity make every answer unknown.
            displacement: their change.
            any_path: also ask whether any monotone way to the end could touch.
            clearance: also find how near free zones come; without it they are sooner done and
                ``clearance_m`` is only what certifying them proved.
            only: names of the zones that are asked about; None asks about all.
            placed: where the keyed objects stand; one without a placement is unknown.
            worst: only the worst of all solid zones is wanted.

        Raises:
            ValueError: if a shape is wrong.
        """
        begin = perf_counter()
        result = self._sweep.run(
            start,
            displacement,
            clearance=clearance,
            any_path=any_path,
            only=only,
            placed=placed,
            worst=worst,
        )
        return replace(result, elapsed_ms=1e3 * (perf_counter() - begin))

    def link_poses(self, actuators: FloatArray) -> FloatArray:
        """World poses (k, L, 4, 4) of all links for actuator values (k, n)."""
        return self._motion.link_poses(np.asarray(actuators, dtype=float))


def _points(tree: BoundingTree | None) -> FloatArray:
    """Points whose hull holds a link."""
    if tree is None:
        return np.zeros((0, 3))
    return np.concatenate([tree.vertices, tree.corners.reshape(-1, 3)])


def _checked(item: ActuatorLimit, actuators: int) -> ActuatorLimit:
    if not 0 <= item.actuator < actuators:
        raise GeometryError(
            f"zone '{item.name}' is about actuator {item.actuator}; the arm has {actuators}"
        )
    edges = [edge for edge in (item.above, item.below) if edge is not None]
    if not edges or not np.isfinite(edges).all():
        raise GeometryError(f"zone '{item.name}' needs a finite 'above' or 'below'")
    return item
