"""Zenoh messages to core inputs. A message that cannot be used becomes a counted refusal."""

from __future__ import annotations

from rampe_guard.core.types import Inputs
from rampe_guard.errors import MessageError
from rampe_guard.runtime.batch import Batch
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
        batch = Batch(self._site, now_s, self._warn)
        actuators = self._actuators.drain()
        for message in self._joystick.drain():
            batch.joystick(message)
        for message in actuators:
            batch.actuators(message)
        alive = None if self._alive is None else self._alive.poll()
        for name, key, inbox in self._objects:
            for message in inbox.drain():
                batch.pose(name, key, message)
        for message in [] if self._enabled is None else self._enabled.drain():
            batch.enabled(message)
        return batch.inputs(alive)

    def _warn(self, kind: str, message: Message, error: MessageError) -> None:
        text = f"{message.key}: refused: {error}"
        self._say.warn(kind, text, key=message.key, reason=error.reason)
