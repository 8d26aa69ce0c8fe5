"""Both inputs of a machine, heard live for a while, as they came."""

from __future__ import annotations

import csv
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from rampe_guard.errors import LogError
from rampe_guard.programs.measuring import Arrived, Heard
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, Inbox, check_key_expression, is_pattern
from rampe_guard.settings.ros2_keys import in_words, strangers, topic_of, why_strange

LOOK_S = 0.002
"""Period of looking: a message counts as arrived at most so much late [s]."""
_RING = 4096
_SEARCH_S = 1.0
_MOST_KEYS = 12
MOST_MESSAGES = 2_000_000
"""Of each input; a minute at 30 kHz, or half a day at 50 Hz."""


@dataclass(slots=True)
class Listening:
    """One key being heard.

    Attributes:
        key: exact.
        inbox: of it.
        others: where the same topic of ROS 2 lies with another type or hash, if anywhere.
        messages: that came.
        refused: puts on a wildcard or with another type, which no guard takes.
        why: of the last with another type, in words.
    """

    key: str
    inbox: Inbox
    others: Inbox | None = None
    messages: list[Arrived] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)
    why: str = ""

    @classmethod
    def on(cls, bus: Bus, key: str) -> Self:
        """Begin to hear a key."""
        pattern = strangers(key)
        others = None if pattern is None else bus.inbox(pattern, _RING)
        return cls(key, bus.inbox(key, _RING), others)

    def take(self, now_s: float) -> None:
        """Take what waits."""
        for message in self.inbox.drain():
            if message.key != self.key:
                self.refused["wildcard_key"] += 1
            elif len(self.messages) < MOST_MESSAGES:
                self.messages.append((now_s, message.payload))
        for message in () if self.others is None else self.others.drain():
            if message.key != self.key and not is_pattern(message.key):
                word, self.why = why_strange(message.key, self.key)
                self.refused[word] += 1

    def close(self) -> None:
        """Hear no more."""
        self.inbox.close()
        if self.others is not None:
            self.others.close()


def listen(
    bus: Bus,
    keys: tuple[str, ...],
    seconds: float,
    stop: StopFlag,
    tell: Callable[[float, list[Listening]], None] | None = None,
) -> list[Listening]:
    """Hear some keys for a while; times are of our wall clock [s].

    Args:
        bus: to subscribe on.
        keys: exact.
        seconds: for how long; less if told to stop.
        stop: ends it early.
        tell: told about once a second how long it has been [s], and what was heard so far.
    """
    heard = [Listening.on(bus, key) for key in keys]
    began_s = time.monotonic()
    ahead_s = time.time() - began_s
    told_s = 0.0
    while (passed_s := time.monotonic() - began_s) < seconds and not stop.wait(LOOK_S):
        now_s = time.monotonic() + ahead_s
        for one in heard:
            one.take(now_s)
        if tell is not None and passed_s - told_s >= 1.0:
            told_s = passed_s
            tell(passed_s, heard)
    for one in heard:
        one.take(time.monotonic() + ahead_s)
        one.close()
    return heard


def both_live(
    network: Network,
    keys: tuple[str, str],
    seconds: float,
    stop: StopFlag,
    tell: Callable[[float, list[Listening]], None] | None = None,
) -> tuple[Listening, Listening]:
    """Both inputs of a machine from its network: the joystick's key, and the actuators'.

    Raises:
        ConnectionFailedError: no router answers.
        LogError: an input is silent; says which keys are not.
        SettingsError: a key is none.
    """
    for key in keys:
        check_key_expression(key)
    with Bus.open(network.settings) as bus:
        sticks, places = listen(bus, keys, seconds, stop, tell)
        silent = [one for one in (sticks, places) if not one.messages]
        if silent:
            named = " and ".join(one.key for one in silent)
            strange = "; ".join(one.why for one in silent if one.why)
            told = strange or _lively(bus, stop, [topic_of(one.key) for one in silent])
            raise LogError(f"nothing came on {named} within {seconds:g} s; {told}")
    return sticks, places


def _lively(bus: Bus, stop: StopFlag, topics: Sequence[str]) -> str:
    """Which keys are put on, in words; first those that carry one of the ``topics``."""
    inbox = bus.inbox("**", _RING)
    seen: set[str] = set()
    until_s = time.monotonic() + _SEARCH_S
    while time.monotonic() < until_s and not stop.wait(LOOK_S):
        seen.update(message.key for message in inbox.drain())
    inbox.close()
    if not seen:
        return "nor on any other key of this router: is the machine's publisher running?"
    keys = [in_words(key) for key in sorted(seen, key=lambda k: (topic_of(k) not in topics, k))]
    more = f" and {len(keys) - _MOST_KEYS} more" if len(keys) > _MOST_KEYS else ""
    return f"there are messages on {', '.join(keys[:_MOST_KEYS])}{more}"


def write_csv(path: Path, heard: Heard, names: Sequence[str], axes: Sequence[int]) -> None:
    """Keep what was heard as a CSV log: a row for each position, with the lever before it.

    Args:
        path: of the file.
        heard: what.
        names: of the actuators, in the order of the positions.
        axes: of each actuator.

    Raises:
        OSError: it cannot be written.
    """
    traces = heard.traces
    last = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["t", *(f"u_{name}" for name in names), *names])
        for at_s, position in zip(traces.time_s.tolist(), traces.position.tolist(), strict=True):
            while last + 1 < len(traces.lever_s) and traces.lever_s[last + 1] <= at_s:
                last += 1
            if traces.lever_s[last] > at_s:
                continue
            lever = [f"{traces.axes[last, axis]:.6g}" for axis in axes]
            out.writerow(
                [f"{at_s - traces.time_s[0]:.6f}", *lever, *(f"{q:.7g}" for q in position)]
            )
