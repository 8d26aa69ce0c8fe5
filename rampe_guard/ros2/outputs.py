"""Levers and positions as a driver of ROS 2 would publish them: for replay, and for bags."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.core.arm import JointDrive
from rampe_guard.core.drive import joint_scalar
from rampe_guard.ros2 import cdr
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY


def encode_joy(axes: Sequence[float], stamp_s: float) -> bytes:
    """A sensor_msgs/Joy without buttons, at a time [s since 1970]."""
    message = cdr.make(
        JOY.name,
        header=cdr.header(stamp_s, ""),
        axes=np.array(axes, np.float32),
        buttons=np.array([], np.int32),
    )
    return cdr.encode(message, JOY)


def encode_joint_state(
    drives: Sequence[JointDrive], position: Sequence[float], stamp_s: float
) -> bytes:
    """A sensor_msgs/JointState: where the joints are at actuator values [unit]."""
    none = np.array([], np.float64)
    angles = [joint_scalar(d.drive, float(q)) for d, q in zip(drives, position, strict=True)]
    message = cdr.make(
        JOINT_STATE.name,
        header=cdr.header(stamp_s, ""),
        name=[drive.joint for drive in drives],
        position=np.array(angles),
        velocity=none,
        effort=none,
    )
    return cdr.encode(message, JOINT_STATE)
