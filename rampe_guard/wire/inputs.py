"""What arrives: axes, positions, poses of objects, the enable key; checked against the site.

A message is taken whole or refused whole, with one of these reasons: ``too_large``,
``bad_json``, ``not_finite``, ``wrong_length``, ``axis_out_of_range``, ``bad_name``,
``bad_rotation``.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

from msgspec import Meta

from rampe_guard.core.inputs import AXIS_SLACK
from rampe_guard.errors import MessageError
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES, Message, decode

MAX_VALUE = 1e6
"""Larger positions, velocities and axes are rubbish; their differences might overflow."""
MAX_STAMP_S = 1e12
"""Larger stamps are milli- or nanoseconds."""
_MAX_AXES = 64
_UNIT_SLACK = 1e-3
"""How far from 1 the length of a quaternion may be: rounded digits, not another quantity."""

_Stamp = Annotated[
    float | None,
    Meta(
        description="Time of the measurement [s], one clock for all inputs; null or absent: "
        "the arrival counts.",
        extra_json_schema={"minimum": -MAX_STAMP_S, "maximum": MAX_STAMP_S},
    ),
]


class JoystickMessage(Message, frozen=True, kw_only=True):
    """Positions of the joystick axes."""

    axes: Annotated[
        tuple[Annotated[float, Meta(extra_json_schema={"minimum": -1, "maximum": 1})], ...],
        Meta(description="Axis positions, -1 to 1, in the order of the site's axis numbers."),
    ]
    stamp: _Stamp = None


class ActuatorsMessage(Message, frozen=True, kw_only=True):
    """Positions and, where measured, velocities of the actuators."""

    position: Annotated[
        tuple[float, ...], Meta(description="Positions, in the site's order [rad or m].")
    ]
    velocity: Annotated[
        tuple[float, ...] | None,
        Meta(description="Velocities, in the same order [rad/s or m/s]; null: not measured."),
    ] = None
    name: Annotated[
        tuple[str, ...] | None,
        Meta(description="Actuator names, where the arrays are in another order."),
    ] = None
    stamp: _Stamp = None


class EnabledMessage(Message, frozen=True, kw_only=True):
    """Whether the machine is switched on; only a fresh ``false`` switches alerts off."""

    enabled: Annotated[
        bool, Meta(description="False while the machine cannot move by the operator's levers.")
    ]
    stamp: _Stamp = None


def _count(number: int) -> dict[str, Any]:
    return {"minItems": number, "maxItems": number}


class ObjectPose(Message, frozen=True, kw_only=True):
    """Where an object that moves stands; exactly one of both rotations is given."""

    xyz_m: Annotated[
        tuple[float, ...],
        Meta(description="Origin of its own frame in the world [m].", extra_json_schema=_count(3)),
    ]
    rpy_rad: Annotated[
        tuple[float, ...] | None,
        Meta(
            description="Rotation about the fixed x, then y, then z axis [rad].",
            extra_json_schema=_count(3),
        ),
    ] = None
    quaternion_xyzw: Annotated[
        tuple[float, ...] | None,
        Meta(
            description="Rotation as a quaternion x, y, z, w of length 1.",
            extra_json_schema=_count(4),
        ),
    ] = None
    stamp: _Stamp = None


def decode_joystick(payload: bytes, axes: int) -> JoystickMessage:
    """The first ``axes`` axes, each in [-1, 1].

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    return checked_joystick(decode(payload, JoystickMessage, limit=MAX_PAYLOAD_BYTES), axes)


