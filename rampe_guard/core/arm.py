"""What a site file says of its arm: which URDF, where it stands, what drives each joint."""

from __future__ import annotations

from dataclasses import dataclass

from rampe_guard.core.drive import Drive
from rampe_guard.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class JointDrive:
    """Joint ``joint`` of the URDF follows actuator ``actuator`` (index) through ``drive``.

    An actuator drives one joint by its own entry, and any number more through `linkages`
    (a hydraulic cylinder that turns and lengthens with its boom, say).
    """

    joint: str
    actuator: int
    drive: Drive


@dataclass(frozen=True, slots=True)
class ArmDescription:
    """The arm of a site.

    Attributes:
        urdf: path of the URDF file.
        base_pose: pose of its root link in the world (4, 4) [m].
        joints: one entry per actuator, in actuator order, then the linkages.
        limits: per actuator (lower, upper) [unit]; None = from the URDF through the drive.
        folders: absolute paths of those in which its meshes must lie; None: anywhere.
        package_dirs: paths of packages, or of folders that hold some, in which package://
            meshes are looked for before the folders above the URDF.
    """

    urdf: str
    base_pose: FloatArray
    joints: tuple[JointDrive, ...]
    limits: tuple[tuple[float | None, float | None], ...]
    folders: tuple[str, ...] | None = None
    package_dirs: tuple[str, ...] = ()
