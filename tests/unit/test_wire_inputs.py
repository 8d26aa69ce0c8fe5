"""Messages that arrive: taken whole and in order, or refused with a reason."""

from __future__ import annotations

import json

import pytest

from rampe_guard.errors import MessageError
from rampe_guard.wire import (
    MAX_PAYLOAD_BYTES,
    ActuatorsMessage,
    JoystickMessage,
    ObjectPose,
    SweepRequest,
    decode_actuators,
    decode_joystick,
    decode_object_pose,
    decode_sweep_request,
)

NAMES = ("swing", "boom")


def test_joystick_is_taken() -> None:
    payload = b'{"stamp": 12.34, "axes": [0.0, -0.4, 1], "buttons": [true], "seq": 7}'
    assert decode_joystick(payload, 3) == JoystickMessage(axes=(0.0, -0.4, 1.0), stamp=12.34)


def test_joystick_needs_no_stamp_and_drops_axes_that_nobody_uses() -> None:
    assert decode_joystick(b'{"axes": [0.5, 255]}', 1) == JoystickMessage(axes=(0.5,))


def test_joystick_axis_a_little_too_far_is_clipped() -> None:
    assert decode_joystick(b'{"axes": [1.05, -1.02]}', 2).axes == (1.0, -1.0)


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"", "bad_json"),
        (b"[0, 0]", "bad_json"),
        (b'{"axes": [0, "0"]}', "bad_json"),
        (b'{"axes": [0, true]}', "bad_json"),
        (b'{"axes": [0, 0], "st\xc0\x80mp": 1}', "bad_json"),
        (b'{"axes": [0, null]}', "bad_json"),
        (b'{"stamp": 1}', "bad_json"),
        (b'{"axes": [0, 0], "stamp": "now"}', "bad_json"),
        (b'{"axes": [0, 0]', "bad_json"),
        (b'{"axes": [0, 0]} x', "bad_json"),
        (b'{"axes": [0, 0], "x": ' + b"[" * 60_000, "bad_json"),
        (b'{"axes": [0, NaN]}', "not_finite"),
        (b'{"axes": [0, -Infinity]}', "not_finite"),
        (b'{"axes": [0, 1e999]}', "not_finite"),
        (b'{"axes": [0, ' + b"9" * 400 + b"]}", "not_finite"),
        (b'{"axes": [0, 0], "stamp": 1.7e18}', "not_finite"),
        (b'{"axes": [0]}', "wrong_length"),
        (json.dumps({"axes": [0] * 65}).encode(), "wrong_length"),
        (b'{"axes": [0, 1.06]}', "axis_out_of_range"),
        (b'{"axes": [-1e308, 0]}', "axis_out_of_range"),
        (b'{"axes": [0, 0]}' + b" " * MAX_PAYLOAD_BYTES, "too_large"),
    ],
)
def test_joystick_is_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(MessageError) as caught:
        decode_joystick(payload, 2)
    assert caught.value.reason == reason
    assert str(caught.value).startswith(f"{reason}: ")


def test_actuators_are_taken() -> None:
    payload = b'{"stamp": 1, "position": [0.1, 2], "velocity": [0, -1]}'
    expected = ActuatorsMessage(position=(0.1, 2.0), velocity=(0.0, -1.0), stamp=1.0)
    assert decode_actuators(payload, NAMES) == expected
    bare = b'{"position": [0.1, 2], "velocity": null}'
    assert decode_actuators(bare, NAMES) == ActuatorsMessage(position=(0.1, 2.0))


def test_actuators_are_put_in_the_sites_order() -> None:
    payload = b'{"position": [2, 0.1], "velocity": [-1, 0], "name": ["boom", "swing"]}'
    expected = ActuatorsMessage(position=(0.1, 2.0), velocity=(0.0, -1.0))
    assert decode_actuators(payload, NAMES) == expected


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b'{"position": [0]}', "wrong_length"),
        (b'{"position": [0, 0, 0]}', "wrong_length"),
        (b'{"position": [0, 0], "velocity": []}', "wrong_length"),
        (b'{"position": [0, 1e308]}', "not_finite"),
        (b'{"position": [0, 0], "velocity": [0, -1e7]}', "not_finite"),
        (b'{"position": [0, 0], "stamp": -1e13}', "not_finite"),
        (b'{"position": [0, 0], "name": ["swing", "bom"]}', "bad_name"),
        (b'{"position": [0, 0], "name": ["swing", "swing"]}', "bad_name"),
        (b'{"position": [0, 0], "name": ["swing"]}', "bad_name"),
        (b'{"position": [0, 0], "name": []}', "bad_name"),
        (b'{"position": [0, 0], "name": "swing"}', "bad_json"),
        (b'{"velocity": [0, 0]}', "bad_json"),
        (b'{"position": [0, 0], "name": ["\xff", "boom"]}', "bad_json"),
    ],
)
def test_actuators_are_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(MessageError) as caught:
        decode_actuators(payload, NAMES)
    assert caught.value.reason == reason


