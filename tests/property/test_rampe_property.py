"""RAMPE against textbook solutions computed another way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rampe_guard.core.config import PriorConfig
from rampe_guard.core.rampe import Rampe

LIMITS = np.array([[-1.0, 3.0], [0.0, 0.5]])


def data(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (count, 2))
    x = q @ rng.normal(size=(2, 2)) * 0.1 + [0.8, 0.1] + 0.05 * rng.normal(size=(count, 2))
    return q, x


@given(st.integers(0, 10_000), st.integers(5, 40), st.floats(0.8, 1.0))
@settings(max_examples=50, deadline=None)
def test_faithful_equals_batch_weighted_least_squares(seed: int, count: int, lam: float) -> None:
    q, x = data(seed, count)
    model = Rampe(2, mode="faithful", n_init=4, forgetting=lam, tol=1e-14)
    for qi, xi in zip(q, x, strict=True):
        model.observe((1, 1), qi, xi)
    h = np.column_stack([q, np.ones(count)])
    w = np.sqrt(lam ** np.arange(count - 1, -1, -1.0))[:, None]
    if np.linalg.cond((w * h)[:4]) > 1e4 or np.linalg.cond(w * h) > 1e4:
        return
    theta = np.linalg.lstsq(w * h, w * x, rcond=None)[0]
    at = np.array([0.3, 0.2])
    prediction = model.predict((1, 1), at)
    assert prediction is not None
    np.testing.assert_allclose(prediction.mean, [*at, 1.0] @ theta, rtol=1e-6, atol=1e-9)


def test_faithful_start_on_a_line_is_the_minimum_norm_solution() -> None:
    q = np.array([[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]])
    x = np.array([[1.0, 0.1], [1.1, 0.2], [1.2, 0.3]])
    model = Rampe(2, mode="faithful", n_init=3)
    for qi, xi in zip(q, x, strict=True):
        model.observe((1, 1), qi, xi)
    h = np.column_stack([q, np.ones(3)])
    at = np.array([0.4, 0.1])
    prediction = model.predict((1, 1), at)
    assert prediction is not None
    np.testing.assert_allclose(prediction.mean, [*at, 1.0] @ np.linalg.pinv(h) @ x, rtol=1e-8)


@given(st.integers(0, 10_000), st.integers(3, 30))
@settings(max_examples=50, deadline=None)
def test_bayesian_equals_the_conjugate_posterior(seed: int, count: int) -> None:
    """Normal-inverse-gamma in closed form, from all data at once."""
    q, x = data(seed, count)
    prior = PriorConfig(displacement=0.2, spread=0.15, weight=1.0, slope_weight=1.0)
    model = Rampe(2, n_init=1, limits=LIMITS, prior=prior)
    for qi, xi in zip(q, x, strict=True):
        model.observe((1, 1), qi, xi)
    width = LIMITS[:, 1] - LIMITS[:, 0]
    h = np.column_stack([(q - LIMITS.mean(axis=1)) / (width / 2), np.ones(count)])
    theta0 = np.zeros((3, 2))
    theta0[2] = 0.2 * width
    p0 = np.eye(3)
    p = p0 + h.T @ h
    theta = np.linalg.solve(p, p0 @ theta0 + h.T @ x)
    a = 1.5 + count / 2
    quad = [
        x[:, j] @ x[:, j] + theta0[:, j] @ p0 @ theta0[:, j] - theta[:, j] @ p @ theta[:, j]
        for j in range(2)
    ]
    b = 1.5 * (0.15 * width) ** 2 + 0.5 * np.array(quad)
    at = np.array([0.7, 0.1])
    row = np.array([*(at - LIMITS.mean(axis=1)) / (width / 2), 1.0])
    prediction = model.predict((1, 1), at)
    assert prediction is not None
    inside = np.clip(row @ theta, 0.0, LIMITS[:, 1] - at)
    np.testing.assert_allclose(prediction.mean, inside, rtol=1e-7, atol=1e-9)
    scale = np.sqrt(b / a * (1 + row @ np.linalg.solve(p, row)))
    np.testing.assert_allclose(prediction.scale, scale, rtol=1e-7)
    np.testing.assert_allclose(prediction.dof, 2 * a)
    assert prediction.occurrences == count


def test_bayesian_intervals_cover_what_they_promise() -> None:
    """On operators drawn from the prior, 90 % intervals hold 90 % of the next displacements."""
    rng = np.random.default_rng(3)
    prior = PriorConfig(displacement=0.4, spread=0.03)
    hits = []
    for _ in range(250):
        model = Rampe(1, n_init=1, limits=np.array([[0.0, 10.0]]), prior=prior)
        noise = 0.3 / np.sqrt(rng.gamma(1.5) / 1.5)
        slope, mean = rng.normal(0.0, noise), rng.normal(4.0, noise)
        for k in range(8):
            q = rng.uniform(1.0, 5.0, 1)
            x = mean + slope * (q - 5.0) / 5.0 + noise * rng.standard_normal(1)
            if k > 1 and (p := model.predict((1,), q)) is not None:
                half = p.scale * stats.t.ppf(0.95, p.dof)
                hits.append(bool(np.abs(x - p.mean)[0] <= half[0]))
            model.observe((1,), q, x)
    assert 0.87 < np.mean(hits) < 0.93


def test_sign_and_limits_are_respected() -> None:
    model = Rampe(2, n_init=1, limits=LIMITS)
    for _ in range(5):
        model.observe((1, 0), np.array([0.0, 0.2]), np.array([-0.5, 0.3]))
        model.observe((-1, 0), np.array([0.0, 0.2]), np.array([-5.0, 0.3]))
    wrong_way = model.predict((1, 0), np.array([0.0, 0.2]))
    too_far = model.predict((-1, 0), np.array([0.0, 0.2]))
    assert wrong_way is not None
    assert too_far is not None
    np.testing.assert_array_equal(wrong_way.mean, [0.0, 0.0])
    np.testing.assert_array_equal(too_far.mean, [-1.0, 0.0])


def test_nothing_is_predicted_before_n_init() -> None:
    model = Rampe(1, n_init=3)
    for k in range(4):
        assert (model.predict((1,), np.zeros(1)) is None) == (k < 3)
        model.observe((1,), np.zeros(1), np.ones(1))
    assert model.predict((-1,), np.zeros(1)) is None


@pytest.mark.parametrize(
    ("q", "x"),
    [([np.nan, 0], [1, 1]), ([0, 0], [np.inf, 1]), ([0], [1, 1]), ([0, 0], [1])],
)
def test_impossible_observations_are_refused_and_change_nothing(
    q: list[float], x: list[float]
) -> None:
    model = Rampe(2, n_init=1)
    model.observe((1, 1), np.zeros(2), np.ones(2))
    before = model.predict((1, 1), np.zeros(2))
    with pytest.raises(ValueError, match="q"):
        model.observe((1, 1), np.array(q, dtype=float), np.array(x, dtype=float))
    after = model.predict((1, 1), np.zeros(2))
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(before.mean, after.mean)
    assert after.occurrences == 1


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="forgetting is 1"):
        Rampe(1, forgetting=1.5)
    with pytest.raises(ValueError, match="limits have shape"):
        Rampe(2, limits=np.zeros((1, 2)))
