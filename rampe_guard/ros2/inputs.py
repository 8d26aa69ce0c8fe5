"""sensor_msgs/Joy and sensor_msgs/JointState as what a guard takes: axes, and actuator values.

A message is taken whole or refused whole, with one of the reasons of `wire.inputs` or one of these:
``bad_cdr``, ``missing_joint``, ``duplicate_joint``, ``joint_out_of_reach``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from rampe_guard import wire
from rampe_guard.core.arm import JointDrive
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import MessageError
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.inverse import Inverse
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY
from rampe_guard.wire.inputs import checked_actuators, checked_joystick

_NANOSECONDS: Final = 10**9


def decode_joy(payload: bytes, axes: int) -> wire.JoystickMessage:
    """The first ``axes`` axes of a sensor_msgs/Joy; its buttons are ignored.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    said = cdr.decode(payload, JOY)
    values = said.axes.tolist()
    for index, value in enumerate(values[:axes]):
        if not math.isfinite(value):
            raise MessageError("not_finite", f"axes[{index}] is {value}")
    message = wire.JoystickMessage(axes=tuple(values), stamp=_stamp(said.header))
    return checked_joystick(message, axes)


class JointReader:
    """Reads sensor_msgs/JointState for one arm.

    Joints stand in any order, and there may be more of them than the arm has. Positions and
    speeds are of joints; those of actuators are made from them by the inverse of each drive.

    Args:
        drives: of the actuators, in their order.
        limits: of the actuators (n, 2) [unit].
    """

    def __init__(self, drives: Sequence[JointDrive], limits: FloatArray) -> None:
        self._joints = tuple(drive.joint for drive in drives)
        self._inverses = tuple(
            Inverse(entry.drive, float(low), float(high))
            for entry, (low, high) in zip(drives, limits, strict=True)
        )
        self._names: list[str] = []
        self._order: tuple[int, ...] = ()

    def __call__(self, payload: bytes) -> wire.ActuatorsMessage:
        """Positions of the actuators, and their velocities where all of them are told.

        Raises:
            MessageError: with its reason, when the message cannot be trusted.
        """
        said = cdr.decode(payload, JOINT_STATE)
        if said.name != self._names:  # as nearly never
            self._order = _order(said.name, self._joints)
            self._names = said.name
        angles = self._picked("position", said.position)
        for joint, angle in zip(self._joints, angles, strict=True):
            if not math.isfinite(angle):
                raise MessageError("not_finite", f"position of {joint} is {angle}")
        position = tuple(
            inverse.actuator(angle) for inverse, angle in zip(self._inverses, angles, strict=True)
        )
        for joint, angle, value in zip(self._joints, angles, position, strict=True):
            if math.isnan(value):
                text = f"{joint} at {angle:.6g}: its actuator cannot bring it there"
                raise MessageError("joint_out_of_reach", text)
        message = wire.ActuatorsMessage(
            position=position, velocity=self._speeds(said, position), stamp=_stamp(said.header)
        )
        return checked_actuators(message, self._joints)

    def _speeds(self, said: Any, position: tuple[float, ...]) -> tuple[float, ...] | None:
        """Speeds of the actuators; None if one is not told (NaN says so too), or has none."""
        if not len(said.velocity):
            return None
        told = self._picked("velocity", said.velocity)
        for joint, speed in zip(self._joints, told, strict=True):
            if math.isinf(speed):
                raise MessageError("not_finite", f"velocity of {joint} is {speed}")
        speeds = tuple(
            inverse.speed(q, speed)
            for inverse, q, speed in zip(self._inverses, position, told, strict=True)
        )
        return speeds if all(map(math.isfinite, speeds)) else None

    def _picked(self, field: str, values: FloatArray) -> list[float]:
        if len(values) != len(self._names):
            raise MessageError(
                "wrong_length", f"{field} has {len(values)} values for {len(self._names)} names"
            )
        return [float(values[i]) for i in self._order]


def _order(given: list[str], joints: tuple[str, ...]) -> tuple[int, ...]:
    """Where each of ``joints`` stands in ``given``."""
    if len(set(given)) != len(given):
        twice = next(name for name in given if given.count(name) > 1)
        raise MessageError("duplicate_joint", f"{ascii(twice)[:80]} is named twice")
    missing = [joint for joint in joints if joint not in given]
    if missing:
        known = ascii(", ".join(given))[1:-1][:160] or "none"
        raise MessageError("missing_joint", f"no {missing[0]}; it names {known}")
    return tuple(given.index(joint) for joint in joints)


def _stamp(header: Any) -> float | None:
    """Time of the measurement [s]; None where it is left at 0, as drivers do that know none."""
    seconds, nanoseconds = header.stamp.sec, header.stamp.nanosec
    if nanoseconds >= _NANOSECONDS:
        raise MessageError("bad_cdr", f"header.stamp has {nanoseconds} ns in a second")
    return seconds + nanoseconds / _NANOSECONDS if seconds or nanoseconds else None
