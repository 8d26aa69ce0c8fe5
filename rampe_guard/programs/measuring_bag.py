"""A ROS bag of a machine that nobody has described yet: Joy and JointState → `Heard`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from rampe_guard import wire
from rampe_guard.errors import LogError, MessageError
from rampe_guard.programs.measuring import Arrived, Heard, reasons, traces_of
from rampe_guard.recording.bag import opened
from rampe_guard.ros2 import cdr
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, RosType


def heard_in_bag(
    path: str, joystick: str | None, actuators: str | None, joints: Sequence[str]
) -> Heard:
    """Both inputs of a rosbag2 folder or .db3 file.

    Args:
        path: of the bag.
        joystick: topic of the sensor_msgs/Joy; None: the only one of this type.
        actuators: the same of the sensor_msgs/JointState.
        joints: that count, whatever else a JointState names; in their order.

    Raises:
        LogError: it cannot be read, or an input is not found in it.
    """
    found: dict[str, list[Arrived]] = {"joystick": [], "actuators": []}
    with opened(path) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections if c.msgcount}
        topics = {
            "joystick": _topic(path, kinds, joystick, JOY, "--joystick"),
            "actuators": _topic(path, kinds, actuators, JOINT_STATE, "--actuators"),
        }
        ours = [c for c in reader.connections if c.topic in topics.values()]
        for connection, at_ns, payload in reader.messages(ours):
            is_joy = connection.topic == topics["joystick"]
            said = _as_json(bytes(payload), JOY if is_joy else JOINT_STATE, joints)
            found["joystick" if is_joy else "actuators"].append((at_ns / 1e9, said))
    traces, refused = traces_of(found["joystick"], found["actuators"])
    if not len(traces.time_s) or not len(traces.lever_s):
        raise LogError(f"{path}: no usable message of both inputs{reasons(refused)}")
    name = Path(path).name
    return Heard(traces, topics["joystick"], topics["actuators"], name, refused, ros2=True)


def _topic(path: str, kinds: dict[str, str], told: str | None, kind: RosType, option: str) -> str:
    fitting = [topic for topic, name in kinds.items() if name == kind.name]
    if told is not None and told in fitting:
        return told
    if told is None and len(fitting) == 1:
        return fitting[0]
    listed = ", ".join(f"{topic} ({name})" for topic, name in sorted(kinds.items())) or "nothing"
    what = f"no {told}" if told is not None else f"{len(fitting)} topics"
    raise LogError(f"{path}: {what} of {kind.name}; name one with {option}: it has {listed}")


def _as_json(payload: bytes, kind: RosType, joints: Sequence[str]) -> bytes:
    """The same as a message of our own; what cannot be used becomes one that is refused."""
    try:
        said = cdr.decode(payload, kind)
    except MessageError:
        return b""
    stamp = said.header.stamp.sec + said.header.stamp.nanosec / 1e9 or None
    if kind is JOY:
        values = tuple(float(value) for value in said.axes)
        message: wire.JoystickMessage | wire.ActuatorsMessage = wire.JoystickMessage(
            axes=values, stamp=stamp
        )
    else:
        place = dict(zip(said.name, (float(value) for value in said.position), strict=False))
        names = tuple(name for name in joints if math.isfinite(place.get(name, math.nan)))
        values = tuple(place[name] for name in names)
        message = wire.ActuatorsMessage(position=values, name=names, stamp=stamp)
    try:
        return wire.encode(message)
    except MessageError:  # an axis that is no number
        return b""
