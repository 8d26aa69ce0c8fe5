"""A motion whose answers are known beforehand: does this machine still compute what is true?

Two boxes stand in the way and beside the way of the arm's outermost link, placed so that plain
arithmetic on the link's vertices proves what every answer must be:

* ``hit`` has a vertex of the link for its centre at a known fraction of the motion, so contact is
  certain there, and a plane proves that there is none before another known fraction;
* ``miss`` lies beyond all that the link reaches, by a gap that is exact at one posture.

Neither proof asks the sweep or FCL, which are the ones on trial: the sweep by its kernels, as
the guard asks it, and FCL by `collide` and `distance` on the exact meshes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import fcl
import numpy as np

from rampe_guard.collision.mesh import box_mesh
from rampe_guard.collision.sweeper import FclSweeper
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.kinematics import apply
from rampe_guard.core.scene import Box, Scene
from rampe_guard.core.types import Certificate
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.types import FloatArray, SweepResult

SAMPLES = 65
"""Postures of the motion that are looked at when the boxes are placed."""
HIT_SAMPLE = 48
"""The posture at which ``hit`` is centred on a vertex: three quarters of the way."""
SHARE = 0.1
"""Of its travel that every actuator goes."""
ENDLESS = 0.2
"""How far an actuator goes that has no limits [unit]."""
SIZE = 0.05
"""Half an edge of the boxes, as a share of the link's size."""
SHARP = 0.25
"""How far below the clearance of ``miss`` the sweep may stay, as a share of it."""
EXACT_M = 1e-5
"""`distance` of FCL between meshes is within 3e-7 m of the truth [m]."""


@dataclass(frozen=True, slots=True)
class Known:
    """What the answers must be.

    Attributes:
        start, displacement: (n,) of the motion [unit].
        earliest, latest: the fractions between which the sweep must find the contact with ``hit``.
        least, most: the clearances between which the sweep must find ``miss`` [m].
        gap: distance of link and ``miss`` at one posture [m].
    """

    start: FloatArray
    displacement: FloatArray
    earliest: float
    latest: float
    least: float
    most: float
    gap: float


class Canary:
    """Asks the questions of one arm.

    Args:
        arm: whose outermost link moves.
        config: tolerances of the sweep on trial; its budget is not taken over, so that a site
            that is short of it is not taken for broken.

    Raises:
        GeometryError: no link has a mesh.
    """

    def __init__(self, arm: Arm, config: SweepConfig | None = None) -> None:
        config = SweepConfig() if config is None else config
        config = replace(config, max_queries=max(config.max_queries, SweepConfig().max_queries))
        link, mesh = _outermost(arm)
        self._link = arm.link_names[link]
        # no other link: each would ask for a tree of its own, and for time at every check
        only = replace(
            arm, meshes=tuple(m if i == link else None for i, m in enumerate(arm.meshes))
        )
        start, displacement = _motion(arm)
        ways = start + np.linspace(0.0, 1.0, SAMPLES)[:, None] * displacement
        poses = FclSweeper(only, Scene(())).link_poses(ways)[:, link]
        self._known, hit, miss, at = _placed(mesh, poses, start, displacement, config)
        sharp = replace(config, clearance_tolerance_m=SHARP * self._known.gap)
        self._sweeper = FclSweeper(only, Scene((hit, miss)), sharp)
        self._hit = _pair(mesh, poses[HIT_SAMPLE], hit)
        self._miss = _pair(mesh, poses[at], miss)

    def check(self) -> str | None:
        """None if all answers are right, else a sentence on the first that is not."""
        try:
            return self._swept() or self._collided() or self._measured()
        except Exception as error:  # noqa: BLE001 - whatever it is, it is no right answer
            return f"the test motion raised {type(error).__name__}: {error}"

    def _swept(self) -> str | None:
        known = self._known
        result = self._sweeper.sweep(known.start, known.displacement)
        wrong = _judged(result, known, self._link)
        # another answer in between: a sweep that does nothing would repeat its last one
        still = self._sweeper.sweep(known.start, np.zeros_like(known.start))
        if wrong is None and known.earliest > 0.0 and still.certificate is not Certificate.FREE:
            wrong = f"the sweep called an arm that stands clear {still.certificate}"
        return wrong

    def _collided(self) -> str | None:
        for pair, told, right in ((self._hit, "apart", True), (self._miss, "in contact", False)):
            if bool(fcl.collide(*pair, fcl.CollisionRequest(), fcl.CollisionResult())) is not right:
                return f"FCL collide called the {'hit' if right else 'miss'} {told}"
        return None

    def _measured(self) -> str | None:
        distance = float(fcl.distance(*self._miss, fcl.DistanceRequest(), fcl.DistanceResult()))
        gap = self._known.gap
        if abs(distance - gap) <= EXACT_M:
            return None
        return f"FCL distance said {distance:.6g} m where it is {gap:.6g} m"


