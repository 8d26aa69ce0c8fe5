"""Both inputs of a machine, heard live for a while, as they came."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rampe_guard.errors import LogError
from rampe_guard.programs.measuring import Arrived, Heard, reasons, traces_of
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, Inbox, check_key_expression

LOOK_S = 0.002
"""Period of looking: a message counts as arrived at most so much late [s]."""
_RING = 4096
_SEARCH_S = 1.0
_MOST_KEYS = 12
MOST_MESSAGES = 2_000_000
"""Of each input; a minute at 30 kHz, or half a day at 50 Hz."""


@dataclass(slots=True)
class Listening:
    """One key being heard; ``strangers`` counts puts on a wildcard, which no guard takes."""

    key: str
    inbox: Inbox
    messages: list[Arrived] = field(default_factory=list)
    strangers: int = 0

    def take(self, now_s: float) -> None:
        """Take what waits."""
        for message in self.inbox.drain():
            if message.key != self.key:
                self.strangers += 1
            elif len(self.messages) < MOST_MESSAGES:
                self.messages.append((now_s, message.payload))


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
    heard = [Listening(key, bus.inbox(key, _RING)) for key in keys]
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
        one.inbox.close()
    return heard


def heard_live(
    network: Network,
    joystick: str,
    actuators: str,
    seconds: float,
    stop: StopFlag,
    tell: Callable[[float, list[Listening]], None] | None = None,
) -> Heard:
    """Both inputs of a machine from its network.

    Raises:
        ConnectionFailedError: no router answers.
        LogError: an input is silent; says which keys are not.
        SettingsError: a key is none.
    """
    for key in (joystick, actuators):
        check_key_expression(key)
    with Bus.open(network.settings) as bus:
        sticks, places = listen(bus, (joystick, actuators), seconds, stop, tell)
        silent = [one.key for one in (sticks, places) if not one.messages]
        if silent:
            raise LogError(
                f"nothing came on {' and '.join(silent)} within {seconds:g} s; {_lively(bus, stop)}"
            )
    traces, refused = traces_of(sticks.messages, places.messages)
    refused["joystick: wildcard_key"] += sticks.strangers
    refused["actuators: wildcard_key"] += places.strangers
    refused = +refused
    if not len(traces.time_s) or not len(traces.lever_s):
        raise LogError(f"no usable message of both inputs{reasons(refused)}")
    where = ", ".join(network.endpoints) or network.config or "the local router"
    return Heard(traces, joystick, actuators, f"{seconds:g} s at {where}", refused)


def _lively(bus: Bus, stop: StopFlag) -> str:
    """Which keys are put on, in words."""
    inbox = bus.inbox("**", _RING)
    seen: set[str] = set()
    until_s = time.monotonic() + _SEARCH_S
    while time.monotonic() < until_s and not stop.wait(LOOK_S):
        seen.update(message.key for message in inbox.drain())
    inbox.close()
    if not seen:
        return "nor on any other key of this router: is the machine's publisher running?"
    keys = sorted(seen)
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
