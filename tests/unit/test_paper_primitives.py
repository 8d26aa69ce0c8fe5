"""Primitives of a recorded run, and what predictors said of them beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.paper_estimates import N_INIT, PREDICTORS, judge
from rampe_guard.evaluate.paper_primitives import Primitives, primitives_of
from tests.support.paper import made_primitives

ACTUATORS = (
    ActuatorConfig("swing", 1, -1, 30.0, 60.0, 0.1, 0.1, "deg"),
    ActuatorConfig("boom", 0, 1, 0.15, 0.5, 0.1, 0.1, "m"),
)
LIMITS = np.array([[-90.0, 90.0], [2.3, 3.2]])
BOTH, ALONE, BACK = (1, 1), (1, 0), (-1, -1)


def recorded(
    parts: list[tuple[tuple[int, int], float]],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Levers held as said for the seconds said; the arm follows at once, 10 deg/s and 0.1 m/s."""
    signs = np.repeat([s for s, _ in parts], [round(t * 50) for _, t in parts], axis=0)
    position = np.array([0.0, 2.6]) + np.cumsum(signs * [10.0, 0.1], axis=0) / 50
    axes = np.column_stack([signs[:, 1], -signs[:, 0]]) * 0.8  # boom on axis 0, swing inverted
    return np.arange(len(signs)) / 50, axes, position


def test_categories_starts_and_displacements_are_those_of_the_motion() -> None:
    time_s, axes, position = recorded(
        [((0, 0), 0.5), (BOTH, 1.0), (ALONE, 0.6), ((0, 0), 0.5), (BACK, 1.5), ((0, 0), 0.5)]
    )
    found = primitives_of(time_s, axes, position, ACTUATORS)
    assert found.category == (BOTH, ALONE, BACK)
    # a lever is read through a filter of 0.05 s: a change is seen within 0.15 s
    moved = np.array([[10.0, 0.1], [6.0, 0.0], [-15.0, -0.15]])
    assert found.displacement == pytest.approx(moved, abs=1.6)
    assert found.displacement[:, 1] == pytest.approx(moved[:, 1], abs=0.016)
    assert found.start[1] == pytest.approx(found.start[0] + found.displacement[0])
    assert found.end_s - found.start_s == pytest.approx([1.0, 0.6, 1.5], abs=0.16)


def test_what_is_under_way_at_the_end_is_no_primitive() -> None:
    found = primitives_of(*recorded([((0, 0), 0.5), (BOTH, 1.0), (ALONE, 1.0)]), ACTUATORS)
    assert found.category == (BOTH,)


def test_no_motion_no_primitives() -> None:
    found = primitives_of(*recorded([((0, 0), 2.0)]), ACTUATORS)
    assert found.category == ()
    assert found.start.shape == found.displacement.shape == (0, 2)


def test_occurrences_count_per_category_and_the_most_frequent_come_first() -> None:
    category = [ALONE, BOTH, BOTH, BACK, ALONE, BOTH]
    p = made_primitives(category, np.zeros((6, 2)), np.zeros((6, 2)))
    assert p.occurrence.tolist() == [1, 1, 2, 1, 2, 3]
    assert p.most_frequent(2) == (BOTH, ALONE)
    assert p.of(BOTH).tolist() == [1, 2, 5]
    time_s, axes, position = recorded([((0, 0), 0.3), *([(BOTH, 0.5), ((0, 0), 0.3)] * 3)])
    assert primitives_of(time_s, axes, position, ACTUATORS).occurrence.tolist() == [1, 2, 3]


def linear(count: int, seed: int) -> Primitives:
    """x exactly linear in q, as the paper's model has it."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([0.0, 2.6], [40.0, 2.9], (count, 2))
    x = start @ np.array([[0.2, 0.0], [0.0, 0.1]]) + [5.0, 0.05]
    return made_primitives([BOTH] * count, start, x)


def test_faithful_says_nothing_three_times_and_then_knows_a_linear_world() -> None:
    run = judge(1, linear(12, 3), LIMITS)
    assert not run.estimate["faithful"][:N_INIT].any()
    # not to the last digit: with degrees beside metres the tolerance cuts a direction
    error = np.abs(run.error("faithful")) / run.primitives.displacement
    assert error[:N_INIT].min() == 1.0
    assert error[N_INIT:].max() < 0.05
    assert run.initialised.tolist() == [False] * 3 + [True] * 9


def test_running_mean_is_the_mean_of_all_before() -> None:
    primitives = linear(6, 4)
    said = judge(1, primitives, LIMITS).estimate["running mean"]
    assert not said[0].any()
    for k in range(1, 6):
        assert said[k] == pytest.approx(primitives.displacement[:k].mean(axis=0))


def test_default_never_goes_against_the_category_nor_past_a_limit() -> None:
    rng = np.random.default_rng(5)
    start = rng.uniform([60.0, 2.9], [89.0, 3.19], (30, 2))
    x = rng.uniform([-5.0, -0.1], [40.0, 0.5], (30, 2))
    said = judge(1, made_primitives([BOTH] * 30, start, x), LIMITS).estimate["default"]
    assert np.all(said >= 0.0)
    assert np.all(start + said <= LIMITS[:, 1] + 1e-9)
    assert said.any()


@given(seed=st.integers(0, 1000), cut=st.integers(1, 11))
@settings(max_examples=25, deadline=None)
def test_no_estimate_knows_what_comes_later(seed: int, cut: int) -> None:
    whole = linear(12, seed)
    told = whole.displacement.copy()
    told[cut:] += [17.0, 0.3]
    other = made_primitives(whole.category, whole.start, told)
    one, two = judge(1, whole, LIMITS), judge(1, other, LIMITS)
    for predictor in PREDICTORS:
        a, b = one.estimate[predictor], two.estimate[predictor]
        np.testing.assert_array_equal(a[: cut + 1], b[: cut + 1])
        assert cut < N_INIT or cut > 10 or not np.array_equal(a[cut + 1 :], b[cut + 1 :])