def _judged(result: SweepResult, known: Known, link: str) -> str | None:
    """What is wrong with a sweep of both boxes, if anything."""
    names = [zone.zone for zone in result.zones]
    if names != ["hit", "miss"]:
        return f"the sweep answered about {names}"
    hit, miss = result.zones
    at, clearance = hit.contact_fraction, miss.clearance_m
    wrong = None
    if hit.certificate is not Certificate.CONTACT or at is None:
        wrong = f"called a sure contact {hit.certificate}"
    elif not known.earliest <= at <= known.latest:
        wrong = f"put a contact at {at:.4f} of the way, not {known.earliest:.4f}…{known.latest:.4f}"
    elif hit.link != link:
        wrong = f"named link {hit.link} where {link} touches"
    elif miss.certificate is not Certificate.FREE or clearance is None:
        wrong = f"called a free way {miss.certificate}"
    elif not known.least <= clearance <= known.most:
        wrong = f"measured {clearance:.6g} m, not {known.least:.6g}…{known.most:.6g} m"
    return None if wrong is None else f"the sweep {wrong}"


def _outermost(arm: Arm) -> tuple[int, TriangleMesh]:
    """The link with a mesh that most driven joints carry, the last of equals."""
    depth = np.concatenate([[0.0], arm.chain.ancestors().sum(axis=0) + 1.0])
    best: tuple[float, int, TriangleMesh] | None = None
    for link, mesh in enumerate(arm.meshes):
        joints = float(depth[arm.chain.link_frame[link]])
        if mesh is not None and (best is None or joints >= best[0]):
            best = joints, link, mesh
    if best is None:
        raise GeometryError(f"arm '{arm.name}' has no link with a mesh")
    return best[1], best[2]


def _motion(arm: Arm) -> tuple[FloatArray, FloatArray]:
    """Start and displacement (n,): across the middle of every actuator's travel."""
    low, high = arm.limits.T
    travel = ENDLESS / SHARE
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high, 0.5 * travel) - travel)
    high = np.where(np.isfinite(high), high, low + travel)
    displacement = SHARE * (high - low)
    return 0.5 * (low + high - displacement), displacement


def _placed(
    mesh: TriangleMesh,
    poses: FloatArray,
    start: FloatArray,
    displacement: FloatArray,
    config: SweepConfig,
) -> tuple[Known, Box, Box, int]:
    """Both boxes, what is known of them, and the posture (index) at which ``gap`` is exact.

    Let n be the way of the vertex that goes farthest. ``hit`` is centred where the link is
    outermost along n at `HIT_SAMPLE`, ``miss`` stands beyond the outermost of all postures.
    """
    points = np.stack([apply(pose, mesh.vertices) for pose in poses])  # (k, v, 3)
    way = points[-1] - points[0]
    way = way[np.argmax(np.linalg.norm(way, axis=1))]
    length = float(np.linalg.norm(way))
    n = way / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    along = points @ n  # (k, v)
    outermost = along.max(axis=1)
    # a vertex is never this far from its nearer posture: twice the half of a chord, for the bend
    step = float(np.linalg.norm(np.diff(points, axis=0), axis=2).max())
    half = SIZE * float(np.ptp(mesh.vertices, axis=0).max())
    tolerance = config.tolerance_m

    center = points[HIT_SAMPLE, np.argmax(along[HIT_SAMPLE])]
    front = float(center @ n) - half
    clear = outermost + step + 2.0 * tolerance < front
    first = int(np.argmin(clear))  # the first posture that is not surely clear
    at = int(np.argmax(outermost))
    gap = 4.0 * tolerance + 2.0 * step + half
    beside = points[at, np.argmax(along[at])] + (gap + half) * n
    rounding = 1e-9 * (1.0 + float(np.abs(points).max()))
    known = Known(
        start=start,
        displacement=displacement,
        earliest=max(first - 1, 0) / (SAMPLES - 1),
        latest=HIT_SAMPLE / (SAMPLES - 1) + 1e-9,
        least=(1.0 - SHARP) * gap - step - tolerance,
        most=gap + rounding,
        gap=gap,
    )
    return known, _box("hit", center, n, half), _box("miss", beside, n, half), at


def _box(name: str, center: FloatArray, n: FloatArray, half: float) -> Box:
    """A cube with two faces square to n."""
    side = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    side /= np.linalg.norm(side)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([side, np.cross(n, side), n])
    pose[:3, 3] = center
    return Box(name=name, margin_m=0.0, size_m=(2.0 * half,) * 3, pose=pose)


def _pair(
    mesh: TriangleMesh, pose: FloatArray, box: Box
) -> tuple[fcl.CollisionObject, fcl.CollisionObject]:
    """Link and box as FCL's meshes: the kind of which `distance` is exact."""
    return _body(mesh, pose), _body(box_mesh(np.array(box.size_m)), box.pose)


def _body(mesh: TriangleMesh, pose: FloatArray) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(pose[:3, :3], pose[:3, 3]))
