from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rampe_guard.core.rotation import rotation_of_quaternion, rotation_of_rpy

ANGLES = st.tuples(*[st.floats(-7.0, 7.0)] * 3)
PARTS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 1e-3)


@given(ANGLES)
def test_rpy_is_what_scipy_says(rpy: tuple[float, float, float]) -> None:
    assert rotation_of_rpy(rpy) == pytest.approx(
        Rotation.from_euler("xyz", rpy).as_matrix(), abs=2e-15
    )


@given(PARTS)
def test_a_quaternion_is_what_scipy_says(xyzw: tuple[float, float, float, float]) -> None:
    assert rotation_of_quaternion(xyzw) == pytest.approx(
        Rotation.from_quat(xyzw).as_matrix(), abs=2e-15
    )


def test_no_turn_is_exact() -> None:
    assert np.array_equal(rotation_of_rpy((0.0, 0.0, 0.0)), np.eye(3))
    assert np.array_equal(rotation_of_quaternion((0.0, 0.0, 0.0, 2.0)), np.eye(3))


def test_turns_are_about_the_fixed_axes() -> None:
    quarter = math.pi / 2
    turned = rotation_of_rpy((quarter, 0.0, quarter)) @ [0.0, 1.0, 0.0]
    assert turned == pytest.approx([0.0, 0.0, 1.0])  # y up by the roll, then yaw leaves it
