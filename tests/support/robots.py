"""Robots of others: those of the package example-robot-data, and a private one where it is."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rampe_guard.collision.urdf import MovableJoint, movable_joints, read_urdf
from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.drive import DirectDrive
from tests.support.machines import ZX200, AbsentError

IN_SERIES = 4
"""Movable joints one after the other that make an arm; legs of most quadrupeds have three."""
MOST_DRIVEN = 16
"""Of a robot with more movable joints only its longest series is driven."""
ENDLESS_RAD = np.pi
SLIDING_M = 0.5
"""Ends for joints to which the URDF gives none."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A URDF, and where its packages are.

    Attributes:
        name: package folder and file.
        urdf: the file.
        package_dirs: as in a site file.
    """

    name: str
    urdf: Path
    package_dirs: tuple[str, ...]

    def joints(self) -> tuple[MovableJoint, ...]:
        """All that can be driven."""
        return movable_joints(read_urdf(self.urdf))

    def driven(self) -> tuple[MovableJoint, ...]:
        """All of them, or of many those of the longest series."""
        joints = self.joints()
        return joints if len(joints) <= MOST_DRIVEN else self._longest(joints)

    def is_arm(self) -> bool:
        """Whether it has joints enough in series."""
        return max((joint.depth for joint in self.joints()), default=-1) + 1 >= IN_SERIES

    def describe(self) -> ArmDescription:
        """As a site file with a direct drive per joint would."""
        joints = self.driven()
        return ArmDescription(
            urdf=str(self.urdf),
            base_pose=np.eye(4),
            joints=tuple(JointDrive(j.name, i, DirectDrive()) for i, j in enumerate(joints)),
            limits=tuple(_ends(joint) for joint in joints),
            package_dirs=self.package_dirs,
        )

    def _longest(self, joints: tuple[MovableJoint, ...]) -> tuple[MovableJoint, ...]:
        above = {joint.child: joint for joint in read_urdf(self.urdf).joints}
        chosen, link = {joints[-1].name}, joints[-1].parent
        while link in above:
            chosen.add(above[link].name)
            link = above[link].parent
        return tuple(joint for joint in joints if joint.name in chosen)


def _ends(joint: MovableJoint) -> tuple[float | None, float | None]:
    most = SLIDING_M if joint.kind == "prismatic" else ENDLESS_RAD
    if not joint.lower < joint.upper:  # a joint of no travel, given some
        return joint.lower, joint.lower + 1e-3
    return (
        None if np.isfinite(joint.lower) else -most,
        None if np.isfinite(joint.upper) else most,
    )


def folder() -> Path:
    """Where example-robot-data keeps its robots.

    Raises:
        AbsentError: it is not installed.
    """
    found = importlib.util.find_spec("cmeel") or importlib.util.find_spec("example_robot_data")
    if found is not None:
        site = Path(str(found.origin)).parents[1]
        robots = site / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
        if robots.is_dir():
            return robots
    raise AbsentError("no package example-robot-data (tests/benchmarks/robots-requirements.txt)")


def public() -> list[Robot]:
    """All of the package.

    Raises:
        AbsentError: it is not installed.
    """
    robots = folder()
    # package://example-robot-data/robots/NAME/... is how most of them name their meshes
    places = (str(robots.parents[1]), str(robots))
    return [
        Robot(f"{path.relative_to(robots).parts[0]}/{path.stem}", path, places)
        for path in sorted(robots.rglob("*.urdf"))
    ]


def private() -> list[Robot]:
    """The excavator model beside the checkout, if it is there."""
    return [Robot("zx200", ZX200.resolve(), ())] if ZX200.is_file() else []


def named(name: str) -> Robot:
    """One of them.

    Raises:
        AbsentError: it is not here.
    """
    robots = public() if "/" in name else private()
    found = [robot for robot in robots if robot.name == name]
    if not found:
        raise AbsentError(f"no robot {name} here")
    return found[0]
