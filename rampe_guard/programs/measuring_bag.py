"""A recording with messages of ROS 2, of a machine that nobody has described yet → `Heard`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from rampe_guard.errors import LogError
from rampe_guard.programs.measuring import Arrived, Heard
from rampe_guard.programs.measuring_ros2 import Joints, heard_in_ros2
from rampe_guard.recording import McapReading
from rampe_guard.recording.bag import guarded, is_bag, opened
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, RosType

_Message = tuple[str, int, bytes]
"""A topic, when it arrived [ns since 1970], and the bytes."""


def heard_in_bag(path: str, joystick: str | None, actuators: str | None, joints: Joints) -> Heard:
    """Both inputs of a rosbag2 folder, or of a .db3 or MCAP file.

    Args:
        path: of the bag.
        joystick: topic of the sensor_msgs/Joy; None: the only one of this type.
        actuators: the same of the sensor_msgs/JointState.
        joints: that count.

    Raises:
        LogError: it cannot be read, or an input is not found in it.
    """
    with _bag(path) if is_bag(path) else _mcap(path) as (kinds, messages):
        topics = (
            _topic(path, kinds, joystick, JOY, "--joystick"),
            _topic(path, kinds, actuators, JOINT_STATE, "--actuators"),
        )
        found: dict[str, list[Arrived]] = {topic: [] for topic in topics}
        for topic, at_ns, payload in messages:
            if topic in found:
                found[topic].append((at_ns / 1e9, payload))
    levers, positions = (found[topic] for topic in topics)
    return heard_in_ros2(levers, positions, topics, joints, Path(path).name)


@contextlib.contextmanager
def _bag(path: str) -> Iterator[tuple[Mapping[str, str], Iterable[_Message]]]:
    """Types by topic, and all messages of both types."""
    with opened(path) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections if c.msgcount}
        ours = [c for c in reader.connections if c.msgtype in {JOY.name, JOINT_STATE.name}]
        yield kinds, ((c.topic, at, said) for c, at, said in guarded(path, reader, ours))


@contextlib.contextmanager
def _mcap(path: str) -> Iterator[tuple[Mapping[str, str], Iterable[_Message]]]:
    """The same of an MCAP file, whoever wrote it."""
    reading = McapReading(path)
    kinds = {c.topic: reading.types.get(c.schema_id, "") for c in reading.channels.values()}
    yield kinds, ((m.channel.topic, m.at_ns, m.payload) for m in reading.messages())


def _topic(
    path: str, kinds: Mapping[str, str], told: str | None, kind: RosType, option: str
) -> str:
    fitting = [topic for topic, name in kinds.items() if name == kind.name]
    if told is not None and told in fitting:
        return told
    if told is None and len(fitting) == 1:
        return fitting[0]
    listed = ", ".join(f"{topic} ({name})" for topic, name in sorted(kinds.items())) or "nothing"
    what = f"no {told}" if told is not None else f"{len(fitting)} topics"
    raise LogError(f"{path}: {what} of {kind.name}; name one with {option}: it has {listed}")
