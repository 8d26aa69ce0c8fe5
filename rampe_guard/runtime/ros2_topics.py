"""What ROS 2 tells beside the messages themselves: losses, and topics of another type.

A publisher whose type differs (or whose type has changed, and with it the hash) puts on another
key: it would not be heard at all, and be taken for silent. Its messages are refused by name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rampe_guard.core.types import InputName
from rampe_guard.ros2.attachment import Losses
from rampe_guard.runtime.batch import Batch
from rampe_guard.runtime.zenoh_io import Bus, is_pattern
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import strangers

_CAPACITY = 32
_INPUTS: tuple[InputName, ...] = ("joystick", "actuators")


class RosTopics:
    """Both topics of a site, as others may use them too.

    Args:
        bus: to subscribe on.
        site: whose keys are of ROS 2.
    """

    def __init__(self, bus: Bus, site: Site) -> None:
        self._keys: dict[InputName, str] = {
            "joystick": site.keys.joystick,
            "actuators": site.keys.actuators,
        }
        patterns = {name: strangers(key) for name, key in self._keys.items()}
        self._inboxes = {
            name: bus.inbox(pattern, _CAPACITY)
            for name, pattern in patterns.items()
            if pattern is not None
        }
        self._losses = {name: Losses() for name in _INPUTS}

    @property
    def lost(self) -> dict[str, int]:
        """Messages that never arrived since the start."""
        return {str(name): losses.count for name, losses in self._losses.items()}

    def look(
        self, batch: Batch, taken: Mapping[str, tuple[list[Message], int]]
    ) -> Iterator[tuple[InputName, int]]:
        """Refuse what is of another type; tell how many messages each input lost just now.

        Args:
            batch: takes the refusals.
            taken: what came on the right keys, and how many of it are not looked at.
        """
        for name, inbox in self._inboxes.items():
            key = self._keys[name]
            for message in inbox.drain():
                if message.key != key and not is_pattern(message.key):
                    batch.stranger(name, message, key)
        for name, losses in self._losses.items():
            (messages, overrun), key = taken[name], self._keys[name]
            lost = sum(losses.note(m.attachment) for m in messages if m.key == key)
            if overrun:  # those did arrive, and are told of as overload
                losses.count -= min(lost, overrun)
                lost -= min(lost, overrun)
            if lost:
                yield name, lost
