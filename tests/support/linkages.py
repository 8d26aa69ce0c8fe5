"""Drives as a surveyor would write them: pins placed in the plane, angles read off with atan2.

It is the oracle's own reading of what the site file means, and shares no formula with
`rampe_guard.core.drive`: corners of triangles come from the half-angle formula (stable for thin
ones), the four-bar from the place of its pins.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import TYPE_CHECKING

from rampe_guard.core.drive import CylinderDrive, DirectDrive, Drive, FourBarDrive, TableDrive

if TYPE_CHECKING:
    from collections.abc import Sequence


def joint_from_actuator(drive: Drive, q: float) -> float:
    """Joint value [rad] or [m] of one actuator value [unit]."""
    match drive:
        case DirectDrive():
            return drive.scale * q + drive.offset
        case CylinderDrive():
            length = drive.length_at_zero_m + q
            sides = {
                "pivot": (drive.base_m, drive.rod_m, length),
                "base": (drive.base_m, length, drive.rod_m),
                "rod": (drive.rod_m, length, drive.base_m),
            }
            return drive.angle_offset_rad + drive.direction * corner(*sides[drive.corner])
        case FourBarDrive():
            return _four_bar(drive, q)
        case TableDrive():
            return _between(drive.actuator, drive.joint, q)


def corner(a: float, b: float, opposite: float) -> float:
    """Angle [rad] between sides a and b of a triangle, from its half-angle tangent."""
    half = 0.5 * (a + b + opposite)
    across = (half - a) * (half - b)
    along = half * (half - opposite)
    assert across >= 0.0, f"triangle {a}, {b}, {opposite} cannot close"
    assert along >= 0.0, f"triangle {a}, {b}, {opposite} cannot close"
    return 2.0 * math.atan2(math.sqrt(across), math.sqrt(along))


def _four_bar(drive: FourBarDrive, q: float) -> float:
    """Pins: the follower's pivot at the origin, the rocker's at (ground, 0)."""
    cylinder = corner(drive.base_m, drive.rod_m, drive.length_at_zero_m + q)
    turned = drive.rocker_offset_rad - cylinder  # between ground and rocker, at the rocker's pivot
    tip_x = drive.ground_m - drive.rocker_m * math.cos(turned)
    tip_y = drive.rocker_m * math.sin(turned)
    to_tip = abs(math.atan2(tip_y, tip_x))
    diagonal = math.hypot(tip_x, tip_y)
    to_follower = corner(drive.follower_m, diagonal, drive.coupler_m)
    return drive.angle_offset_rad + drive.direction * (to_tip + to_follower)


def _between(actuator: Sequence[float], joint: Sequence[float], q: float) -> float:
    pairs = sorted(zip(actuator, joint, strict=True))
    assert pairs[0][0] <= q <= pairs[-1][0], f"{q} is outside the table"
    i = min(bisect_right([x for x, _ in pairs], q), len(pairs) - 1)
    (x0, y0), (x1, y1) = pairs[i - 1], pairs[i]
    return y0 + (y1 - y0) * (q - x0) / (x1 - x0)
