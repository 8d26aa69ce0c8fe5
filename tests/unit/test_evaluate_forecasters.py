"""Each forecaster against a formula of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.neighbors import KNeighborsRegressor

from rampe_guard.core.config import ActuatorConfig, GuardConfig, RampeConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.forecasters import (
    ConstantVelocity,
    FaithfulRampe,
    Forecaster,
    LastValue,
    RunningMean,
    SiteRampe,
    Zero,
)
from rampe_guard.evaluate.forecasters_learned import (
    GaussianProcess,
    NearestNeighbours,
    RiverLeastSquares,
)
from rampe_guard.evaluate.segments import Start
from tests.support.primitives import primitive

WIDTH = np.array([2.0, 0.1])
MIDDLE = np.array([0.5, 0.05])
LIMITS = np.array([[-3.0, 3.0], [0.0, 0.12]])
CONFIG = GuardConfig(
    actuators=(
        ActuatorConfig("swing", 0, 1, 1.0, 4.0, 0.1, 0.05, "rad"),
        ActuatorConfig("boom", 1, 1, 0.05, 0.2, 0.1, 0.05, "m"),
    ),
    axes=2,
)
seeds = st.integers(0, 2**32 - 1)


def some(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    """Starts and displacements (count, 2) in [unit], the latter bent and noisy in the former."""
    rng = np.random.default_rng(seed)
    q = MIDDLE + WIDTH * rng.uniform(-0.5, 0.5, (count, 2))
    bend = np.sin(3 * q[:, :1] / WIDTH[0]) + q[:, 1:] / WIDTH[1]
    return q, WIDTH * (0.2 * bend + 0.05 * rng.standard_normal((count, 2)))


def taught(forecaster: Forecaster, q: FloatArray, x: FloatArray) -> Forecaster:
    for start, end in zip(q, x, strict=True):
        forecaster.observe(primitive((1, 1), start, end))
    return forecaster


def said(forecaster: Forecaster, start: Start) -> FloatArray:
    predicted = forecaster.predict(start)
    assert predicted is not None
    return predicted


def at(q: FloatArray, velocity: FloatArray | None = None) -> Start:
    return primitive((1, 1), q, q * 0, velocity=velocity).start


@pytest.mark.parametrize(
    "forecaster",
    [
        LastValue(),
        RunningMean(),
        ConstantVelocity(),
        NearestNeighbours(WIDTH),
        GaussianProcess(WIDTH),
        RiverLeastSquares(WIDTH, MIDDLE),
        FaithfulRampe(2),
    ],
)
def test_who_has_learned_nothing_says_nothing(forecaster: Forecaster) -> None:
    assert forecaster.predict(at(MIDDLE)) is None


@pytest.mark.parametrize(
    "forecaster",
    [
        LastValue(),
        RunningMean(),
        NearestNeighbours(WIDTH),
        GaussianProcess(WIDTH),
        RiverLeastSquares(WIDTH, MIDDLE),
        FaithfulRampe(2),
    ],
)
def test_categories_are_learned_apart(forecaster: Forecaster) -> None:
    taught(forecaster, *some(1, 8))
    known = said(forecaster, at(MIDDLE))
    for _ in range(8):
        forecaster.observe(primitive((-1, 0), MIDDLE, -WIDTH))
    np.testing.assert_array_equal(said(forecaster, at(MIDDLE)), known)


def test_zero_last_value_and_running_mean() -> None:
    q, x = some(2, 7)
    np.testing.assert_array_equal(said(taught(Zero(), q, x), at(MIDDLE)), [0.0, 0.0])
    np.testing.assert_array_equal(said(taught(LastValue(), q, x), at(MIDDLE)), x[-1])
    np.testing.assert_allclose(said(taught(RunningMean(), q, x), at(MIDDLE)), x.mean(axis=0))


def test_constant_velocity_holds_for_the_mean_duration_of_all_categories() -> None:
    forecaster = ConstantVelocity()
    forecaster.observe(primitive((1, 0), MIDDLE, WIDTH, duration_s=0.5))
    forecaster.observe(primitive((0, -1), MIDDLE, WIDTH, duration_s=1.5))
    start = at(MIDDLE, velocity=np.array([0.3, -0.02]))
    np.testing.assert_allclose(said(forecaster, start), [0.3, -0.02])


@given(seed=seeds, count=st.integers(1, 12))
@settings(max_examples=25, deadline=None)
def test_nearest_neighbours_are_those_of_scikit_learn(seed: int, count: int) -> None:
    q, x = some(seed, count)
    here = MIDDLE + 0.1 * WIDTH
    theirs = KNeighborsRegressor(min(5, count), algorithm="brute").fit(q / WIDTH, x)
    np.testing.assert_allclose(
        said(taught(NearestNeighbours(WIDTH), q, x), at(here)),
        theirs.predict((here / WIDTH)[None, :])[0],
        rtol=1e-9,
    )


@given(seed=seeds, count=st.integers(2, 12))
@settings(max_examples=25, deadline=None)
def test_the_gaussian_process_solves_its_equations(seed: int, count: int) -> None:
    q, x = some(seed, count)
    here = MIDDLE + 0.1 * WIDTH

    def rbf(a: FloatArray, b: FloatArray) -> FloatArray:
        distance = np.linalg.norm((a[:, None] - b[None]) / WIDTH, axis=2)
        result: FloatArray = np.exp(-0.5 * (distance / 0.3) ** 2)
        return result

    # signal of the variance of x, noise of half of it: the variance itself cancels
    weights = np.linalg.solve(rbf(q, q) + 0.5 * np.eye(count), x - x.mean(axis=0))
    expected = x.mean(axis=0) + rbf(here[None, :], q)[0] @ weights
    predicted = said(taught(GaussianProcess(WIDTH), q, x), at(here))
    np.testing.assert_allclose(predicted, expected, rtol=1e-6, atol=1e-9)


def test_the_optimised_process_finds_a_law_that_the_fixed_one_smooths_away() -> None:
    q = MIDDLE + WIDTH * np.column_stack([np.linspace(-0.5, 0.5, 30), np.zeros(30)])
    x = WIDTH * np.sin(6.0 * (q - MIDDLE) / WIDTH)[:, :1]
    here = MIDDLE + WIDTH * np.array([0.24, 0.0])
    truth = WIDTH * np.sin(6.0 * 0.24)
    fixed = said(taught(GaussianProcess(WIDTH), q, x), at(here))
    found = said(taught(GaussianProcess(WIDTH, optimise=True), q, x), at(here))
    assert (np.abs(found - truth) < 0.1 * np.abs(fixed - truth)).all()


@given(seed=seeds, count=st.integers(1, 12))
@settings(max_examples=25, deadline=None)
def test_river_is_ridge_regression_with_unit_weight(seed: int, count: int) -> None:
    q, x = some(seed, count)
    here = MIDDLE + 0.1 * WIDTH
    h = np.column_stack([(q - MIDDLE) / (WIDTH / 2), np.ones(count)])
    theta = np.linalg.solve(h.T @ h + np.eye(3), h.T @ (x / WIDTH))
    expected = np.array([0.2, 0.2, 1.0]) @ theta * WIDTH
    predicted = said(taught(RiverLeastSquares(WIDTH, MIDDLE), q, x), at(here))
    np.testing.assert_allclose(predicted, expected, rtol=1e-6, atol=1e-9)


def test_faithful_rampe_is_least_squares_after_three() -> None:
    q, x = some(3, 10)
    assert taught(FaithfulRampe(2), q[:2], x[:2]).predict(at(MIDDLE)) is None
    h = np.column_stack([q, np.ones(10)])
    expected = np.append(MIDDLE, 1.0) @ np.linalg.lstsq(h, x, rcond=None)[0]
    np.testing.assert_allclose(
        said(taught(FaithfulRampe(2), q, x), at(MIDDLE)), expected, rtol=1e-4
    )


def test_the_sites_rampe_has_the_sites_settings() -> None:
    q, x = some(4, 20)
    x, here = np.abs(x), at(MIDDLE)
    plain, forgetful = (
        said(
            taught(SiteRampe(replace(CONFIG, rampe=RampeConfig(forgetting=f)), LIMITS), q, x), here
        )
        for f in (1.0, 0.8)
    )
    assert not np.allclose(plain, forgetful)
    # twenty occurrences: near what they did on average, whatever the prior
    assert (np.abs(plain - x.mean(axis=0)) < 0.2 * WIDTH).all()
