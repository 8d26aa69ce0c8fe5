"""What was heard of a machine of which nobody has described anything yet: messages → `Traces`.

Messages are read as a guard reads them, less what only a site file could tell: how many axes and
actuators there are is what most messages say.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from rampe_guard import wire
from rampe_guard.core.identify_signals import Traces
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import LogError, MessageError
from rampe_guard.recording import McapReading, is_mcap
from rampe_guard.recording.channels import role_of
from rampe_guard.runtime.decoding import Decoders
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES, Message
from rampe_guard.wire.inputs import MAX_VALUE

M = TypeVar("M", bound=Message)

Arrived = tuple[float, bytes]
"""When a message came [s], and the message."""
_LEAST_S, _CLOCK_FACTOR = 1.0, 10.0
"""Stamps and arrivals of so long must not be so many times apart."""
_SAMPLE = 50
"""Messages of a topic that are looked at to find out what it is."""
_JSON = Decoders(
    lambda payload: wire.decode(payload, wire.JoystickMessage, limit=MAX_PAYLOAD_BYTES),
    lambda payload: wire.decode(payload, wire.ActuatorsMessage, limit=MAX_PAYLOAD_BYTES),
)


@dataclass(frozen=True, slots=True)
class Heard:
    """What was heard, and where.

    Attributes:
        traces: of both inputs.
        joystick: key or columns of the levers.
        actuators: key or columns of the positions.
        origin: where it comes from, in words.
        refused: reasons of messages that could not be used, and how many.
        columns: of a CSV log, as a site file's ``log`` has them; None for anything else.
        ros2: its messages are those of ROS 2, its keys topics, and its names those of joints.
    """

    traces: Traces
    joystick: str
    actuators: str
    origin: str
    refused: Counter[str] = field(default_factory=Counter)
    columns: dict[str, Any] | None = None
    ros2: bool = False

    @property
    def column_names(self) -> list[str] | None:
        """Of the positions of a CSV log."""
        if self.columns is None:
            return None
        return [column.column for column in self.columns["actuators"]]

    @property
    def seconds(self) -> float:
        """Length of what was heard of the positions [s]."""
        times = self.traces.time_s
        return float(times[-1] - times[0]) if len(times) else 0.0


def reasons(refused: Counter[str]) -> str:
    """What was refused, in words to add to a sentence."""
    told = ", ".join(f"{count} {reason}" for reason, count in refused.most_common())
    return f" (refused: {told})" if told else ""


def heard_in_file(path: str, joystick: str | None, actuators: str | None) -> Heard:
    """Both inputs of a recording (MCAP).

    Args:
        path: of the file.
        joystick: key of the levers; None: known by its role, or by what its messages hold.
        actuators: the same of the positions.

    Raises:
        LogError: it cannot be read, or an input is not found in it.
    """
    if not is_mcap(path):
        raise LogError(f"{path}: is no MCAP recording; for a CSV log give --time and columns")
    reading = McapReading(path)
    by_topic: dict[str, list[Arrived]] = {}
    roles: dict[str, str] = {}
    for message in reading.messages():
        topic = message.channel.topic
        if (role := role_of(message.channel.metadata)) is not None:
            roles.setdefault(role, topic)
        by_topic.setdefault(topic, []).append((message.at_ns / 1e9, message.payload))
    found = {
        "joystick": joystick or roles.get("joystick") or _holding(by_topic, "axes", path),
        "actuators": actuators or roles.get("actuators") or _holding(by_topic, "position", path),
    }
    for what, topic in found.items():
        if topic not in by_topic:
            known = ", ".join(sorted(by_topic))
            raise LogError(f"{path}: no topic {topic!r} for --{what}; it has {known}")
    topics = found["joystick"], found["actuators"]
    levers, positions = (by_topic[topic] for topic in topics)
    return heard_in_json(levers, positions, topics, Path(path).name)


def heard_in_json(
    levers: Sequence[Arrived], positions: Sequence[Arrived], keys: tuple[str, str], origin: str
) -> Heard:
    """Both inputs, of messages of our own.

    Args:
        levers: of the joystick.
        positions: of the actuators.
        keys: of the same.
        origin: where they come from, in words.

    Raises:
        LogError: none of them can be used.
    """
    return heard_of(levers, positions, _JSON, keys, origin)


def heard_of(
    levers: Sequence[Arrived],
    positions: Sequence[Arrived],
    decoders: Decoders,
    keys: tuple[str, str],
    origin: str,
) -> Heard:
    """The same of messages that ``decoders`` read."""
    traces, refused = traces_of(levers, positions, decoders)
    if not (traces.axes.size and traces.position.size):
        raise LogError(f"{origin}: no usable message of both inputs{reasons(refused)}")
    return Heard(traces, *keys, origin, refused)


def traces_of(
    levers: Iterable[Arrived], positions: Iterable[Arrived], decoders: Decoders = _JSON
) -> tuple[Traces, Counter[str]]:
    """Decoded messages, and the reasons of those that could not be used.

    If every message of an input has a stamp, its times are the stamps, put off by the shortest way
    that any message took: so a sender with another clock does no harm. Else they are the arrivals.

    Raises:
        LogError: stamps are no time.
    """
    refused: Counter[str] = Counter()
    sticks = _decoded(levers, decoders.joystick, "joystick", refused)
    places = _decoded(positions, decoders.actuators, "actuators", refused)
    sticks = _alike(sticks, lambda m: m.axes, "joystick", refused)
    places = _alike(places, lambda m: m.position, "actuators", refused)
    names = places[0][1].name if places else None
    times, rows = [], []
    for at_s, place in places:
        order = _order(place.name, names, len(place.position))
        if order is None:
            refused["actuators: bad_name"] += 1
            continue
        times.append((at_s, place.stamp))
        rows.append([place.position[i] for i in order])
    sent = [(at_s, m.stamp) for at_s, m in sticks]
    for what, stamps in (("joystick", sent), ("actuators", times)):
        _check_stamps(what, stamps)
    traces = Traces(
        lever_s=on_our_clock(sent),
        axes=np.array([m.axes for _, m in sticks], dtype=np.float64).reshape(len(sticks), -1),
        time_s=on_our_clock(times),
        position=np.array(rows, dtype=np.float64).reshape(len(rows), -1),
        names=names,
    )
    return traces, +refused


def _check_stamps(what: str, times: Sequence[tuple[float, float | None]]) -> None:
    """Stamps must go on about as fast as the time in which messages came.

    Raises:
        LogError: they are in another unit, or the clock was set.
    """
    stamped = [(at_s, stamp_s) for at_s, stamp_s in times if stamp_s is not None]
    if len(stamped) < max(2, len(times)):
        return
    came_s = stamped[-1][0] - stamped[0][0]
    sent_s = abs(stamped[-1][1] - stamped[0][1])
    if came_s < _LEAST_S or came_s / _CLOCK_FACTOR <= sent_s <= came_s * _CLOCK_FACTOR:
        return
    raise LogError(
        f"{what}: stamps go on by {sent_s:.3g} s while {came_s:.3g} s pass: is stamp in seconds, or"
        " was the sender's clock set? A guard refuses such messages"
    )


def on_our_clock(times: Sequence[tuple[float, float | None]]) -> FloatArray:
    """When messages were sent [s], of their arrivals and stamps; see `traces_of`."""
    arrival_s = np.array([at_s for at_s, _ in times], dtype=np.float64)
    stamps = [stamp_s for _, stamp_s in times if stamp_s is not None]
    if not times or len(stamps) < len(times):
        return arrival_s
    stamp_s = np.array(stamps, dtype=np.float64)
    return np.asarray(stamp_s + (arrival_s - stamp_s).min())


def _decoded(
    arrived: Iterable[Arrived], decode: Callable[[bytes], M], what: str, refused: Counter[str]
) -> list[tuple[float, M]]:
    found = []
    for at_s, payload in arrived:
        try:
            found.append((at_s, decode(payload)))
        except MessageError as error:
            refused[f"{what}: {error.reason}"] += 1
    return found


def _alike(
    messages: list[tuple[float, M]],
    values: Callable[[M], tuple[float, ...]],
    what: str,
    refused: Counter[str],
) -> list[tuple[float, M]]:
    """Those with as many values as most have, none of them rubbish."""
    sound = [pair for pair in messages if all(abs(v) <= MAX_VALUE for v in values(pair[1]))]
    refused[f"{what}: not_finite"] += len(messages) - len(sound)
    counts = Counter(len(values(message)) for _, message in sound)
    if not counts:
        return []
    usual = counts.most_common(1)[0][0]
    refused[f"{what}: wrong_length"] += len(sound) - counts[usual]
    return [pair for pair in sound if len(values(pair[1])) == usual]


def _order(
    given: tuple[str, ...] | None, names: tuple[str, ...] | None, count: int
) -> list[int] | None:
    """Where each of ``names`` stands in a message; None if they are not the same."""
    if given is None or names is None:
        return list(range(count)) if given is names else None
    if len(given) != count or sorted(given) != sorted(names) or len(set(given)) != count:
        return None
    return [given.index(name) for name in names]


def _holding(by_topic: Mapping[str, list[Arrived]], field_: str, path: str) -> str:
    """The one topic whose messages are JSON with ``field_``.

    Raises:
        LogError: there is none, or there are several.
    """
    found = [t for t, all_ in by_topic.items() if _has(all_[:_SAMPLE], field_)]
    if len(found) == 1:
        return found[0]
    option = {"axes": "--joystick", "position": "--actuators"}[field_]
    told = "several topics hold" if found else "no topic holds"
    raise LogError(
        f"{path}: {told} {field_!r}; name one with {option}: {', '.join(sorted(by_topic))}"
    )


def _has(messages: list[Arrived], field_: str) -> bool:
    good = 0
    for _, payload in messages:
        try:
            said = wire.decode(payload, dict[str, Any], limit=MAX_PAYLOAD_BYTES)
        except MessageError:
            continue
        good += isinstance(said.get(field_), list)
    return 2 * good > len(messages)
