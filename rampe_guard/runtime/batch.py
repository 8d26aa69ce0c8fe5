"""Messages of one step → `Inputs`: the one decoder of live guards and of recordings.

A message that cannot be used becomes a refusal, with the same word wherever it is read.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rampe_guard import wire
from rampe_guard.core.monitor import OVERLOAD
from rampe_guard.core.rotation import rotation_of_quaternion, rotation_of_rpy
from rampe_guard.core.types import (
    ActuatorSample,
    EnabledSample,
    FloatArray,
    InputName,
    Inputs,
    JoystickSample,
    ObjectSample,
)
from rampe_guard.errors import MessageError
from rampe_guard.runtime.decoding import Decoders
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import why_strange

Refused = Callable[[str, Message, MessageError], None]
"""Told of a refusal: a word for its kind, the message, and what is wrong with it."""


class Batch:
    """All that arrived since the last step.

    Args:
        site: whose keys, axes and actuators count.
        now_s: when it arrived, on the clock of the steps [s]; the stamp of what has none.
        refused: told of each refusal.
        decoders: of joystick and actuators.
    """

    def __init__(self, site: Site, now_s: float, refused: Refused, decoders: Decoders) -> None:
        self._site, self._now_s, self._tell = site, now_s, refused
        self._decoders = decoders
        self._levers: list[JoystickSample] = []
        self._positions: list[ActuatorSample] = []
        self._words: list[EnabledSample] = []
        self._poses: list[ObjectSample] = []
        self._rejected: list[tuple[InputName, str]] = []
        self._lost: list[tuple[str, str]] = []

    def joystick(self, message: Message) -> None:
        """Take what came for the joystick's key."""
        try:
            _exact(message, self._site.keys.joystick)
            decoded = self._decoders.joystick(message.payload)
        except MessageError as error:
            self._refuse("joystick", message, error)
            return
        stamp_s = self._now_s if decoded.stamp is None else decoded.stamp
        stamped = decoded.stamp is not None
        axes = np.array(decoded.axes)
        self._levers.append(JoystickSample(stamp_s, axes, self._now_s, stamped=stamped))

    def actuators(self, message: Message) -> None:
        """Take what came for the actuators' key."""
        try:
            _exact(message, self._site.keys.actuators)
            decoded = self._decoders.actuators(message.payload)
        except MessageError as error:
            self._refuse("actuators", message, error)
            return
        stamp_s = self._now_s if decoded.stamp is None else decoded.stamp
        velocity = None if decoded.velocity is None else np.array(decoded.velocity)
        position = np.array(decoded.position)
        stamped = decoded.stamp is not None
        sample = ActuatorSample(stamp_s, position, velocity, self._now_s, stamped=stamped)
        self._positions.append(sample)

    def enabled(self, message: Message) -> None:
        """Take what came for the enable key."""
        try:
            _exact(message, self._site.keys.enabled or "")
            said = wire.decode_enabled(message.payload)
        except MessageError as error:
            self._refuse("enabled", message, error)
            return
        stamp_s = self._now_s if said.stamp is None else said.stamp
        stamped = said.stamp is not None
        self._words.append(EnabledSample(said.enabled, stamp_s, self._now_s, stamped=stamped))

    def stranger(self, name: InputName, message: Message, key: str) -> None:
        """Take what came on the topic of an input, but is another type's; ``key`` is right."""
        self._refuse(name, message, MessageError(*why_strange(message.key, key)))

    def pose(self, name: str, key: str, message: Message) -> None:
        """Take what came for the ``key`` of the object ``name``."""
        try:
            _exact(message, key)
            placed = wire.decode_object_pose(message.payload)
        except MessageError as error:
            self._lost.append((name, error.reason))
            self._tell(f"object {name}:{error.reason}", message, error)
            return
        self._poses.append(object_sample(name, placed, self._now_s))

    def lost(self, name: InputName, count: int) -> None:
        """Take that ``count`` messages of an input were not looked at."""
        self._rejected += [(name, OVERLOAD)] * count

    def lost_poses(self, name: str, count: int) -> None:
        """The same of poses of the object ``name``."""
        self._lost += [(name, OVERLOAD)] * count

    def inputs(self, joystick_alive: bool | None) -> Inputs:
        """All of it, as `Guard.step` takes it."""
        return Inputs(
            tuple(self._levers),
            tuple(self._positions),
            tuple(self._rejected),
            joystick_alive,
            tuple(self._poses),
            tuple(self._lost),
            enabled=tuple(self._words),
        )

    def _refuse(self, name: InputName, message: Message, error: MessageError) -> None:
        self._rejected.append((name, error.reason))
        self._tell(f"{name}:{error.reason}", message, error)


def object_sample(name: str, message: wire.ObjectPose, now_s: float) -> ObjectSample:
    """What a message that arrived at ``now_s`` [s] says of the object ``name``."""
    stamped = message.stamp is not None
    stamp_s = now_s if message.stamp is None else message.stamp
    return ObjectSample(name, pose_of(message), stamp_s, now_s, stamped=stamped)


def pose_of(message: wire.ObjectPose) -> FloatArray:
    """Pose (4, 4) of a message; ``rpy`` turns about the fixed axes, as in URDF."""
    pose = np.eye(4)
    if message.quaternion_xyzw is not None:
        pose[:3, :3] = rotation_of_quaternion(message.quaternion_xyzw)
    elif message.rpy_rad is not None:
        pose[:3, :3] = rotation_of_rpy(message.rpy_rad)
    pose[:3, 3] = message.xyz_m
    return pose


def _exact(message: Message, key: str) -> None:
    """A put on a wildcard reaches every subscriber that it matches; only exact keys count."""
    if message.key != key:
        raise MessageError("wildcard_key", f"put on {message.key!r}, expected {key!r}")
