"""A robot among boxes, swept, and each answer held against what another finds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.kinematics import ForwardKinematics
from rampe_guard.core.scene import Box, Scene
from rampe_guard.core.types import Certificate
from tests.support.robots_witness import STEP_M, Witness

if TYPE_CHECKING:
    from rampe_guard.collision import Arm
    from rampe_guard.core.types import FloatArray, ZoneSweep
    from tests.support.robots import Robot

ROUGH = 60
"""Samples from which the way of a motion is known well enough to lay the dense ones."""
EQUAL_M = 1e-6
"""What two libraries may differ by in a distance [m]."""
TRIES = 40
"""Postures drawn for one that is clear."""
MOVING = 3
"""Joints that move at a time."""
MOST_RAD = 1.0


@dataclass(slots=True)
class Found:
    """What came of many motions.

    Attributes:
        motions: swept.
        contacts: zones that the other finds touched.
        missed: of them called free.
        late: called after the other's first sample in contact.
        early: called where the other measures more than twice the tolerance.
        loose: said to be farther away than the other measures.
        unknown: could not be computed.
        early_m: largest distance at a call [m].
        pose: largest difference of a link's pose [m or 1].
        stories: a line per fault.
        times: of the sweeps [s].
    """

    motions: int = 0
    contacts: int = 0
    missed: int = 0
    late: int = 0
    early: int = 0
    loose: int = 0
    unknown: int = 0
    early_m: float = 0.0
    pose: float = 0.0
    stories: list[str] = field(default_factory=list)
    times: list[float] = field(default_factory=list)

    @property
    def faults(self) -> int:
        """All of them."""
        return self.missed + self.late + self.early + self.loose + self.unknown

    def fault(self, kind: str, story: str) -> None:
        """Count one."""
        setattr(self, kind, getattr(self, kind) + 1)
        self.stories.append(f"{kind}: {story}")


def reach_of(arm: Arm) -> float:
    """About how far the arm comes from its base [m]."""
    rng = np.random.default_rng(0)
    far = 0.0
    for _ in range(20):
        poses = link_poses(arm, draw(arm, rng))
        for mesh, pose in zip(arm.meshes, poses, strict=True):
            if mesh is not None:
                cloud = mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
                far = max(far, float(np.linalg.norm(cloud, axis=1).max()))
    return far


def draw(arm: Arm, rng: np.random.Generator) -> FloatArray:
    """A random posture within the limits (n,)."""
    return np.asarray(rng.uniform(*np.clip(arm.limits, -np.pi, np.pi).T))


def joint_values(arm: Arm, q: FloatArray) -> dict[str, float]:
    """Values of all joints that move or are held [rad or m]."""
    pairs = zip(arm.joint_names, arm.joints, strict=True)
    moved = {name: float(joint.value(q[[joint.actuator]])[0]) for name, joint in pairs}
    return {**arm.fixed_joints, **moved}


def link_poses(arm: Arm, q: FloatArray) -> FloatArray:
    """World poses of all links (L, 4, 4)."""
    theta = np.array([[float(j.value(q[[j.actuator]])[0]) for j in arm.joints]])
    return np.asarray(ForwardKinematics(arm.chain).links(theta)[0])


def boxes_round(reach: float, count: int, rng: np.random.Generator) -> list[Box]:
    """Boxes in the space that an arm reaches, none at its foot."""
    boxes = []
    for i in range(count):
        way = rng.normal(size=3)
        pose = np.eye(4)
        pose[:3, 3] = way / np.linalg.norm(way) * reach * rng.uniform(0.45, 1.0)
        pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        sides = reach * rng.uniform(0.05, 0.25, 3)
        size = (float(sides[0]), float(sides[1]), float(sides[2]))
        boxes.append(Box(name=f"box-{i}", margin_m=0.0, size_m=size, pose=pose))
    return boxes


def free_motion(
    sweeper: FclSweeper, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray] | None:
    """A random motion that begins clear of everything; None if none was found."""
    arm = sweeper.arm
    for _ in range(TRIES):
        start = draw(arm, rng)
        now = sweeper.sweep(start, np.zeros_like(start), any_path=False)
        if all(zone.certificate is Certificate.FREE for zone in now.zones):
            chosen = rng.permutation(len(start))[:MOVING]
            end = start.copy()
            wide = np.minimum(arm.limits[:, 1] - arm.limits[:, 0], MOST_RAD)
            end[chosen] += rng.uniform(-1.0, 1.0, len(chosen)) * wide[chosen]
            end = np.clip(end, arm.limits[:, 0], arm.limits[:, 1])
            return start, end - start
    return None


def check(robot: Robot, motions: int, boxes: int, seed: int, slack_m: float = 0.0) -> Found:
    """Sweep random motions and compare.

    Args:
        robot: which.
        motions: so many.
        boxes: so many in the scene.
        seed: of everything random.
        slack_m: how far polyhedra stand out of the round shapes that they stand for [m].
    """
    rng = np.random.default_rng(seed)
    arm, config = load_arm(robot.describe()), SweepConfig()
    witness, found = Witness(robot.urdf, robot.package_dirs), Found()
    for _ in range(20):
        found.pose = max(found.pose, _pose_error(arm, witness, draw(arm, rng)))
    scene = boxes_round(reach_of(arm), boxes, rng)
    sweeper = FclSweeper(arm, Scene(tuple(scene)), config)
    allowed = 2.0 * config.tolerance_m + slack_m
    while found.motions < motions:
        motion = free_motion(sweeper, rng)
        if motion is None:
            raise ValueError(f"{robot.name}: no posture is clear of the boxes")
        _compare(found, sweeper, witness, scene, motion, allowed)
    return found


def _pose_error(arm: Arm, witness: Witness, q: FloatArray) -> float:
    values = joint_values(arm, q)
    ours = link_poses(arm, q)
    return max(
        float(np.abs(witness.link_pose(name, values) - pose).max())
        for name, pose in zip(arm.link_names, ours, strict=True)
    )


def _compare(
    found: Found,
    sweeper: FclSweeper,
    witness: Witness,
    scene: list[Box],
    motion: tuple[FloatArray, FloatArray],
    allowed: float,
) -> None:
    start, displacement = motion

    def poses(fractions: FloatArray) -> FloatArray:
        values = [joint_values(sweeper.arm, start + s * displacement) for s in fractions.tolist()]
        return np.array([witness.place(value) for value in values])

    result = sweeper.sweep(start, displacement, any_path=False)
    found.times.append(1e-3 * (result.elapsed_ms or 0.0))
    rough = np.linspace(0.0, 1.0, ROUGH)
    way = np.concatenate([[0.0], np.cumsum(witness.way(poses(rough)))])
    count = max(int(np.ceil(way[-1] / STEP_M)) + 1, 2)
    fractions = np.interp(np.linspace(0.0, way[-1], count), way, rough)
    dense = poses(fractions)
    hits = witness.first_contacts(dense, scene)
    for box, zone, hit in zip(scene, result.zones, hits, strict=True):
        where = f"motion {found.motions} {box.name}"
        first = None if hit is None else float(fractions[hit])
        found.contacts += first is not None
        judge(found, zone, first, where)
        if zone.certificate is Certificate.CONTACT and zone.contact_fraction is not None:
            there = witness.distance(poses(np.array([zone.contact_fraction]))[0], box)
            found.early_m = max(found.early_m, there)
            if there > allowed:
                found.fault("early", f"{where}: {1e3 * there:.3f} mm away at the call")
        elif zone.clearance_m is not None:
            there = min(witness.distance(dense[k], box) for k in (0, len(dense) // 2, -1))
            if zone.clearance_m > there + EQUAL_M:
                found.fault("loose", f"{where}: said {zone.clearance_m}, is {there}")
    found.motions += 1


def judge(found: Found, zone: ZoneSweep, first: float | None, where: str) -> None:
    """Hold one zone against the first fraction at which the other finds it touched."""
    if zone.certificate is Certificate.UNKNOWN:
        found.fault("unknown", where)
    elif first is not None and zone.certificate is Certificate.FREE:
        found.fault("missed", f"{where}: touched at {first:.6f}")
    elif first is not None and (zone.contact_fraction or 0.0) > first + 1e-9:
        found.fault("late", f"{where}: touched at {first:.6f}, called {zone.contact_fraction:.6f}")