def test_object_pose_is_taken() -> None:
    payload = b'{"stamp": 12.34, "xyz_m": [1, 2, 3], "rpy_rad": [0, 0, 0.5], "speed": 3}'
    expected = ObjectPose(xyz_m=(1.0, 2.0, 3.0), rpy_rad=(0.0, 0.0, 0.5), stamp=12.34)
    assert decode_object_pose(payload) == expected
    bare = b'{"xyz_m": [1, 2, 3], "quaternion_xyzw": [0, 0, 0, -1], "rpy_rad": null}'
    assert decode_object_pose(bare) == ObjectPose(
        xyz_m=(1.0, 2.0, 3.0), quaternion_xyzw=(0.0, 0.0, 0.0, -1.0)
    )


def test_a_rounded_quaternion_gets_the_length_one() -> None:
    pose = decode_object_pose(b'{"xyz_m": [0, 0, 0], "quaternion_xyzw": [0.5005, 0.5, 0.5, 0.5]}')
    assert pose.quaternion_xyzw is not None
    assert sum(value**2 for value in pose.quaternion_xyzw) == pytest.approx(1.0, abs=1e-15)


AT = b'{"xyz_m": [0, 0, 0], '


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b'{"rpy_rad": [0, 0, 0]}', "bad_json"),
        (b'{"xyz_m": null, "rpy_rad": [0, 0, 0]}', "bad_json"),
        (AT + b'"rpy_rad": [0, 0, true]}', "bad_json"),
        (AT + b'"rpy_rad": [0, 0, 0], "stamp": "now"}', "bad_json"),
        (b'{"xyz_m": [0, 0], "rpy_rad": [0, 0, 0]}', "wrong_length"),
        (AT + b'"rpy_rad": [0, 0, 0, 0]}', "wrong_length"),
        (AT + b'"quaternion_xyzw": [0, 0, 1]}', "wrong_length"),
        (b'{"xyz_m": [0, 0, 1e7], "rpy_rad": [0, 0, 0]}', "not_finite"),
        (b'{"xyz_m": [0, 0, NaN], "rpy_rad": [0, 0, 0]}', "not_finite"),
        (AT + b'"rpy_rad": [0, 0, -1e7]}', "not_finite"),
        (AT + b'"rpy_rad": [0, 0, 0], "stamp": 1.7e18}', "not_finite"),
        (b'{"xyz_m": [0, 0, 0]}', "bad_rotation"),
        (AT + b'"rpy_rad": null}', "bad_rotation"),
        (AT + b'"rpy_rad": [0, 0, 0], "quaternion_xyzw": [0, 0, 0, 1]}', "bad_rotation"),
        (AT + b'"quaternion_xyzw": [0, 0, 0, 0]}', "bad_rotation"),
        (AT + b'"quaternion_xyzw": [0, 0, 0, 1.0011]}', "bad_rotation"),
        (AT + b'"quaternion_xyzw": [0, 0, 0, 0.9989]}', "bad_rotation"),
        (AT + b'"rpy_rad": [0, 0, 0]}' + b" " * MAX_PAYLOAD_BYTES, "too_large"),
    ],
)
def test_object_pose_is_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(MessageError) as caught:
        decode_object_pose(payload)
    assert caught.value.reason == reason


def test_sweep_request() -> None:
    expected = SweepRequest(start=(0.0, 1.0), displacement=(0.5, 0.0))
    assert decode_sweep_request(b'{"start": [0, 1], "displacement": [0.5, 0]}', 2) == expected


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b'{"start": [0, 1]}', "bad_json"),
        (b'{"start": [0, 1], "displacement": [0]}', "wrong_length"),
        (b'{"start": [0, 1e300], "displacement": [0, 0]}', "not_finite"),
        (b'{"start": [0, NaN], "displacement": [0, 0]}', "not_finite"),
    ],
)
def test_sweep_request_is_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(MessageError) as caught:
        decode_sweep_request(payload, 2)
    assert caught.value.reason == reason
