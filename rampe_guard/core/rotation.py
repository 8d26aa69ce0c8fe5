"""Rotations as matrices, from the two forms that files and messages give.

scipy has them too, but half a second of imports with them; every command reads poses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rampe_guard.core.types import FloatArray


def rotation_of_rpy(rpy: Sequence[float]) -> FloatArray:
    """Matrix (3, 3) that turns by roll, pitch, yaw [rad] about the fixed axes x, y, z in turn.

    As in URDF: R = Rz(yaw) Ry(pitch) Rx(roll).
    """
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle), math.cos(angle)) for angle in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rotation_of_quaternion(xyzw: Sequence[float]) -> FloatArray:
    """Matrix (3, 3) of a quaternion x, y, z, w of any length but 0."""
    length = math.hypot(*xyzw)
    x, y, z, w = (value / length for value in xyzw)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
