"""Arms for tests, written as URDF and STL so that the real loader reads them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.drive import DirectDrive, Drive

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.types import FloatArray

Triangles = list[tuple[tuple[float, ...], ...]]


def write_stl(path: Path, triangles: FloatArray) -> Path:
    """Write triangles (f, 3, 3) as ASCII STL."""
    lines = ["solid test"]
    for triangle in np.asarray(triangles, dtype=float):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid test\n"]))
    return path


def box_triangles(size: Sequence[float], center: Sequence[float] = (0, 0, 0)) -> FloatArray:
    """Twelve triangles (12, 3, 3) of a box."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = signs * np.asarray(size, dtype=float) / 2 + np.asarray(center, dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    return np.asarray(corners[np.array(faces)])


def fork_triangles() -> FloatArray:
    """A gripper like a C: a palm and two fingers with room between them. Not convex."""
    return np.concatenate(
        [
            box_triangles((0.06, 0.24, 0.08), (0.03, 0, 0)),
            box_triangles((0.20, 0.03, 0.06), (0.15, 0.105, 0)),
            box_triangles((0.20, 0.03, 0.06), (0.15, -0.105, 0)),
        ]
    )


SIX_AXIS = """<robot name="six_axis">
  <link name="base"><collision><origin xyz="0 0 0.05"/>
    <geometry><cylinder radius="0.08" length="0.1"/></geometry></collision></link>
  <link name="shoulder"><collision><origin xyz="0 0 0"/>
    <geometry><sphere radius="0.09"/></geometry></collision></link>
  <link name="upper">
    <collision><origin xyz="0.21 0 0.12"/>
      <geometry><box size="0.5 0.09 0.09"/></geometry></collision>
    <collision><origin xyz="0.42 0 0.06"/>
      <geometry><box size="0.1 0.1 0.2"/></geometry></collision>
  </link>
  <link name="fore"><collision><origin xyz="0.19 0 0" rpy="0 1.5707963 0"/>
    <geometry><cylinder radius="0.04" length="0.4"/></geometry></collision></link>
  <link name="wrist_1"><collision><origin xyz="0 0.04 0"/>
    <geometry><box size="0.09 0.12 0.09"/></geometry></collision></link>
  <link name="wrist_2"><collision>
    <geometry><box size="0.08 0.08 0.12"/></geometry></collision></link>
  <link name="tool"><collision><origin xyz="0.05 0 0"/>
    <geometry><mesh filename="fork.stl"/></geometry></collision></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="shoulder"/>
    <origin xyz="0 0 0.15"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="j2" type="revolute"><parent link="shoulder"/><child link="upper"/>
    <origin xyz="0 0 0" rpy="0 -0.5 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
  <joint name="j3" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.43 0 0"/><axis xyz="0 1 0"/><limit lower="-2.6" upper="2.6"/></joint>
  <joint name="j4" type="revolute"><parent link="fore"/><child link="wrist_1"/>
    <origin xyz="0.39 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/></joint>
  <joint name="j5" type="revolute"><parent link="wrist_1"/><child link="wrist_2"/>
    <origin xyz="0 0.1 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="j6" type="continuous"><parent link="wrist_2"/><child link="tool"/>
    <origin xyz="0 0 -0.05" rpy="0 0.4 0"/><axis xyz="1 0 0"/></joint>
</robot>
"""

SLIDER = """<robot name="slider">
  <link name="rail"/>
  <link name="tool"><collision><geometry><box size="{size}"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="tool"/>
    <axis xyz="1 0 0"/><limit lower="-10" upper="10"/></joint>
</robot>
"""

PENDULUM = """<robot name="pendulum">
  <link name="stand"/>
  <link name="rod"><collision><origin xyz="0.5 0 0"/>
    <geometry><box size="1.0 0.1 0.1"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="stand"/><child link="rod"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
</robot>
"""


def describe(
    urdf: Path,
    joints: Sequence[str],
    drives: Sequence[Drive] | None = None,
    limits: Sequence[tuple[float | None, float | None]] | None = None,
) -> ArmDescription:
    """One actuator per joint, driven directly unless told otherwise."""
    drives = [DirectDrive()] * len(joints) if drives is None else drives
    return ArmDescription(
        urdf=str(urdf),
        base_pose=np.eye(4),
        joints=tuple(
            JointDrive(joint, i, drive)
            for i, (joint, drive) in enumerate(zip(joints, drives, strict=True))
        ),
        limits=tuple([(None, None)] * len(joints) if limits is None else limits),
    )


def six_axis(folder: Path) -> ArmDescription:
    """A six-joint arm of primitives with a forked tool, about 1.2 m long."""
    write_stl(folder / "fork.stl", fork_triangles())
    urdf = folder / "six_axis.urdf"
    urdf.write_text(SIX_AXIS)
    return describe(urdf, [f"j{i}" for i in range(1, 7)])


def slider(folder: Path, size: str = "0.2 0.2 0.2") -> ArmDescription:
    """A box that slides along x, its actuator in metres."""
    urdf = folder / "slider.urdf"
    urdf.write_text(SLIDER.format(size=size))
    return describe(urdf, ["slide"])


def pendulum(
    folder: Path,
    drive: Drive | None = None,
    limits: tuple[float | None, float | None] = (None, None),
) -> ArmDescription:
    """A 1 m rod along x that turns about z."""
    urdf = folder / "pendulum.urdf"
    urdf.write_text(PENDULUM)
    return describe(urdf, ["turn"], [DirectDrive() if drive is None else drive], [limits])


GANTRY = """<robot name="gantry">
  <link name="rail"/><link name="bridge"/>
  <link name="tool"><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="rail"/><child link="bridge"/>
    <axis xyz="1 0 0"/><limit lower="-5" upper="5"/></joint>
  <joint name="y" type="prismatic"><parent link="bridge"/><child link="tool"/>
    <axis xyz="0 1 0"/><limit lower="-5" upper="5"/></joint>
</robot>
"""


def gantry(folder: Path) -> ArmDescription:
    """A box that two slides move in the plane."""
    urdf = folder / "gantry.urdf"
    urdf.write_text(GANTRY)
    return describe(urdf, ["x", "y"])
