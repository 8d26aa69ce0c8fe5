"""A recording as a log: what arrived, when, decoded as the guard decodes it.

What the recorder found at one look is one step. The clock of the steps begins with the first
message of the file, whoever it is from, and ends with the last: silence of the inputs before and
after their own messages is replayed too.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import cached_property
from itertools import groupby

import msgspec
import numpy as np

from rampe_guard.core.inputs import Accepted, InputGate
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, JoystickSample
from rampe_guard.errors import LogError
from rampe_guard.recording.bag import BagReading
from rampe_guard.recording.channels import Channel, understood
from rampe_guard.recording.reader import McapReading
from rampe_guard.runtime.batch import Batch
from rampe_guard.runtime.decoding import decoders_of
from rampe_guard.runtime.replay import idle_times
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import Site

_INPUTS = ("joystick", "actuators", "object", "enabled", "joystick_alive")


class McapLog:
    """A recording, read for one site; see `recording.log.Log`.

    Args:
        site: whose guard is to see it; not necessarily the one that was recorded.
        reading: the file.
        limits: actuator limits (n, 2) [unit], for what the gate refuses.

    Raises:
        LogError: nothing in it is an input of the site.
    """

    def __init__(self, site: Site, reading: McapReading | BagReading, limits: FloatArray) -> None:
        self._site, self.reading, self._limits = site, reading, limits
        self._heard = {
            number: understood(site, channel.topic, channel.metadata)
            for number, channel in reading.channels.items()
        }
        self.path = reading.path
        self.first_s = 0.0
        self.epoch_s = reading.first_ns / 1e9
        ours = [heard.channel for heard in self._heard.values() if heard is not None]
        roles = {channel.role for channel in ours}
        missing = [role for role in ("joystick", "actuators") if role not in roles]
        self.objects = frozenset({channel.name for channel in ours} - {""})
        self.warnings = (
            *reading.warnings,
            *(f"{self.path}: there is no message of the {role}" for role in missing),
        )
        if not roles & set(_INPUTS):
            topics = ", ".join(sorted(reading.counts))
            raise LogError(
                f"{self.path}: none of its topics is an input of {site.path}: it has {topics}"
            )

    @property
    def left_out(self) -> tuple[str, ...]:
        """What could not be read, or is not there."""
        return self.warnings

    @property
    def last_s(self) -> float:
        """Time of the last message [s]."""
        return self._time_s(self.reading.last_ns)

    def steps(self) -> Iterator[tuple[float, Inputs]]:
        """Time [s] of every step of a guard, and what arrived for it, if anything."""
        alive: bool | None = None
        last_s = self.first_s
        decoders = decoders_of(self._site, self._limits)
        for now_s, messages in self._arrivals(_INPUTS):
            for idle_s in idle_times(last_s, now_s):
                yield idle_s, Inputs(joystick_alive=alive)
            batch = Batch(self._site, now_s, lambda *_: None, decoders)
            for channel, message in messages:
                if channel.role == "joystick_alive":
                    alive = _alive(message.payload, alive)
                else:
                    _give(batch, channel, message)
            yield now_s, batch.inputs(alive)
            last_s = now_s
        for idle_s in idle_times(last_s, self.last_s):
            yield idle_s, Inputs(joystick_alive=alive)

    def positions(self) -> Iterator[tuple[float, FloatArray]]:
        """Where the arm was: time [s], position (n,) of every sample that the gate accepts."""
        for time_s, _, position in self._rows:
            yield time_s, position

    def samples(self) -> Iterator[tuple[JoystickSample, ActuatorSample]]:
        """One pair a row of the arrays; both arrive when they are stamped."""
        for t, u, q in zip(self.time_s.tolist(), self.axes, self.position, strict=True):
            yield JoystickSample(t, u, t), ActuatorSample(t, q, None, t)

    def published(self, role: str) -> Iterator[tuple[float, bytes]]:
        """What the guard said on one of its keys: time of arrival [s], and the message."""
        for now_s, messages in self._arrivals((role,)):
            for _, message in messages:
                yield now_s, message.payload

    def posts(self) -> Iterator[tuple[float, str, bytes]]:
        """Inputs as they were put: time [s], the site's key, and the message.

        What was put on a wildcard is left out: it would reach others too.
        """
        for now_s, messages in self._arrivals(_INPUTS[:-1]):
            for channel, message in messages:
                if message.key == channel.key:
                    yield now_s, channel.key, message.payload

    @property
    def time_s(self) -> FloatArray:
        """Times of the rows (k,) [s]: accepted positions for which a lever is known."""
        return self._arrays[0]

    @property
    def axes(self) -> FloatArray:
        """The last lever before each of them (k, m) [-]."""
        return self._arrays[1]

    @property
    def position(self) -> FloatArray:
        """The positions (k, n) [unit]."""
        return self._arrays[2]

    @cached_property
    def _arrays(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        rows = [(t, u, q) for t, u, q in self._rows if u is not None]
        if not rows:
            raise LogError(f"{self.path}: no position for which a lever is known")
        times, axes, positions = zip(*rows, strict=True)
        return np.array(times), np.array(axes), np.array(positions)

    @cached_property
    def _rows(self) -> list[tuple[float, FloatArray | None, FloatArray]]:
        """Time [s], lever (m,) if known, position (n,) of every accepted actuator sample.

        Of several that arrived together, each but the last is as much earlier as its stamp says.
        """
        rows: list[tuple[float, FloatArray | None, FloatArray]] = []
        config = self._site.guard
        gate = InputGate(config.actuators, self._limits, config.inputs, config.axes)
        lever: FloatArray | None = None
        last_s = float("-inf")
        for now_s, inputs in self.steps():
            for sample in sorted(inputs.joystick, key=lambda s: s.stamp_s):
                said = gate.joystick(sample)
                lever = said.sample.axes if isinstance(said, Accepted) else lever
            verdicts = [gate.actuators(s) for s in sorted(inputs.actuators, key=_stamp)]
            good = [v.sample for v in verdicts if isinstance(v, Accepted)]
            for moved in good:
                time_s = now_s - (good[-1].stamp_s - moved.stamp_s)
                if time_s > last_s:
                    last_s = time_s
                    rows.append((time_s, lever, moved.position))
        return rows

    def _arrivals(
        self, roles: tuple[str, ...]
    ) -> Iterator[tuple[float, list[tuple[Channel, Message]]]]:
        """What arrived at once on channels of some roles, under the site's own keys."""
        for at_ns, together in groupby(self.reading.messages(), key=lambda m: m.at_ns):
            found = []
            for message in together:
                heard = self._heard[message.channel.id]
                if heard is not None and heard.channel.role in roles:
                    key = heard.channel.key if heard.exact else message.channel.topic
                    found.append((heard.channel, Message(key, message.payload)))
            if found:
                yield self._time_s(at_ns), found

    def _time_s(self, at_ns: int) -> float:
        return (at_ns - self.reading.first_ns) / 1e9


def _give(batch: Batch, channel: Channel, message: Message) -> None:
    if channel.role == "joystick":
        batch.joystick(message)
    elif channel.role == "actuators":
        batch.actuators(message)
    elif channel.role == "enabled":
        batch.enabled(message)
    else:
        batch.pose(channel.name, channel.key, message)


def _alive(payload: bytes, before: bool | None) -> bool | None:
    with contextlib.suppress(msgspec.DecodeError, KeyError, TypeError):
        return bool(msgspec.json.decode(payload)["alive"])
    return before


def _stamp(sample: ActuatorSample) -> float:
    return sample.stamp_s
