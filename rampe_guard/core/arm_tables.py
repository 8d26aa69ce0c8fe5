"""An arm's kinematics as the flat tables of `kernel_data.ArmTables`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.arm_kernel import CYLINDER_PIVOT, CYLINDER_SIDE, DIRECT, FOUR_BAR, TABLE
from rampe_guard.core.drive import (
    CylinderDrive,
    DirectDrive,
    FourBarDrive,
    TableDrive,
    ascending,
)
from rampe_guard.core.kernel_data import JOINT, LINK, ArmTables, room
from rampe_guard.core.kinematics import skew

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.arm_motion import ArmMotion
    from rampe_guard.core.drive import Drive
    from rampe_guard.core.kinematics import Chain
    from rampe_guard.core.types import FloatArray


def arm_tables(arm: ArmMotion, roots: Sequence[int], capsules: Sequence[FloatArray]) -> ArmTables:
    """Tables of an arm, with each link's root node and capsule (L,), (L, 7)."""
    chain = arm.chain
    joint, link = room(JOINT, chain.joints), room(LINK, chain.links)
    table_q, table_theta = [np.zeros(0)], [np.zeros(0)]
    for j, driven in enumerate(arm.joints):
        kind, values = _drive(driven.drive)
        if isinstance(driven.drive, TableDrive):
            q, theta = ascending(driven.drive)
            first = sum(len(block) for block in table_q)
            values = (first, first + len(q))
            table_q.append(q)
            table_theta.append(theta)
        joint.drive[j] = kind
        joint.numbers[j, :2] = driven.multiplier, driven.offset
        joint.numbers[j, 2 : 2 + len(values)] = values
    joint.parent, joint.actuator = chain.parent, arm.actuator
    joint.revolute, joint.axis = chain.revolute, chain.axis
    joint.constant = chain.origin[:, :3]
    joint.sine, joint.versine = _rodrigues(chain)
    joint.base, joint.span = arm.base, arm.span
    finest = np.abs(np.array(arm.slopes)[:, :, -1]).max(axis=0)
    joint.steepest = np.where(np.isfinite(finest), finest, 0.0).max(axis=1, initial=0.0)
    link.frame, link.root = chain.link_frame, roots
    link.origin, link.capsule = chain.link_origin[:, :3], capsules
    return ArmTables(
        joint=joint,
        link=link,
        reach=np.ascontiguousarray(arm.coefficients),
        slopes=np.ascontiguousarray(arm.slopes),
        table=np.ascontiguousarray([np.concatenate(table_q), np.concatenate(table_theta)]),
        limits=np.ascontiguousarray([arm.lower, arm.upper], dtype=float),
    )


def _rodrigues(chain: Chain) -> tuple[FloatArray, FloatArray]:
    sine, versine = np.zeros((2, chain.joints, 3, 4))
    for j in range(chain.joints):
        rotation = chain.origin[j][:3, :3]
        if chain.revolute[j]:
            cross = skew(chain.axis[j])
            sine[j, :, :3] = rotation @ cross
            versine[j, :, :3] = rotation @ cross @ cross
        else:
            sine[j, :, 3] = rotation @ chain.axis[j]
    return sine, versine


def _drive(drive: Drive) -> tuple[int, tuple[float, ...]]:
    match drive:
        case DirectDrive():
            return DIRECT, (drive.scale, drive.offset)
        case CylinderDrive():
            ends = drive.length_at_zero_m, drive.angle_offset_rad, drive.direction
            if drive.corner == "pivot":
                return CYLINDER_PIVOT, (drive.base_m, drive.rod_m, *ends)
            side, other = drive.base_m, drive.rod_m
            if drive.corner == "rod":
                side, other = other, side
            return CYLINDER_SIDE, (side, other, *ends)
        case FourBarDrive():
            return FOUR_BAR, (
                drive.base_m,
                drive.rod_m,
                drive.length_at_zero_m,
                drive.rocker_offset_rad,
                drive.ground_m,
                drive.rocker_m,
                drive.coupler_m,
                drive.follower_m,
                drive.angle_offset_rad,
                drive.direction,
            )
        case TableDrive():
            return TABLE, ()
