import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.config import ActuatorConfig, JoystickConfig
from rampe_guard.core.joystick import CategoryChange, CategoryDetector

ACTUATORS = (
    ActuatorConfig("swing", 0, 1, 0.6, 1.2, 0.1, 0.1, "rad"),
    ActuatorConfig("boom", 2, -1, 0.2, 0.5, 0.1, 0.1, "m"),
)


def detector(**kwargs: float) -> CategoryDetector:
    return CategoryDetector(ACTUATORS, JoystickConfig(**kwargs))


def drive(
    d: CategoryDetector, axes: list[float], start: float, seconds: float
) -> list[CategoryChange]:
    changes = []
    for k in range(round(seconds * 100)):
        change = d.update(start + k * 0.01, np.array(axes))
        if change:
            changes.append(change)
    return changes


def test_axis_and_sign_name_the_category() -> None:
    d = detector()
    drive(d, [0, 0, 0], 0, 0.5)
    (change,) = drive(d, [0.5, 1.0, 0.5], 0.5, 0.5)
    assert change.category == (1, -1)
    assert d.category == (1, -1)
    np.testing.assert_allclose(d.command, [0.5, -0.5], atol=1e-3)


def test_a_change_is_dated_back_to_its_first_sample() -> None:
    d = detector(filter_s=0.0, debounce_s=0.08)
    drive(d, [0, 0, 0], 0, 0.5)
    (change,) = drive(d, [1, 0, 0], 0.5, 0.5)
    assert change.since_s == pytest.approx(0.5)


def test_a_blip_shorter_than_the_debounce_is_no_motion() -> None:
    d = detector(filter_s=0.0, debounce_s=0.08)
    drive(d, [0, 0, 0], 0, 0.5)
    assert drive(d, [1, 0, 0], 0.5, 0.07) == []
    assert drive(d, [0, 0, 0], 0.57, 0.5) == []


def test_levers_let_go_a_moment_apart_make_one_change() -> None:
    d = detector(filter_s=0.0, debounce_s=0.08)
    drive(d, [1, 0, 1], 0, 0.5)
    changes = drive(d, [1, 0, 0], 0.5, 0.05) + drive(d, [0, 0, 0], 0.55, 0.5)
    assert [c.category for c in changes] == [(0, 0)]


def test_noise_at_the_deadband_does_not_flicker() -> None:
    d = detector(filter_s=0.0, debounce_s=0.0, release_ratio=0.7)
    rng = np.random.default_rng(1)
    changes = []
    drive(d, [0.2, 0, 0], 0, 0.1)
    for k in range(1000):
        axes = np.array([0.1 + 0.02 * rng.uniform(-1, 1), 0.0, 0.0])
        changes.append(d.update(0.1 + k * 0.01, axes))
    assert not any(changes)
    assert d.category == (1, 0)


def test_a_held_lever_counts_without_new_messages() -> None:
    d = detector(filter_s=0.0, debounce_s=0.08)
    d.update(0.0, np.zeros(3))
    assert d.update(1.0, np.array([1.0, 0, 0])) is None
    change = d.advance(1.1)
    assert change == CategoryChange((1, 0), 1.0)


def test_nothing_is_commanded_before_the_first_message() -> None:
    d = detector()
    assert d.advance(5.0) is None
    assert d.category == (0, 0)


@given(
    st.lists(
        st.tuples(st.floats(0.001, 0.3), st.lists(st.floats(-1, 1), min_size=3, max_size=3)),
        max_size=60,
    )
)
def test_category_changes_are_real_and_in_order(steps: list[tuple[float, list[float]]]) -> None:
    d = detector()
    now, last, since = 0.0, d.category, -np.inf
    for dt, axes in steps:
        now += dt
        change = d.update(now, np.array(axes))
        assert np.abs(d.command).max() <= 1.0 + 1e-12
        if change:
            assert change.category != last
            assert since <= change.since_s <= now
            last, since = change.category, change.since_s
        assert d.category == last
