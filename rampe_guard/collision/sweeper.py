"""`FclSweeper`: arm and scene, loaded and ready for certified sweeps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.confirm import Confirmer, LinkPoses
from rampe_guard.collision.exact import inverse
from rampe_guard.collision.self_pairs import self_zones
from rampe_guard.collision.shape_cache import cached_shape, default_cache
from rampe_guard.collision.zones import about, build_zone
from rampe_guard.core.arm_motion import ArmMotion
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.scene import ActuatorLimit, Scene, SelfCollision, SolidObject
from rampe_guard.core.sweep import Sweep
from rampe_guard.core.sweep_problem import SelfZone, SweepProblem, Zone
from rampe_guard.core.types import Certificate
from rampe_guard.errors import GeometryError
from rampe_guard.kernel_cache import one_at_a_time

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.shape_cache import ShapeCache
    from rampe_guard.collision.tree_split import Progress
    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.bounding_tree import BoundingTree
    from rampe_guard.core.types import FloatArray, Placement, SweepResult, ZoneSweep


@dataclass(frozen=True, slots=True)
class Body:
    """What an arm brings into every scene.

    Attributes:
        links: shape of each link, None for those without geometry.
        motion: where they are, and how fast they can move.
        zones: of the arm against itself.
        always_touching: pairs of links that were found to touch always, and are left out.
    """

    links: list[BoundingTree | None]
    motion: ArmMotion
    zones: tuple[SelfZone, ...]
    always_touching: tuple[tuple[str, str], ...]

    @classmethod
    def build(
        cls, arm: Arm, cache: ShapeCache, allowed: SelfCollision, progress: Progress | None
    ) -> Body:
        """Build it, or fetch the shapes from where they are kept."""
        links = _link_trees(arm, cache, progress)
        points = [_points(tree) for tree in links]
        motion = ArmMotion(arm.chain, arm.joints, points, arm.proven[:, 0], arm.proven[:, 1])
        own = self_zones(arm, motion, allowed)
        return cls(links, motion, tuple(own.zones), own.always)


class FclSweeper:
    """Certified sweeps of one arm in one scene; implements `core.types.PathSweeper`.

    Not for use by several threads at once: the room that sweeps work in is shared.

    Attributes:
        arm: as given.
        scene: as given.
        zones: names of all zones, in scene order, then those of the arm against itself.
        always_touching: pairs of links that were found to touch always, and are left out.
        notes: sentences on what was mended or is remarkable in meshes.
    """

    def __init__(
        self,
        arm: Arm,
        scene: Scene,
        config: SweepConfig | None = None,
        self_collision: SelfCollision | None = None,
        *,
        progress: Progress | None = None,
        body: Body | None = None,
    ) -> None:
        """Build all shapes, or fetch them from where they are kept, and sweep once.

        Args:
            arm: from `load_arm`.
            scene: its objects.
            config: tolerances and budget.
            self_collision: whether the arm is swept against itself; not, if left out.
            progress: told what is done, and which share of it.
            body: of the same arm, which then need not be built.

        Raises:
            GeometryError: if an object of the scene cannot be used, or a link is named that the
                arm has not.
        """
        self.arm, self.scene = arm, scene
        config = SweepConfig() if config is None else config
        cache = default_cache()
        body = body or Body.build(arm, cache, self_collision or SelfCollision(), progress)
        zones: list[Zone | SelfZone | ActuatorLimit] = []
        solid: list[tuple[SolidObject, BoundingTree]] = []
        notes = list(arm.notes)
        for item in scene.objects:
            if isinstance(item, ActuatorLimit):
                zones.append(_checked(item, len(arm.limits)))
            else:
                built = build_zone(item, arm.link_names, cache=cache, progress=progress)
                zones.append(built.zone)
                solid.append((item, built.zone.tree))
                notes += built.notes
        zones += body.zones
        self.zones = tuple(zone.name for zone in zones)
        self.always_touching = body.always_touching
        self.notes = tuple(notes)
        self._body, self._config = body, config
        self._motion = body.motion
        self._behind_m = config.tolerance_m
        self._link_of = {name: link for link, name in enumerate(arm.link_names)}
        self._link_poses = LinkPoses(arm.chain, arm.joints)
        self._confirmer = Confirmer(body.links, solid)
        problem = SweepProblem(body.motion, arm.link_names, body.links, zones)
        self._sweep = Sweep(problem, config)
        self._warm_up()

    def in_scene(self, scene: Scene) -> FclSweeper:
        """The same arm in another scene; what two sweepers share, neither writes.

        Raises:
            GeometryError: an object of the scene cannot be used.
        """
        return FclSweeper(self.arm, scene, self._config, body=self._body)

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
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
            wider_m: certificates are about margins of solid zones wider by so much [m];
                clearances still count from the margins themselves.
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
            wider_m=wider_m,
            any_path=any_path,
            only=only,
            placed=placed,
            worst=worst,
        )
        if wider_m == 0.0 and any(_to_be_confirmed(entry) for entry in result.zones):
            told = [self._confirmed(e, start, displacement, placed or {}) for e in result.zones]
            result = replace(result, zones=tuple(told))
        return replace(result, elapsed_ms=1e3 * (perf_counter() - begin))

    def _confirmed(
        self,
        entry: ZoneSweep,
        start: FloatArray,
        displacement: FloatArray,
        placed: Mapping[str, Placement | None],
    ) -> ZoneSweep:
        """The entry with FCL's opinion on its contact, where that can be had."""
        where = placed.get(entry.zone)
        if not _to_be_confirmed(entry) or not self._confirmer.knows(entry.zone):
            return entry
        if where is not None and where.grown_m > 0.0:
            return entry
        start, displacement = np.asarray(start, dtype=float), np.asarray(displacement, dtype=float)
        link = self._link_of[str(entry.link)]
        fraction = entry.confirmed_fraction
        if fraction is None:  # the bound ended at the contact itself: ask just behind it
            motion = self._motion
            rate = float(np.abs(displacement)[motion.actuator] @ motion.coefficients[:, link])
            fraction = min(1.0, (entry.contact_fraction or 0.0) + self._behind_m / rate)
        pose = self._link_poses.pose(link, start + fraction * displacement)
        point = np.asarray(entry.contact_point_m)
        if where is not None:  # the scene gives the object in its own frame
            back = inverse(where.pose)
            pose, point = back @ pose, back[:3, :3] @ point + back[:3, 3]
        return replace(entry, confirmed=self._confirmer.touches(link, pose, entry.zone, point))

    def _warm_up(self) -> None:
        """Sweep once, so that nothing is compiled or loaded any more when it counts."""
        ends = np.where(np.isfinite(self.arm.limits), self.arm.limits, 0.0)
        with one_at_a_time():
            for worst in (False, True):
                self.sweep(ends.mean(axis=1), np.zeros(len(ends)), any_path=not worst, worst=worst)

    def link_poses(self, actuators: FloatArray) -> FloatArray:
        """World poses (k, L, 4, 4) of all links for actuator values (k, n)."""
        return self._motion.link_poses(np.asarray(actuators, dtype=float))


def _link_trees(
    arm: Arm, cache: ShapeCache, progress: Progress | None
) -> list[BoundingTree | None]:
    """The shapes of all links, None for those without geometry."""
    trees: list[BoundingTree | None] = []
    for name, mesh in zip(arm.link_names, arm.meshes, strict=True):
        if mesh is None:
            trees.append(None)
            continue
        say = None if progress is None else about(progress, f"link {name}")
        trees.append(cached_shape(mesh, cache=cache, progress=say).tree)
    return trees


def _to_be_confirmed(entry: ZoneSweep) -> bool:
    """A contact with an object itself, later than the start: FCL knows no margins."""
    return (
        entry.certificate is Certificate.CONTACT
        and entry.margin_m == 0.0
        and bool(entry.contact_fraction)
    )


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
