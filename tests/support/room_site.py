"""A site of the bench excavator in a room: walls, ceiling, crates where its work now and then goes.

The solid counterpart of `wall_site`: halfspaces stand at quantiles of the arm's own extent over all
positions of some logs, boxes at fixed places beside the digging and the dumping side.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rampe_guard.collision import load_arm
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.stages import machine_of
from rampe_guard.runtime.csv_log import read_csv_log
from rampe_guard.settings import load_site
from tests.support.processes import BENCH
from tests.support.wall_site import write_site

OUTER = 0.92
"""Quantile of the arm's extent at which a wall or the ceiling stands."""
_EVERY = 4
_MARGIN_M = 0.005
_BOXES = """\
  - name: crate
    type: box
    size: [0.16, 0.08, 0.30]
    pose: {xyz: [0.512, 0.314, -0.07], rpy: [0, 0, 0.55]}
  - name: pallet
    type: box
    size: [0.24, 0.30, 0.06]
    pose: {xyz: [0.16, 0.58, -0.17], rpy: [0, 0, 0]}
  - name: cabinet
    type: box
    size: [0.10, 0.40, 0.70]
    pose: {xyz: [-0.14, 0.58, 0.15], rpy: [0, 0, 0.2]}
  - name: post
    type: box
    size: [0.06, 0.06, 0.60]
    pose: {xyz: [0.58, -0.15, 0.10], rpy: [0, 0, 0]}
"""


def write_room_site(folder: Path, logs: Sequence[str | Path]) -> Path:
    """Write site and scene into ``folder``.

    Args:
        folder: that is there.
        logs: CSV files of the bench excavator; the walls come from all of them together.
    """
    site = load_site(BENCH)
    limits = load_arm(site.arm).limits
    positions = np.concatenate([read_csv_log(site, log, limits).position for log in logs])
    far = np.quantile(_extent(positions[::_EVERY]), OUTER, axis=0) + _MARGIN_M
    planes = (("front", 0), ("left", 1), ("ceiling", 2))
    lines = ["frame: world", f"margin_m: {_MARGIN_M}", "objects:", _BOXES.rstrip()]
    for name, axis in planes:
        normal = [0, 0, 0]
        normal[axis] = -1
        solid = f"type: halfspace, normal: {normal}, offset_m: {-far[axis]:.4f}"
        lines.append(f"  - {{name: {name}, {solid}}}")
    (folder / "room.yaml").write_text("\n".join(lines) + "\n", "utf-8")
    return write_site(folder, "room")


def _extent(positions: FloatArray) -> FloatArray:
    """Farthest that any point of the arm gets along x, y, z (k, 3) [m]."""
    machine = machine_of(str(BENCH))
    poses = machine.sweeper.link_poses(positions)  # (k, L, 4, 4)
    far = np.full((len(positions), 3), -np.inf)
    for link, mesh in enumerate(machine.arm.meshes):
        if mesh is not None:
            rotation, origin = poses[:, link, :3, :3], poses[:, link, :3, 3]
            points = np.einsum("kij,vj->kvi", rotation, mesh.vertices) + origin[:, None]
            far = np.maximum(far, points.max(axis=1))
    return far
