"""The paper's algorithm: when it estimates, what it refuses, R(Ω), and its kept state."""

from typing import Any

import numpy as np
import pytest

from rampe_guard.core.basis import affine, constant, quadratic, subset
from rampe_guard.core.faithful import Faithful
from rampe_guard.core.noise import weighting
from rampe_guard.core.types import FloatArray

UP = (1, 1)
TRUE_NOISE = np.array([[4.0, -0.012], [-0.012, 1e-4]])
"""[deg²] beside [m²]; correlation -0.6."""


def operator(count: int, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Starts (count, 2) in [deg, m], and displacements linear in them plus noise."""
    rng = np.random.default_rng(seed)
    q = rng.uniform([0.0, 2.6], [64.0, 2.95], (count, 2))
    x = q @ np.array([[-0.5, 0.001], [2.0, -0.4]]) + [3.0, 1.2]
    return q, x + rng.multivariate_normal([0.0, 0.0], TRUE_NOISE, count)


def taught(model: Faithful, count: int, seed: int = 0) -> Faithful:
    for q, x in zip(*operator(count, seed), strict=True):
        model.observe(UP, q, x)
    return model


@pytest.mark.parametrize("n_init", [1, 3, 5])
def test_nothing_is_estimated_before_n_init(n_init: int) -> None:
    model = Faithful(2, n_init=n_init)
    for k, (q, x) in enumerate(zip(*operator(8), strict=True)):
        silent = k < n_init
        assert (model.predict(UP, q) is None) == silent
        assert (model.covariance(UP, q) is None) == silent
        assert (model.parameters(UP) is None) == silent
        model.observe(UP, q, x)
        assert model.categories == {UP: k + 1}
        assert model.occurrences(UP) == k + 1
    assert model.predict((1, -1), np.zeros(2)) is None
    assert model.occurrences((1, -1)) == 0
    assert model.categories == {UP: 8}


def test_three_starts_in_a_triangle_are_met_exactly_and_then_averaged() -> None:
    model = Faithful(1, [affine(1)], n_init=2)
    for q, x in ((0.0, 1.0), (1.0, 3.0)):
        model.observe((1,), np.array([q]), np.array([x]))
    line = model.predict((1,), np.array([2.0]))
    model.observe((1,), np.array([0.0]), np.array([2.0]))
    between = model.predict((1,), np.array([0.0]))
    assert line is not None
    assert between is not None
    np.testing.assert_allclose(line, [5.0], rtol=1e-12)
    np.testing.assert_allclose(between, [1.5], rtol=1e-12)


def test_the_paper_estimate_knows_no_sign_and_no_limit() -> None:
    model = Faithful(1)
    for q in (0.0, 1.0, 2.0):
        model.observe((1,), np.array([q]), np.array([1.0 - q]))
    far = model.predict((1,), np.array([100.0]))
    assert far is not None
    np.testing.assert_allclose(far, [-99.0], rtol=1e-9)


def test_singular_values_below_tol_are_cut() -> None:
    """Starts on a line but for 1e-4: a slope across it is learned or not, as ``tol`` says."""
    q = np.array([[0.0, 0.0], [1.0, 1e-4], [2.0, -1e-4], [3.0, 1e-4]])
    x = np.array([[0.0], [1.0], [1.0], [3.0]]) * [1.0, 0.0]
    slopes = []
    for tol in (1e-12, 1e-6):
        model = Faithful(2, n_init=4, tol=tol)
        for qi, xi in zip(q, x, strict=True):
            model.observe(UP, qi, xi)
        found = model.parameters(UP)
        assert found is not None
        slopes.append(abs(found[0][1]))
    assert slopes[0] > 1e3
    assert slopes[1] < 1.0


def test_learned_noise_comes_near_the_true_one() -> None:
    model = taught(Faithful(2, noise="learned"), 600)
    r = model.noise(UP)
    assert r is not None
    unit = np.sqrt(TRUE_NOISE.diagonal())
    np.testing.assert_allclose(r / unit / unit[:, None], [[1, -0.6], [-0.6, 1]], atol=0.1)


@pytest.mark.parametrize("regressors", [None, [affine(2), subset([1, 0], affine(2))]])
def test_predictive_covariance_is_what_errors_have(regressors: Any) -> None:
    """Mean squared Mahalanobis distance of the next displacement is n, of n = 2."""
    squares = []
    for seed in range(40):
        model = taught(Faithful(2, regressors, noise=TRUE_NOISE, n_init=8), 12, seed)
        q, x = operator(13, seed)
        estimate, covariance = model.predict(UP, q[-1]), model.covariance(UP, q[-1])
        assert estimate is not None
        assert covariance is not None
        error = x[-1] - estimate
        squares.append(error @ np.linalg.solve(covariance, error))
    assert 1.0 < np.mean(squares) < 3.3


def test_learned_noise_of_an_actuator_that_stands_still_is_positive() -> None:
    model = Faithful(3, noise="learned")
    rng = np.random.default_rng(1)
    for k in range(20):
        x = np.array([rng.normal(), 0.0, 0.0]) if k else np.zeros(3)
        model.observe((1, 0, 0), rng.normal(size=3), x)
    r = model.noise((1, 0, 0))
    assert r is not None
    assert (np.linalg.eigvalsh(r) > 0.0).all()


def test_noise_by_category_falls_back_to_the_identity() -> None:
    model = Faithful(2, noise={UP: TRUE_NOISE})
    np.testing.assert_array_equal(model.noise(UP), TRUE_NOISE)
    np.testing.assert_array_equal(model.noise((1, -1)), np.eye(2))
    assert Faithful(2, noise="learned").noise(UP) is None


def test_noise_taken_apart_wants_a_matrix() -> None:
    with pytest.raises(ValueError, match=r"shape \(2, 3\), must be square"):
        weighting(np.ones((2, 3)))


def test_what_r_does_not_couple_is_a_system_of_its_own() -> None:
    r = np.array([[2.0, 0.0, 0.3], [0.0, 1.0, 0.0], [0.3, 0.0, 1.0]])
    assert [c.tolist() for c in weighting(r).components] == [[0, 2], [1]]
    assert [c.tolist() for c in weighting(r, coupled=True).components] == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("r", "message"),
    [
        ([[1.0, 0.5], [0.4, 1.0]], r"symmetric, is \[\[1.0, 0.5\]"),
        ([[1.0, 2.0], [2.0, 1.0]], r"positive definite, is \[\[1.0, 2.0\]"),
        ([[1.0, 1.0], [1.0, 1.0]], "positive definite"),
        ([[1.0, 0.0], [0.0, 0.0]], r"positive diagonal, is \[\[1.0, 0.0\]"),
        ([[1.0, np.nan], [np.nan, 1.0]], "finite"),
        ([[1.0]], r"shape \(1, 1\), need \(2, 2\)"),
        ([1.0, 1.0], r"shape \(2,\)"),
    ],
)
def test_a_wrong_r_is_refused_with_its_values(r: list[Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Faithful(2, noise=np.array(r))
    with pytest.raises(ValueError, match=message):
        Faithful(2, noise={UP: np.array(r)})


def test_r_in_units_far_apart_is_accepted() -> None:
    unit = np.array([1e6, 1e-6])
    r = np.array([[1.0, 0.9], [0.9, 1.0]]) * unit * unit[:, None]
    model = taught(Faithful(2, tol=1e-13, noise=r), 9)
    plain = taught(Faithful(2, tol=1e-13), 9).predict(UP, np.array([10.0, 2.7]))
    mine = model.predict(UP, np.array([10.0, 2.7]))
    assert plain is not None
    assert mine is not None
    np.testing.assert_allclose(mine, plain, rtol=1e-7)


class Empty:
    """Models nothing."""

    size = 0

    def __call__(self, y: FloatArray, /) -> FloatArray:
        return y[:0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"actuators": 0}, "actuators=0"),
        ({"n_init": 0}, "n_init=0"),
        ({"forgetting": 0.0}, r"forgetting=0\.0"),
        ({"forgetting": np.nan}, "forgetting=nan"),
        ({"tol": -1.0}, r"tol=-1\.0"),
        ({"tol": 1.0}, r"tol=1\.0"),
        ({"regressors": [affine(2)]}, "1 regressors for 2"),
        ({"regressors": [subset([], Empty())] * 2}, r"sizes \[0\]"),
        ({"noise": "given"}, "noise is 'given'"),
        ({"noise": {(1, 2): np.eye(2)}}, r"category \(1, 2\)"),
    ],
)
def test_settings_out_of_range_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Faithful(**({"actuators": 2} | arguments))


@pytest.mark.parametrize(
    ("category", "y", "x", "message"),
    [
        (UP, [np.nan, 0], [1, 1], "y="),
        (UP, [np.inf, -np.inf], [1, 1], "y="),
        (UP, [0, 1e200], [1, 1], "y="),
        (UP, [[0, 1]], [1, 1], "y="),
        (UP, [0], [1, 1], r"shape \(1,\), need \(2,\)"),
        (UP, [0, 0], [1, np.inf], "x="),
        (UP, [0, 0], [1], "x="),
        (UP, [0, 0], [1, 1e150], "x="),
        ((1, 2), [0, 0], [1, 1], r"category \(1, 2\)"),
        ((1,), [0, 0], [1, 1], r"category \(1,\)"),
    ],
)
@pytest.mark.parametrize("count", [1, 6])
def test_impossible_observations_are_refused_and_change_nothing(
    category: tuple[int, ...], y: list[Any], x: list[float], message: str, count: int
) -> None:
    model = taught(Faithful(2, noise="learned"), count)
    before = model.snapshot()
    with pytest.raises(ValueError, match=message):
        model.observe(category, np.array(y, dtype=float), np.array(x, dtype=float))
    after = model.snapshot()
    assert all(after[key].tobytes() == before[key].tobytes() for key in before)
    if message[0] != "x":
        with pytest.raises(ValueError, match=message):
            model.predict(category, np.array(y, dtype=float))


class Wrong:
    """Says 2, gives 3."""

    size = 2

    def __call__(self, y: FloatArray, /) -> FloatArray:
        return np.append(y, 1.0)


class Logarithm:
    """Has no value at 0."""

    size = 1

    def __call__(self, y: FloatArray, /) -> FloatArray:
        with np.errstate(divide="ignore"):
            return np.log(y[:1])


def test_a_regressor_of_ones_own_is_checked_each_time() -> None:
    with pytest.raises(ValueError, match="Wrong"):
        Faithful(2, [Wrong(), constant()]).predict(UP, np.zeros(2))
    model = Faithful(2, [Logarithm(), constant()])
    model.observe(UP, np.ones(2), np.ones(2))
    with pytest.raises(ValueError, match="-inf"):
        model.observe(UP, np.zeros(2), np.ones(2))
    assert model.categories == {UP: 1}


def test_what_was_observed_is_copied() -> None:
    """A caller may use its arrays again."""
    q, x = operator(6)
    reused, kept = Faithful(2), taught(Faithful(2), 6)
    at, to = np.empty(2), np.empty(2)
    for qi, xi in zip(q, x, strict=True):
        at[:], to[:] = qi, xi
        reused.observe(UP, at, to)
    np.testing.assert_array_equal(reused.predict(UP, q[0]), kept.predict(UP, q[0]))


def test_only_seen_categories_are_in_a_snapshot_of_plain_arrays() -> None:
    model = taught(Faithful(2), 5)
    model.observe((0, -1), np.zeros(2), np.ones(2))
    snapshot = model.snapshot()
    assert snapshot["categories"].tolist() == [[1, 1], [0, -1]]
    assert snapshot["occurrences"].tolist() == [5, 1]
    assert all(array.dtype in (np.int64, np.float64) for array in snapshot.values())
    assert len(Faithful(2).snapshot()["values"]) == 0


def test_a_snapshot_of_nothing_empties_an_estimator() -> None:
    model = taught(Faithful(2), 5)
    model.restore(Faithful(2).snapshot())
    assert model.categories == {}


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (Faithful(3), "actuators"),
        (Faithful(2, n_init=4), r"n_init \[4\], need \[3\]"),
        (Faithful(2, tol=1e-8), "tol"),
        (Faithful(2, forgetting=0.9), "forgetting"),
        (Faithful(2, [quadratic(2)] * 2), r"regressor_sizes \[6, 6\], need \[3, 3\]"),
        (Faithful(2, [Wrong(), Wrong()]), "regressor"),
        (Faithful(2, noise="learned"), "noise_learned"),
        (Faithful(2, noise=TRUE_NOISE), "noise"),
        (Faithful(2, noise={UP: TRUE_NOISE}), "noise_categories"),
    ],
)
def test_a_snapshot_of_another_estimator_is_refused(other: Faithful, message: str) -> None:
    model = taught(Faithful(2), 5)
    with pytest.raises(ValueError, match=message):
        model.restore(other.snapshot())
    assert model.categories == {UP: 5}


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("values", np.zeros(3), "too early"),
        ("values", np.zeros(99), "99 values"),
        ("values", np.full(15, np.nan), "finite"),
        ("values", np.array(["a"]), "numbers"),
        ("occurrences", np.array([0]), "occurrences"),
        ("occurrences", np.array([5.0]), "integers"),
        ("occurrences", np.array([5, 5]), "shape"),
        ("categories", np.array([[1, 2]]), r"category \(1, 2\)"),
        ("categories", np.array([[1]]), "shape"),
        ("categories", None, "no categories"),
        ("version", np.array([0]), "version"),
    ],
)
def test_a_damaged_snapshot_is_refused(key: str, value: Any, message: str) -> None:
    snapshot: dict[str, Any] = dict(taught(Faithful(2), 5).snapshot())
    if value is None:
        del snapshot[key]
    else:
        snapshot[key] = value
    model = taught(Faithful(2), 4)
    with pytest.raises(ValueError, match=message):
        model.restore(snapshot)
    assert model.categories == {UP: 4}


def test_a_category_twice_in_a_snapshot_is_refused() -> None:
    model = taught(Faithful(2), 5)
    twice = dict(model.snapshot())
    for key in ("categories", "occurrences", "values"):
        twice[key] = np.concatenate([twice[key], twice[key]])
    with pytest.raises(ValueError, match="of 1"):
        model.restore(twice)