def checked_joystick(message: JoystickMessage, axes: int) -> JoystickMessage:
    """The same of a message that is decoded already, from whatever format; all is finite.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    got = len(message.axes)
    if not axes <= got <= _MAX_AXES:
        raise MessageError("wrong_length", f"axes has {got} values, the site needs {axes}")
    _check_stamp(message.stamp)
    for index, value in enumerate(message.axes[:axes]):
        if abs(value) > 1.0 + AXIS_SLACK:
            raise MessageError("axis_out_of_range", f"axes[{index}] is {value:g}, beyond -1 to 1")
    clipped = tuple(min(1.0, max(-1.0, value)) for value in message.axes[:axes])
    return JoystickMessage(axes=clipped, stamp=message.stamp)


def decode_actuators(payload: bytes, names: tuple[str, ...]) -> ActuatorsMessage:
    """Positions and velocities in the order of ``names``; ``name`` of the result is None.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    return checked_actuators(decode(payload, ActuatorsMessage, limit=MAX_PAYLOAD_BYTES), names)


def checked_actuators(message: ActuatorsMessage, names: tuple[str, ...]) -> ActuatorsMessage:
    """The same of a message that is decoded already, from whatever format; all is finite.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    _check_stamp(message.stamp)
    position = _checked("position", message.position, len(names))
    velocity = message.velocity
    if velocity is not None:
        velocity = _checked("velocity", velocity, len(names))
    if message.name is not None:
        order = _order(message.name, names)
        position = tuple(position[i] for i in order)
        velocity = None if velocity is None else tuple(velocity[i] for i in order)
    return ActuatorsMessage(position=position, velocity=velocity, stamp=message.stamp)


def decode_object_pose(payload: bytes) -> ObjectPose:
    """The pose, its quaternion (if it has one) of length 1 to the last digit.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    message = decode(payload, ObjectPose, limit=MAX_PAYLOAD_BYTES)
    _check_stamp(message.stamp)
    xyz_m = _checked("xyz_m", message.xyz_m, 3)
    rpy, quaternion = message.rpy_rad, message.quaternion_xyzw
    if (rpy is None) is (quaternion is None):
        given = "neither" if rpy is None else "both"
        raise MessageError("bad_rotation", f"{given} of rpy_rad and quaternion_xyzw; give one")
    if rpy is not None:
        rpy = _checked("rpy_rad", rpy, 3)
    if quaternion is not None:
        quaternion = _unit(_checked("quaternion_xyzw", quaternion, 4))
    return ObjectPose(xyz_m=xyz_m, rpy_rad=rpy, quaternion_xyzw=quaternion, stamp=message.stamp)


def decode_enabled(payload: bytes) -> EnabledMessage:
    """Whether the machine says that it is switched on.

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    message = decode(payload, EnabledMessage, limit=MAX_PAYLOAD_BYTES)
    _check_stamp(message.stamp)
    return message


def _unit(quaternion: tuple[float, ...]) -> tuple[float, ...]:
    length = math.hypot(*quaternion)
    if abs(length - 1.0) > _UNIT_SLACK:
        raise MessageError("bad_rotation", f"quaternion_xyzw has length {length:.6g}, not 1")
    return tuple(value / length for value in quaternion)


def _check_stamp(stamp: float | None) -> None:
    if stamp is not None and abs(stamp) > MAX_STAMP_S:
        raise MessageError("not_finite", f"stamp {stamp:g} is no time in seconds")


def _checked(field: str, values: tuple[float, ...], count: int) -> tuple[float, ...]:
    if len(values) != count:
        raise MessageError("wrong_length", f"{field} has {len(values)} values, needs {count}")
    for index, value in enumerate(values):
        if abs(value) > MAX_VALUE:
            raise MessageError("not_finite", f"{field}[{index}] is {value:g}, beyond {MAX_VALUE:g}")
    return values


def _order(given: tuple[str, ...], names: tuple[str, ...]) -> list[int]:
    """Where each of ``names`` stands in ``given``."""
    unknown = [name for name in given if name not in names]
    if unknown:
        raise MessageError("bad_name", f"{ascii(unknown[0])[:80]} is not an actuator of the site")
    if len(set(given)) != len(given):
        raise MessageError("bad_name", "an actuator is named twice")
    if len(given) != len(names):
        missing = next(name for name in names if name not in given)
        raise MessageError("bad_name", f"{ascii(missing)[:80]} is not named")
    return [given.index(name) for name in names]
