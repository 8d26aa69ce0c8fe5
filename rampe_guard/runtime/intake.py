"""Zenoh messages to core inputs. A message that cannot be used becomes a counted refusal."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard import wire
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
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.zenoh_io import Bus, Message
from rampe_guard.settings import Site


class Intake:
    """The inputs of a machine and the poses of objects that move, drained by the worker."""

    def __init__(self, bus: Bus, site: Site, say: Sayer) -> None:
        keys = site.keys
        self._site = site
        self._say = say
        self._joystick = bus.inbox(keys.joystick)
        self._actuators = bus.inbox(keys.actuators)
        self._enabled = None if keys.enabled is None else bus.inbox(keys.enabled)
        self._objects = [
            (item.name, item.key, bus.inbox(item.key))
            for item in site.scene.moving
            if item.key is not None
        ]
        self._alive = None if keys.joystick_alive is None else bus.liveness(keys.joystick_alive)

    @property
    def overruns(self) -> int:
        """How often an input came faster than it was drained."""
        inboxes = [self._joystick, self._actuators, *(inbox for _, _, inbox in self._objects)]
        if self._enabled is not None:
            inboxes.append(self._enabled)
        return sum(inbox.overruns for inbox in inboxes)

    def collect(self, now_s: float) -> Inputs:
        """Everything that arrived.

        The actuators are drained first: the joystick message that a sender put before an
        actuator message is then in the same step, as it is in replay.
        """
        actuators = self._actuators.drain()
        joystick = self._joystick.drain()
        refused: list[tuple[InputName, str]] = []
        levers, positions = [], []
        for message in joystick:
            try:
                levers.append(self._lever(message, now_s))
            except MessageError as error:
                self._refuse("joystick", message, error, refused)
        for message in actuators:
            try:
                positions.append(self._position(message, now_s))
            except MessageError as error:
                self._refuse("actuators", message, error, refused)
        alive = None if self._alive is None else self._alive.poll()
        poses, lost = self._poses(now_s)
        words = self._words(now_s, refused)
        return Inputs(
            tuple(levers), tuple(positions), tuple(refused), alive, poses, lost, enabled=words
        )

    def _words(
        self, now_s: float, refused: list[tuple[InputName, str]]
    ) -> tuple[EnabledSample, ...]:
        """What came on the enable key, if there is one."""
        words = []
        for message in [] if self._enabled is None else self._enabled.drain():
            try:
                _exact(message, self._site.keys.enabled or "")
                words.append(_said(wire.decode_enabled(message.payload), now_s))
            except MessageError as error:
                self._refuse("enabled", message, error, refused)
        return tuple(words)

    def _poses(self, now_s: float) -> tuple[tuple[ObjectSample, ...], tuple[tuple[str, str], ...]]:
        """Poses of all objects that move, and (object, reason) of what was refused."""
        poses: list[ObjectSample] = []
        refused: list[tuple[str, str]] = []
        for name, key, inbox in self._objects:
            for message in inbox.drain():
                try:
                    _exact(message, key)
                    poses.append(_placed(name, wire.decode_object_pose(message.payload), now_s))
                except MessageError as error:
                    refused.append((name, error.reason))
                    self._warn(f"object {name}:{error.reason}", message, error)
        return tuple(poses), tuple(refused)

    def _lever(self, message: Message, now_s: float) -> JoystickSample:
        _exact(message, self._site.keys.joystick)
        decoded = wire.decode_joystick(message.payload, self._site.guard.axes)
        stamp_s = now_s if decoded.stamp is None else decoded.stamp
        return JoystickSample(stamp_s, np.array(decoded.axes), now_s)

    def _position(self, message: Message, now_s: float) -> ActuatorSample:
        _exact(message, self._site.keys.actuators)
        decoded = wire.decode_actuators(message.payload, self._site.actuator_names)
        stamp_s = now_s if decoded.stamp is None else decoded.stamp
        velocity = None if decoded.velocity is None else np.array(decoded.velocity)
        return ActuatorSample(stamp_s, np.array(decoded.position), velocity, now_s)

    def _refuse(
        self,
        name: InputName,
        message: Message,
        error: MessageError,
        refused: list[tuple[InputName, str]],
    ) -> None:
        refused.append((name, error.reason))
        self._warn(f"{name}:{error.reason}", message, error)

    def _warn(self, kind: str, message: Message, error: MessageError) -> None:
        self._say.warn(kind, f"{message.key}: refused: {error}")


def _said(message: wire.EnabledMessage, now_s: float) -> EnabledSample:
    stamp_s = now_s if message.stamp is None else message.stamp
    return EnabledSample(message.enabled, stamp_s, now_s, stamped=message.stamp is not None)


def _placed(name: str, message: wire.ObjectPose, now_s: float) -> ObjectSample:
    stamped = message.stamp is not None
    stamp_s = now_s if message.stamp is None else message.stamp
    return ObjectSample(name, pose_of(message), stamp_s, now_s, stamped=stamped)


def pose_of(message: wire.ObjectPose) -> FloatArray:
    """Pose (4, 4) of a message; ``rpy`` turns about the fixed axes, as in URDF."""
    if message.quaternion_xyzw is not None:
        rotation = Rotation.from_quat(message.quaternion_xyzw)
    else:
        rotation = Rotation.from_euler("xyz", message.rpy_rad or (0.0, 0.0, 0.0))
    pose = np.eye(4)
    pose[:3, :3] = rotation.as_matrix()
    pose[:3, 3] = message.xyz_m
    return pose


def _exact(message: Message, key: str) -> None:
    """A put on a wildcard reaches every subscriber that it matches; only exact keys count."""
    if message.key != key:
        raise MessageError("wildcard_key", f"put on {message.key!r}, expected {key!r}")
