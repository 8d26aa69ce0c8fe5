"""`FclSweeper`: arm and scene, loaded and ready for certified sweeps."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.oracle import FclOracle
from rampe_guard.collision.pieces import piece_tree
from rampe_guard.collision.zones import Solid, build_zone
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.convex import ConvexPiece
from rampe_guard.core.scene import ActuatorLimit, Scene
from rampe_guard.core.sweep import sweep, uncomputed
from rampe_guard.core.sweep_path import ArmMotion
from rampe_guard.core.sweep_problem import PieceTree, SweepProblem, Zone
from rampe_guard.core.types import AnyPath
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.types import FloatArray, Placement, SweepResult

LINK_LEAVES = 32
LINK_EXCESS_M = 0.005


class FclSweeper:
    """Certified sweeps of one arm in one scene; implements `core.types.PathSweeper`.

    The same call gives the same answer whatever was swept before. Not for use by several
    threads at once: the FCL objects are moved.

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
        self._keyed = frozenset(item.name for item in scene.moving)
        self._config = SweepConfig() if config is None else config
        links = [
            None if mesh is None else piece_tree(mesh, LINK_EXCESS_M, LINK_LEAVES, measured=True)
            for mesh in arm.meshes
        ]
        points = [_vertices(tree) for tree in links]
        motion = ArmMotion(arm.chain, arm.joints, points, arm.proven[:, 0], arm.proven[:, 1])
        zones: list[Zone | ActuatorLimit] = []
        solids: list[Solid | None] = []
        for item in scene.objects:
            if isinstance(item, ActuatorLimit):
                zones.append(_checked(item, len(arm.limits)))
                solids.append(None)
            else:
                zone, solid = build_zone(item, arm.link_names)
                zones.append(zone)
                solids.append(solid)
        self._problem = SweepProblem(motion, arm.link_names, links, zones)
        self._oracle = FclOracle(self._problem, arm.meshes, solids)

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        """Sweep from ``start`` (n,) along ``displacement`` (n,), both in actuator units.

        Args:
            start: actuator values; NaN or infinity make every answer unknown.
            displacement: their change.
            any_path: also ask whether any monotone way to the end could touch.
            clearance: also find how near free zones come; without it they are sooner done and
                ``clearance_m`` is only what certifying them proved.
            only: names of the zones that are asked about; None asks about all.
            placed: where the keyed objects stand; not used yet, so each of them is unknown.

        Raises:
            ValueError: if a shape is wrong.
        """
        begin = perf_counter()
        del placed
        asked = frozenset(self.zones if only is None else only)
        result = sweep(
            self._problem,
            self._oracle,
            self._config,
            start,
            displacement,
            clearance=clearance,
            any_path=any_path,
            only=only if self._keyed.isdisjoint(asked) else asked - self._keyed,
        )
        result = self._with_unknown(result, asked & self._keyed)
        return replace(result, elapsed_ms=1e3 * (perf_counter() - begin))

    def _with_unknown(self, result: SweepResult, names: frozenset[str]) -> SweepResult:
        """``result`` with the zones of these names in it, unknown, in scene order."""
        if not names:
            return result
        found = {zone.zone: zone for zone in result.zones}
        found |= {name: uncomputed(name) for name in names}
        any_path = result.any_path
        if any_path is AnyPath.FREE:
            any_path = AnyPath.UNKNOWN
        zones = tuple(found[name] for name in self.zones if name in found)
        return replace(result, zones=zones, any_path=any_path)

    def link_poses(self, actuators: FloatArray) -> FloatArray:
        """World poses (k, L, 4, 4) of all links for actuator values (k, n)."""
        return self._problem.arm.link_poses(np.asarray(actuators, dtype=float))


def _vertices(tree: PieceTree | None) -> FloatArray:
    if tree is None or not isinstance(tree.piece, ConvexPiece):
        return np.zeros((0, 3))
    return tree.piece.vertices


def _checked(item: ActuatorLimit, actuators: int) -> ActuatorLimit:
    if not 0 <= item.actuator < actuators:
        raise GeometryError(
            f"zone '{item.name}' is about actuator {item.actuator}; the arm has {actuators}"
        )
    edges = [edge for edge in (item.above, item.below) if edge is not None]
    if not edges or not np.isfinite(edges).all():
        raise GeometryError(f"zone '{item.name}' needs a finite 'above' or 'below'")
    return item
