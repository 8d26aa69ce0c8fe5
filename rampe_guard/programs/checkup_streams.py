"""Inputs as they were heard, judged as a guard judges them: by its decoder and its gate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.identify import Traces
from rampe_guard.core.inputs import Accepted, InputGate
from rampe_guard.core.types import (
    ActuatorSample,
    EnabledSample,
    FloatArray,
    Inputs,
    JoystickSample,
    ObjectSample,
)
from rampe_guard.errors import MessageError
from rampe_guard.programs.measuring import on_our_clock
from rampe_guard.programs.measuring_live import Listening
from rampe_guard.runtime.batch import Batch
from rampe_guard.runtime.decoding import decoders_of
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import Site

OBJECT = "object "
"""How the names of streams of objects begin."""
_USABLE = 0.5
"""Less than this share of messages that can be used is no stream."""


@dataclass(frozen=True, slots=True)
class Stream:
    """One input as it was heard.

    Attributes:
        name: joystick, actuators, switch or the name of an object.
        key: it came on.
        arrival_s: of every message that can be used (k,) [s].
        stamp_s: of the same, where all have one (k,) [s]; else empty.
        refused: reasons, and how often.
        silence_s: since the newest message at the end [s]; None if there was none.
        timeout_s: silence that is a fault [s].
        needed: without it nothing is guarded.
        strange: what else is published on its topic of ROS 2, in words.
    """

    name: str
    key: str
    arrival_s: FloatArray
    stamp_s: FloatArray
    refused: Counter[str]
    silence_s: float | None
    timeout_s: float
    needed: bool = True
    strange: str = ""

    @property
    def latency_s(self) -> FloatArray:
        """Arrival less stamp (k,) [s]: the way, and the distance of both clocks."""
        return self.arrival_s - self.stamp_s if len(self.stamp_s) else self.stamp_s

    @property
    def problem(self) -> str | None:
        """Why it cannot be used, None if it can."""
        bad = self.refused.total()
        if self.silence_s is None:
            why = f"; {self.strange}" if self.strange else " that is put on that key"
            return f"nothing came on {self.key}" + ("" if not bad else why)
        if len(self.arrival_s) < _USABLE * (len(self.arrival_s) + bad):
            return f"{bad} of {bad + len(self.arrival_s)} messages on {self.key} are refused"
        if self.silence_s > self.timeout_s:
            return f"{self.key} fell silent {self.silence_s:.2f} s ago (timeout {self.timeout_s:g})"
        return None


class Judge:
    """Messages of a site, through its decoder and its gate."""

    def __init__(self, site: Site, limits: FloatArray) -> None:
        self._site, self._decoders = site, decoders_of(site, limits)
        self._gate = InputGate(site.guard.actuators, limits, site.guard.inputs, site.guard.axes)
        self.levers: list[JoystickSample] = []
        self.places: list[ActuatorSample] = []

    def stream(self, name: str, timeout_s: float, one: Listening, end_s: float) -> Stream:
        """What one input was like."""
        refused = Counter(one.refused)
        good: list[tuple[float, float | None]] = []
        for at_s, payload in one.messages:
            batch = Batch(self._site, at_s, _into(refused), self._decoders)
            _give(batch, name, Message(one.key, payload))
            good += self._accepted(batch.inputs(None), refused)
        stamps = [stamp_s for _, stamp_s in good if stamp_s is not None]
        inputs = self._site.guard.inputs
        silent = name == "enabled" or (name == "joystick" and inputs.joystick_on_change)
        return Stream(
            name=name,
            key=one.key,
            arrival_s=np.array([at_s for at_s, _ in good], dtype=np.float64),
            stamp_s=np.array(stamps if len(stamps) == len(good) else [], dtype=np.float64),
            refused=refused,
            silence_s=end_s - one.messages[-1][0] if one.messages else None,
            timeout_s=timeout_s,
            needed=not silent,
            strange=one.why,
        )

    def traces(self) -> Traces:
        """Of all that the gate let through."""
        actuators = self._site.guard.actuators
        axes, places = self._site.guard.axes, len(actuators)
        return Traces(
            on_our_clock([_times(s) for s in self.levers]),
            np.array([s.axes[:axes] for s in self.levers]).reshape(len(self.levers), axes),
            on_our_clock([_times(s) for s in self.places]),
            np.array([s.position for s in self.places]).reshape(len(self.places), places),
            self._site.actuator_names,
        )

    def _accepted(
        self, inputs: Inputs, refused: Counter[str]
    ) -> Iterator[tuple[float, float | None]]:
        """Arrival and stamp [s] of what can be used."""
        for lever in inputs.joystick:
            said = self._gate.joystick(lever)
            if isinstance(said, Accepted):
                self.levers.append(said.sample)
                yield _times(lever)
            else:
                refused[said.reason] += 1
        for place in inputs.actuators:
            told = self._gate.actuators(place)
            if isinstance(told, Accepted):
                self.places.append(told.sample)
                yield _times(place)
            else:
                refused[told.reason] += 1
        yield from map(_times, inputs.enabled)
        yield from map(_times, inputs.objects)


def _into(refused: Counter[str]) -> Callable[[str, Message, MessageError], None]:
    def tell(_kind: str, _message: Message, error: MessageError) -> None:
        refused[error.reason] += 1

    return tell


def _times(
    sample: JoystickSample | ActuatorSample | EnabledSample | ObjectSample,
) -> tuple[float, float | None]:
    """Arrival and stamp [s]."""
    return sample.arrival_s, sample.stamp_s if sample.stamped else None


def _give(batch: Batch, name: str, message: Message) -> None:
    if name == "joystick":
        batch.joystick(message)
    elif name == "actuators":
        batch.actuators(message)
    elif name == "enabled":
        batch.enabled(message)
    else:
        batch.pose(name.removeprefix(OBJECT), message.key, message)
