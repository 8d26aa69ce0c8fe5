"""Any bytes that arrive are a message or a refusal; any alert text fits the display."""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Callable
from typing import TypeVar

from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.errors import MessageError
from rampe_guard.wire import (
    MAX_TEXT,
    alert_text,
    decode_actuators,
    decode_joystick,
    decode_object_pose,
)

T = TypeVar("T")

REASONS = {
    "too_large",
    "bad_json",
    "wrong_length",
    "not_finite",
    "axis_out_of_range",
    "bad_name",
    "bad_rotation",
}
NAMES = ("swing", "boom", "stick")

letters = st.sampled_from("ab z→é\n\x7f\u2028\ud800\U0001f6a7")  # a full alphabet is slow to load
texts = st.lists(letters, max_size=90).map("".join)

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(NAMES),
    lambda inner: st.lists(inner, max_size=4),
    max_leaves=6,
)
fields = st.sampled_from(
    ["stamp", "axes", "position", "velocity", "name", "xyz_m", "rpy_rad", "quaternion_xyzw", "x"]
)
objects = st.dictionaries(fields, json_values, max_size=6).map(lambda o: json.dumps(o).encode())
payloads = st.binary(max_size=200) | objects
unit = st.floats(-1.0, 1.0)
positions = st.floats(-1e6, 1e6)


def taken(decode: Callable[[], T]) -> T | None:
    """The message, or None after a refusal with a proper reason."""
    reason = ""
    try:
        return decode()
    except MessageError as error:
        reason = error.reason
    assert reason in REASONS
    return None


@given(payload=payloads, axes=st.integers(1, 4))
def test_joystick_bytes_become_a_sound_message_or_a_reason(payload: bytes, axes: int) -> None:
    message = taken(lambda: decode_joystick(payload, axes))
    if message is not None:
        assert len(message.axes) == axes
        assert all(-1.0 <= value <= 1.0 for value in message.axes)
        assert message.stamp is None or math.isfinite(message.stamp)


@given(payload=payloads)
def test_actuator_bytes_become_a_sound_message_or_a_reason(payload: bytes) -> None:
    message = taken(lambda: decode_actuators(payload, NAMES))
    if message is not None:
        arrays = [message.position, message.velocity or message.position]
        assert all(len(values) == len(NAMES) for values in arrays)
        assert all(abs(value) <= 1e6 for values in arrays for value in values)


@given(payload=payloads)
def test_pose_bytes_become_a_sound_pose_or_a_reason(payload: bytes) -> None:
    message = taken(lambda: decode_object_pose(payload))
    if message is not None:
        assert all(abs(value) <= 1e6 for value in message.xyz_m)
        turn = message.quaternion_xyzw
        assert (turn is None) is not (message.rpy_rad is None)
        assert turn is None or math.isclose(math.hypot(*turn), 1.0)


@given(
    xyz=st.lists(positions, min_size=3, max_size=3),
    turn=st.lists(unit, min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.01),
    stamp=st.none() | st.floats(0, 1e10),
)
def test_every_sound_pose_is_taken(
    xyz: list[float], turn: list[float], stamp: float | None
) -> None:
    length = math.hypot(*turn)
    quaternion = [value / length for value in turn]
    sent = {"xyz_m": xyz, "quaternion_xyzw": quaternion, "stamp": stamp}
    message = decode_object_pose(json.dumps(sent).encode())
    assert message.xyz_m == tuple(xyz)
    assert message.stamp == stamp
    assert message.quaternion_xyzw is not None
    for got, gave in zip(message.quaternion_xyzw, quaternion, strict=True):
        assert math.isclose(got, gave, abs_tol=1e-12)


@given(axes=st.lists(unit, min_size=3, max_size=8), stamp=st.none() | st.floats(0, 1e10))
def test_every_sound_joystick_message_is_taken_unchanged(
    axes: list[float], stamp: float | None
) -> None:
    message = decode_joystick(json.dumps({"axes": axes, "stamp": stamp}).encode(), 3)
    assert message.axes == tuple(axes[:3])
    assert message.stamp == stamp


@given(
    values=st.lists(st.tuples(positions, positions), min_size=3, max_size=3),
    order=st.permutations(range(3)),
)
def test_any_order_by_name_gives_the_same_message(
    values: list[tuple[float, float]], order: list[int]
) -> None:
    payload = {
        "position": [values[i][0] for i in order],
        "velocity": [values[i][1] for i in order],
        "name": [NAMES[i] for i in order],
    }
    message = decode_actuators(json.dumps(payload).encode(), NAMES)
    assert message.position == tuple(position for position, _ in values)
    assert message.velocity == tuple(velocity for _, velocity in values)


@given(
    link=st.none() | texts,
    zone=st.none() | texts,
    time_s=st.none() | st.floats(),
    level=st.sampled_from(["clear", "caution", "warning", "imminent"]),
    source=st.sampled_from(["stopping", "intent", "next", "contact", "system"]),
)
def test_text_fits_one_line_of_the_display(
    link: str | None, zone: str | None, time_s: float | None, level: str, source: str
) -> None:
    text = alert_text(link, zone, time_s, level, source)
    assert 0 < len(text) <= MAX_TEXT
    assert text.isprintable()


names = st.text("abcxyz-_09éß…→挖斗壁\U0001f6a7", min_size=1, max_size=90)


@given(
    link=names,
    zone=names,
    time_s=st.none() | st.floats(0.0, 1e3),
    level=st.sampled_from(["clear", "caution", "warning", "imminent"]),
    source=st.sampled_from(["stopping", "intent", "next", "contact"]),
    off=st.booleans(),
    inside=st.booleans(),
)
def test_text_always_names_link_zone_and_time(
    link: str, zone: str, time_s: float | None, level: str, source: str, *, off: bool, inside: bool
) -> None:
    text = alert_text(link, zone, time_s, level, source, machine_off=off, in_margin=inside)
    width = sum(2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in text)
    assert max(len(text), width) <= MAX_TEXT
    rest = _without(text, link)
    between = next(
        word for word in (" → ", " at ", " clear of ", " in margin of ") if rest.startswith(word)
    )
    when = _without(rest.removeprefix(between), zone)
    assert re.fullmatch(
        r" now| in [0-9]+\.[0-9] s| in >99 s|, time unknown|: machine off|, not nearing", when
    )
    assert not (inside and " clear of " in text)


def _without(text: str, name: str) -> str:
    """``text`` after ``name``, of which ten letters at least are left if it is cut."""
    cuts = (name[:size] + "…" for size in range(len(name) - 1, 9, -1))
    shown = next(cut for cut in (name, *cuts) if text.startswith(cut))
    return text.removeprefix(shown)


@given(time_s=st.floats(0.1, 99.0))
def test_text_never_promises_more_time_than_there_is(time_s: float) -> None:
    shown = float(alert_text("a", "b", time_s).removeprefix("a → b in ").removesuffix(" s"))
    assert time_s - 0.1 - 1e-6 <= shown <= time_s + 1e-6
