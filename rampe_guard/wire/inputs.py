"""What arrives: joystick axes and actuator positions, checked against the site.

A message is taken whole or refused whole, with one of these reasons: ``too_large``,
``bad_json``, ``not_finite``, ``wrong_length``, ``axis_out_of_range``, ``bad_name``.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from rampe_guard.core.inputs import AXIS_SLACK
from rampe_guard.errors import MessageError
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES, Message, decode

MAX_VALUE = 1e6
"""Larger positions, velocities and axes are rubbish; their differences might overflow."""
MAX_STAMP_S = 1e12
"""Larger stamps are milli- or nanoseconds."""
_MAX_AXES = 64

_Stamp = Annotated[
    float | None,
    Meta(
        description="Time of the measurement [s], one clock for both inputs; null or absent: "
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


def decode_joystick(payload: bytes, axes: int) -> JoystickMessage:
    """The first ``axes`` axes, each in [-1, 1].

    Raises:
        MessageError: with its reason, when the message cannot be trusted.
    """
    message = decode(payload, JoystickMessage, limit=MAX_PAYLOAD_BYTES)
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
    message = decode(payload, ActuatorsMessage, limit=MAX_PAYLOAD_BYTES)
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
