"""Joints in any order, among any others, are the same actuators; rubbish is refused by name."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.drive import joint_scalar
from rampe_guard.errors import MessageError
from rampe_guard.ros2.inputs import JointReader, decode_joy
from rampe_guard.ros2.inverse import Inverse
from rampe_guard.ros2.outputs import encode_joint_state
from rampe_guard.settings import load_site
from tests.support.processes import BENCH
from tests.support.ros2 import LIMITS, angles_of, joint_state, joy

SITE = load_site(BENCH)
DRIVES = SITE.arm.joints[:4]
READER = JointReader(DRIVES, LIMITS)
shares = st.tuples(*[st.floats(0.0, 1.0)] * 4)
others = st.dictionaries(st.text(min_size=1, max_size=8), st.floats(), max_size=5)
GOOD = (joy((0.1, 0.2, 0.3, 0.4), 1.0), joint_state(angles_of(SITE, (0.0, 0.06, 0.08, 0.03)), 1.0))


def position(share: tuple[float, ...]) -> list[float]:
    return [float(a + s * (b - a)) for s, (a, b) in zip(share, LIMITS, strict=True)]


@given(shares, others, st.randoms())
def test_joints_in_any_order_are_the_same_actuators(
    share: tuple[float, ...], more: dict[str, float], chance: random.Random
) -> None:
    q = position(share)
    own = {d.joint: joint_scalar(d.drive, value) for d, value in zip(DRIVES, q, strict=True)}
    angles = {**more, **own}
    names = list(angles)
    chance.shuffle(names)
    said = READER(joint_state(angles, 2.0, names=names))
    assert said.position == pytest.approx(q, abs=1e-9)
    assert READER(encode_joint_state(DRIVES, q, 2.0)).position == pytest.approx(q, abs=1e-9)


@given(st.integers(0, 3), st.floats(-0.02, 1.02), st.floats(-5.0, 5.0))
def test_an_inverse_undoes_its_drive(index: int, share: float, speed: float) -> None:
    low, high = (float(v) for v in LIMITS[index])
    drive = DRIVES[index].drive
    inverse = Inverse(drive, low, high)
    q = low + share * (high - low)
    assert inverse.actuator(joint_scalar(drive, q)) == pytest.approx(q, abs=1e-9)
    step = 1e-6 * (high - low)
    slope = (joint_scalar(drive, q + step) - joint_scalar(drive, q - step)) / (2.0 * step)
    assert inverse.speed(q, speed * slope) == pytest.approx(speed, rel=1e-4, abs=1e-6)


@given(st.sampled_from([0, 1]), st.data())
def test_bytes_that_were_changed_are_read_or_refused_and_nothing_else(
    which: int, data: st.DataObject
) -> None:
    content = bytearray(GOOD[which])
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    payload = bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        if which:
            said = READER(payload)
            assert np.isfinite(said.position).all()
            assert said.velocity is None or np.isfinite(said.velocity).all()
        else:
            assert (np.abs(decode_joy(payload, 4).axes) <= 1.0).all()
    except MessageError as error:
        refused = error
    else:
        return
    assert refused.reason.isidentifier()
    assert str(refused).isprintable()
