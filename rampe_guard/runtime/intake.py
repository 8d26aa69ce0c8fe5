"""Zenoh messages to core inputs. A message that cannot be used becomes a counted refusal.

So does one that came faster than it can be looked at: the newest are, within the budget of their
input, and in what was learned meanwhile there is no trust.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from rampe_guard.core.scene import SolidObject
from rampe_guard.core.types import InputName, Inputs
from rampe_guard.errors import MessageError
from rampe_guard.runtime.batch import Batch
from rampe_guard.runtime.budget import Budget
from rampe_guard.runtime.decoding import Decoders
from rampe_guard.runtime.ros2_topics import RosTopics
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import Site


class Stream:
    """One input: its ring of messages, and how many of them are looked at.

    Args:
        bus: to subscribe on.
        key: of the input, without wildcards.
        rate_hz: messages that are looked at in the long run [1/s].
        now_s: now, on the clock of the steps.
    """

    def __init__(self, bus: Bus, key: str, rate_hz: float, now_s: float) -> None:
        self.key = key
        self._inbox = bus.inbox(key)
        self._budget = Budget(rate_hz, now_s)
        self._overruns = 0

    def close(self) -> None:
        """Hear nothing more."""
        self._inbox.close()

    @property
    def overruns(self) -> int:
        """How often the ring was full."""
        return self._inbox.overruns

    def take(self, now_s: float) -> tuple[list[Message], int]:
        """What is looked at, oldest first, and how many messages are not (at least)."""
        waiting = self._inbox.drain()
        if not waiting:  # as nearly always
            return waiting, 0
        lost = self._inbox.overruns - self._overruns
        self._overruns += lost
        # what was put on a wildcard is refused unread, and takes nothing from the budget
        good = sum(message.key == self.key for message in waiting)
        beyond = good - self._budget.grant(good, now_s)
        return _without_oldest(waiting, self.key, beyond), lost + beyond


def _without_oldest(messages: list[Message], key: str, count: int) -> list[Message]:
    """All but the oldest ``count`` of those on ``key``."""
    if count == 0:
        return messages
    kept = []
    for message in messages:
        if count and message.key == key:
            count -= 1
        else:
            kept.append(message)
    return kept


class Intake:
    """The inputs of a machine and the poses of objects that move, drained by the worker.

    Args:
        bus: to subscribe on.
        site: whose keys count.
        say: log.
        decoders: of joystick and actuators.
    """

    def __init__(self, bus: Bus, site: Site, say: Sayer, decoders: Decoders) -> None:
        keys = site.keys
        self._site, self._decoders = site, decoders
        self._say = say
        self._bus = bus
        self._rate_hz = site.guard.inputs.max_rate_hz
        self._joystick = self._stream(keys.joystick)
        self._actuators = self._stream(keys.actuators)
        self._enabled = None if keys.enabled is None else self._stream(keys.enabled)
        self._objects: list[tuple[str, Stream]] = []
        self.change_objects(site.scene.moving)
        self._alive = None if keys.joystick_alive is None else bus.liveness(keys.joystick_alive)
        self._ros = None if site.ros2 is None else RosTopics(bus, site)

    def change_objects(self, moving: Iterable[SolidObject]) -> None:
        """Hear of other objects from now on; a key that stays is heard without a gap."""
        heard = {stream.key: stream for _, stream in self._objects}
        wanted = [(item.name, item.key) for item in moving if item.key is not None]
        self._objects = [
            (name, heard.pop(key) if key in heard else self._stream(key)) for name, key in wanted
        ]
        for stream in heard.values():
            stream.close()

    @property
    def overruns(self) -> int:
        """How often an input came faster than it was drained."""
        streams = [self._joystick, self._actuators, *(stream for _, stream in self._objects)]
        if self._enabled is not None:
            streams.append(self._enabled)
        return sum(stream.overruns for stream in streams)

    @property
    def lost_on_the_way(self) -> dict[str, int]:
        """Messages that never arrived, by the numbers that ROS 2 gives them; empty without."""
        return {} if self._ros is None else self._ros.lost

    def collect(self, now_s: float) -> Inputs:
        """Everything that arrived.

        The actuators are drained first: the joystick message that a sender put before an
        actuator message is then in the same step, as it is in replay.
        """
        batch = Batch(self._site, now_s, self._warn, self._decoders)
        actuators, levers = self._actuators.take(now_s), self._joystick.take(now_s)
        self._read(batch, "joystick", levers, batch.joystick)
        self._read(batch, "actuators", actuators, batch.actuators)
        if self._ros is not None:
            taken = {"joystick": levers, "actuators": actuators}
            for source, missed in self._ros.look(batch, taken):
                text = f"{source}: {missed} messages were lost on their way"
                self._say.warn(f"{source}:lost", text, reason="lost", lost=missed)
        alive = None if self._alive is None else self._alive.poll()
        for name, stream in self._objects:
            messages, lost = stream.take(now_s)
            for message in messages:
                batch.pose(name, stream.key, message)
            if lost:
                batch.lost_poses(name, lost)
                self._warn_lost(f"object {name}", lost)
        if self._enabled is not None:
            self._read(batch, "enabled", self._enabled.take(now_s), batch.enabled)
        return batch.inputs(alive)

    def _stream(self, key: str) -> Stream:
        return Stream(self._bus, key, self._rate_hz, time.monotonic())

    def _read(
        self,
        batch: Batch,
        name: InputName,
        taken: tuple[list[Message], int],
        decode: Callable[[Message], None],
    ) -> None:
        messages, lost = taken
        if lost:
            batch.lost(name, lost)
            self._warn_lost(name, lost)
        for message in messages:
            decode(message)

    def _warn(self, kind: str, message: Message, error: MessageError) -> None:
        text = f"{message.key}: refused: {error}"
        self._say.warn(kind, text, key=message.key, reason=error.reason)

    def _warn_lost(self, who: str, lost: int) -> None:
        text = f"{who}: {lost} messages at once were not looked at: more than {self._rate_hz:g}/s"
        self._say.warn(f"{who}:overload", text, reason="overload", lost=lost)
