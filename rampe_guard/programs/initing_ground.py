"""Where the ground is below an arm of which only the URDF is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rampe_guard.collision.urdf import load_arm, read_urdf
from rampe_guard.core.arm import ArmDescription

_NOTHING_M = 0.0
_STEP_M = 0.01


def ground_of(urdf: Path, package_dirs: tuple[str, ...]) -> tuple[float, list[str]]:
    """Lowest point of what never moves, rounded down [m], and the links that never do.

    Raises:
        GeometryError: a mesh cannot be used.
    """
    arm = load_arm(ArmDescription(str(urdf), np.eye(4), (), (), None, package_dirs))
    fixed = {joint.child: joint.parent for joint in read_urdf(urdf).joints if joint.type == "fixed"}
    below = {joint.child for joint in read_urdf(urdf).joints}
    standing = [name for name in arm.link_names if _rooted(name, fixed, below)]
    lowest = [
        float((mesh.vertices @ pose[2, :3] + pose[2, 3]).min())
        for name, mesh, pose in zip(arm.link_names, arm.meshes, arm.chain.link_origin, strict=True)
        if name in standing and mesh is not None
    ]
    if not lowest:
        return _NOTHING_M, standing
    return float(np.floor(min(lowest) / _STEP_M + 1e-6) * _STEP_M), standing


def _rooted(name: str, fixed: dict[str, str], below: set[str]) -> bool:
    """Whether only fixed joints are between a link and the root."""
    while name in fixed:
        name = fixed[name]
    return name not in below
