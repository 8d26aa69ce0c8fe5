"""Subscriptions to all that is recorded, with the time of each arrival."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rampe_guard.recording.channels import Channel
from rampe_guard.recording.writer import Entry
from rampe_guard.runtime.zenoh_io import Bus, Inbox
from rampe_guard.runtime.zenoh_queries import Message

_CAPACITY = 8192
"""Messages that may wait on one subscription: many seconds of any of them."""
_ANSWER_S = 1.0


class Clock:
    """Nanoseconds since 1970, but never back: the wall clock of the start, carried on evenly."""

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def now_ns(self) -> int:
        """Now."""
        return time.monotonic_ns() + self._offset_ns


class Taps:
    """All channels of a machine, on an open session.

    Args:
        bus: the session.
        channels: which; that of the state is asked for, once.
        clock: stamps arrivals.
    """

    def __init__(self, bus: Bus, channels: Sequence[Channel], clock: Clock) -> None:
        heard = [c for c in channels if c.role not in {"joystick_alive", "state"}]
        self._clock = clock
        self._inboxes = [(c, bus.inbox(c.key, _CAPACITY)) for c in heard]
        # the actuators are drained before the joystick, as a guard does: what a sender put
        # before them is then never found later than they are
        self._order = sorted(range(len(heard)), key=lambda i: heard[i].role != "actuators")
        self._numbers = dict.fromkeys(channels, 0)
        tokens = [c for c in channels if c.role == "joystick_alive"]
        self._tokens = [(c, bus.liveness(c.key)) for c in tokens]
        self._alive: dict[Channel, bool] = {}
        states = [c for c in channels if c.role == "state"]
        self._asked = [(c, bus.inquire(c.key, _ANSWER_S)) for c in states]

    @property
    def overruns(self) -> int:
        """How often a subscription was full when it was looked at: then some were lost."""
        return sum(inbox.overruns for _, inbox in self._inboxes)

    def look(self) -> list[Entry]:
        """All that came since the last look; it counts as arrived now."""
        at_ns = self._clock.now_ns()
        found = {i: self._drained(*self._inboxes[i], at_ns) for i in self._order}
        entries = [entry for i in range(len(self._inboxes)) for entry in found[i]]
        for channel, token in self._tokens:
            if (alive := token.poll()) is not None and alive is not self._alive.get(channel):
                self._alive[channel] = alive
                said = b'{"alive": true}' if alive else b'{"alive": false}'
                entries.append(self._entry(channel, Message(channel.key, said), at_ns))
        for channel, inquiry in self._asked:
            entries += [self._entry(channel, answer, at_ns) for answer in inquiry.drain()]
        self._asked = [(c, inquiry) for c, inquiry in self._asked if not inquiry.done]
        return entries

    def _drained(self, channel: Channel, inbox: Inbox, at_ns: int) -> list[Entry]:
        return [self._entry(channel, message, at_ns) for message in inbox.drain()]

    def _entry(self, channel: Channel, message: Message, at_ns: int) -> Entry:
        self._numbers[channel] += 1
        return Entry(at_ns, channel, message.key, message.payload, self._numbers[channel])
