"""Zenoh messages to core inputs. A message that cannot be used becomes a counted refusal."""

from __future__ import annotations

import numpy as np

from rampe_guard import wire
from rampe_guard.core.types import ActuatorSample, InputName, Inputs, JoystickSample
from rampe_guard.errors import MessageError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.zenoh_io import Bus, Message
from rampe_guard.settings import Site


class Intake:
    """Both inputs of a machine, drained by the worker."""

    def __init__(self, bus: Bus, site: Site, say: Sayer) -> None:
        keys = site.keys
        self._site = site
        self._say = say
        self._joystick = bus.inbox(keys.joystick)
        self._actuators = bus.inbox(keys.actuators)
        self._alive = None if keys.joystick_alive is None else bus.liveness(keys.joystick_alive)

    @property
    def overruns(self) -> int:
        """How often an input came faster than it was drained."""
        return self._joystick.overruns + self._actuators.overruns

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
        return Inputs(tuple(levers), tuple(positions), tuple(refused), alive)

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
        self._say.warn(f"{name}:{error.reason}", f"{message.key}: refused: {error}")


def _exact(message: Message, key: str) -> None:
    """A put on a wildcard reaches every subscriber that it matches; only exact keys count."""
    if message.key != key:
        raise MessageError("wildcard_key", f"put on {message.key!r}, expected {key!r}")
