"""The arms on which the sweep is proven: ours, two of others where they are at hand."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision import load_arm
from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.drive import DirectDrive
from rampe_guard.settings import load_site
from tests.support.arms import six_axis
from tests.support.dense import DenseArm
from tests.support.hard_cases import Machine

if TYPE_CHECKING:
    from rampe_guard.collision.urdf import Arm

ROOT = Path(__file__).parents[2]
ZX200 = ROOT / ".." / "shared" / "data" / "robots" / "zx200" / "urdf" / "zx200.urdf"
NAMES = ("excavator", "zx200", "ur5", "six_axis", "bench")


class AbsentError(Exception):
    """This arm is not on this computer; the message says why."""


def describe(name: str, folder: Path) -> tuple[ArmDescription, float]:
    """An arm and about its reach [m]; files of our own making go to ``folder``.

    Raises:
        AbsentError: if it is not here.
    """
    match name:
        case "excavator":
            return load_site(ROOT / "config" / "sites" / "demo.yaml").arm, 8.5
        case "bench":
            return load_site(ROOT / "config" / "sites" / "bench.yaml").arm, 0.9
        case "zx200":
            if not ZX200.is_file():
                raise AbsentError("no private robots beside the checkout")
            joints = ("swing_joint", "boom_joint", "arm_joint", "bucket_joint")
            return _direct(ZX200, joints, {"swing_joint": (-3.2, 3.2)}), 10.0
        case "ur5":
            parts = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
            return _direct(_ur5(), tuple(f"{part}_joint" for part in parts), {}), 1.0
        case "six_axis":
            return six_axis(folder), 1.1
        case _:
            raise AbsentError(f"nobody knows '{name}'; there are {', '.join(NAMES)}")


def machine(name: str, folder: Path) -> tuple[Machine, Arm]:
    """An arm twice: as the oracle reads it, and as the sweep does.

    Raises:
        AbsentError: if it is not here.
    """
    description, reach = describe(name, folder)
    arm = load_arm(description)
    lower = np.where(np.isfinite(arm.limits[:, 0]), np.maximum(arm.limits[:, 0], -3.2), -3.0)
    upper = np.where(np.isfinite(arm.limits[:, 1]), np.minimum(arm.limits[:, 1], 3.2), 3.0)
    return Machine(name, DenseArm(description), lower, upper, reach), arm


def _direct(
    urdf: Path, joints: tuple[str, ...], limits: dict[str, tuple[float, float]]
) -> ArmDescription:
    return ArmDescription(
        urdf=str(urdf),
        base_pose=np.eye(4),
        joints=tuple(JointDrive(joint, i, DirectDrive()) for i, joint in enumerate(joints)),
        limits=tuple(limits.get(joint, (None, None)) for joint in joints),
    )


def _ur5() -> Path:
    """The URDF of the package `example-robot-data`, found without its own dependencies."""
    found = importlib.util.find_spec("cmeel") or importlib.util.find_spec("example_robot_data")
    for site in [] if found is None else [Path(str(found.origin)).parents[1]]:
        for path in site.glob("cmeel.prefix/share/example-robot-data/robots/ur_description"):
            return path / "urdf" / "ur5_robot.urdf"
    raise AbsentError("no package example-robot-data (pip install example-robot-data)")
