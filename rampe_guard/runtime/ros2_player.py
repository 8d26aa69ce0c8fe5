"""Inputs put on the topics of a machine that speaks ROS 2, as its own drivers would."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rampe_guard.ros2.graph import Voice
from rampe_guard.ros2.outputs import encode_joint_state, encode_joy
from rampe_guard.runtime.ros2_publisher import Publisher
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, Ros2Settings


class RosInputs:
    """Both topics, with numbers and tokens: other nodes may hear them too.

    Args:
        bus: an open session.
        site: whose topics they are.
        ros: how it speaks; the node is another than the guard's.
    """

    def __init__(self, bus: Bus, site: Site, ros: Ros2Settings) -> None:
        own = replace(ros, node=f"{ros.node}_player")
        if own.transport == "rmw_zenoh":
            bus.declare_alive(Voice(own, bus.zid).node)
        self._drives = site.arm.joints[: len(site.actuator_names)]
        self._joystick, self._actuators = site.keys.joystick, site.keys.actuators
        self._topics = {
            self._joystick: Publisher(bus, own, 0, own.joystick_topic, JOY, self._joystick),
            self._actuators: Publisher(
                bus, own, 1, own.actuators_topic, JOINT_STATE, self._actuators
            ),
        }

    def send(self, axes: Sequence[float], position: Sequence[float], stamp_s: float) -> None:
        """Put both inputs of one moment, the joystick first."""
        self.put(self._joystick, encode_joy(axes, stamp_s))
        self.put(self._actuators, encode_joint_state(self._drives, position, stamp_s))

    def put(self, key: str, payload: bytes) -> bool:
        """Put bytes as they are; whether the key is one of these topics."""
        topic = self._topics.get(key)
        if topic is not None:
            topic.put_bytes(payload)
        return topic is not None
