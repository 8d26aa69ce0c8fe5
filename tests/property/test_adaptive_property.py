"""The default mode against textbook solutions computed another way, and its symmetries.

Least squares is asked of ``numpy.linalg.lstsq`` with the prior as extra rows, the Gaussian
process of scikit-learn. Usual displacement and widths are computed here from the data.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

from rampe_guard.core.config import Basis, PriorConfig, RampeConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray

LIMITS = np.array([[-40.0, 40.0], [-8.0, 24.0]])
"""So wide that a quarter of it, the least width, is never worked through."""
PRIOR = PriorConfig()
seeds = st.integers(0, 100_000)
forgettings = st.sampled_from([1.0, 0.98, 0.9])
few = settings(max_examples=20, deadline=None)


@dataclass
class Data:
    """Occurrences of one category: starts (k, 2), displacements along Ω (k, 2)."""

    category: Category
    q: FloatArray
    moves: FloatArray

    @property
    def sign(self) -> FloatArray:
        return np.array(self.category, dtype=float)

    def feed(self, model: Rampe) -> Rampe:
        for q, move in zip(self.q, self.moves, strict=True):
            assert model.observe(self.category, q, self.sign * move) is None
        return model

    def weights(self, forgetting: float) -> FloatArray:
        return np.array([forgetting**age for age in reversed(range(len(self.q)))])

    def usual(self, limits: FloatArray | None) -> FloatArray:
        if limits is None:
            return np.asarray(self.moves.mean(axis=0))
        believed = 2.0 * PRIOR.displacement * (limits[:, 1] - limits[:, 0])
        return np.asarray((believed + self.moves.sum(axis=0)) / (2.0 + len(self.moves)))


def data(seed: int, count: int) -> Data:
    """Starts in [0, 4]², displacements affine in them with noise, all well above 0."""
    rng = np.random.default_rng(seed)
    category = tuple(int(s) for s in rng.choice([-1, 1], 2))
    q = rng.uniform(0.0, 4.0, (count, 2))
    moves = 1.5 + 0.15 * (q - 2.0) @ rng.uniform(-1.0, 1.0, (2, 2))
    return Data(category, q, moves + 0.15 * rng.standard_normal((count, 2)))


def undisturbed(model: Rampe, one: Data, forgetting: float) -> bool:
    """Whether no change of habit was seen: then the weights are λ^age."""
    assert model._adaptive is not None
    trust = model._adaptive.experiences[one.category].trust
    return bool(np.allclose(trust, one.weights(forgetting)[-len(trust) :]))


def regressors(basis: Basis, z: FloatArray) -> FloatArray:
    """Rows (k, p), the constant last."""
    ones = np.ones((len(z), 1))
    if basis == "affine":
        return np.hstack((z, ones))
    products = [z[:, [a]] * z[:, [b]] for a in range(z.shape[1]) for b in range(a, z.shape[1])]
    return np.hstack((*products, z, ones))


def least_squares(
    rows: FloatArray, weight: FloatArray, prior: FloatArray, usual: float, x: FloatArray
) -> FloatArray:
    """Parameters (p,): the prior stands as p more rows."""
    believed = np.zeros(len(prior))
    believed[-1] = usual
    stacked = np.vstack((np.sqrt(weight)[:, None] * rows, np.diag(np.sqrt(prior))))
    right = np.concatenate((np.sqrt(weight) * x, np.sqrt(prior) * believed))
    theta: FloatArray = np.linalg.lstsq(stacked, right, rcond=None)[0]
    return theta


def forecast(model: Rampe, category: Category, q: FloatArray) -> DisplacementForecast:
    result = model.predict(category, q)
    assert result is not None
    return result


def room(one: Data, q: FloatArray, limits: FloatArray | None) -> FloatArray:
    if limits is None:
        return np.full(2, np.inf)
    return np.where(one.sign > 0, limits[:, 1] - q, q - limits[:, 0])


@pytest.mark.parametrize("limits", [None, LIMITS], ids=["unlimited", "limits"])
@pytest.mark.parametrize("basis", ["affine", "quadratic"])
@given(seed=seeds, count=st.integers(1, 60), lam=forgettings)
@few
def test_ridge_is_regularised_weighted_least_squares(
    basis: Basis, limits: FloatArray | None, seed: int, count: int, lam: float
) -> None:
    """Of all occurrences, beyond the ``memory`` that a category keeps too."""
    one = data(seed, count)
    prior = PriorConfig(weight=0.7, slope_weight=0.3)
    config = RampeConfig(basis=basis, borrow=0.0, memory=16, forgetting=lam, prior=prior)
    model = one.feed(Rampe(2, limits=limits, config=config))
    # a twin that keeps all of them tells whether a change of habit was ever seen
    twin = one.feed(Rampe(2, limits=limits, config=replace(config, memory=1000)))
    assume(undisturbed(twin, one, lam))
    at = np.random.default_rng(seed + 1).uniform(0.0, 4.0, 2)
    # the first category is counted from its first start, in the units that hold now
    assert model._adaptive is not None
    inverse = 2.0 * model._adaptive.scales.inverse  # per half a range
    rows = regressors(basis, (one.q - one.q[0]) * inverse)
    row = regressors(basis, (at[None] - one.q[0]) * inverse)[0]
    belief = np.full(rows.shape[1], prior.slope_weight)
    belief[-1] = prior.weight
    expected = [
        row @ least_squares(rows, one.weights(lam), belief, u, x)
        for u, x in zip(one.usual(limits), one.moves.T, strict=True)
    ]
    clipped = one.sign * np.clip(expected, 0.0, room(one, at, limits))
    np.testing.assert_allclose(forecast(model, one.category, at).mean, clipped, rtol=1e-8)


@given(seed=seeds, count=st.integers(1, 60), lam=forgettings, known=st.booleans())
@few
def test_radial_is_a_gaussian_process(seed: int, count: int, lam: float, *, known: bool) -> None:
    """Of the newest ``memory`` occurrences; scikit-learn's has alpha = 1/λ^age."""
    limits, memory = (LIMITS if known else None), 16
    one = data(seed, count)
    # the first primitive goes through all that is worked in: the widths stay the same
    one.q[0], one.moves[0] = np.where(one.sign > 0, -3.0, 7.0), 10.0
    config = RampeConfig(borrow=0.0, memory=memory, forgetting=lam, two_futures_from=1000)
    model = one.feed(Rampe(2, limits=limits, config=config))
    assume(undisturbed(model, one, lam))
    width = np.full(2, 10.0) if limits is None else 0.25 * (limits[:, 1] - limits[:, 0])
    width = np.maximum(width, 10.0)
    k0, length = 1.0 / PRIOR.weight, 0.25 * np.sqrt(2.0)
    kernel = ConstantKernel(0.25 * k0) + ConstantKernel(0.75 * k0) * RBF(length)
    alpha = 1.0 / one.weights(lam)[-memory:]
    usual = one.usual(limits)
    process = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None)
    process.fit(one.q[-memory:] / width, one.moves[-memory:] - usual)
    at = np.random.default_rng(seed + 1).uniform(0.0, 4.0, (2, 2))
    deviation, deviations = process.predict(at / width, return_std=True)
    variance = deviations[:, 0] ** 2
    unclipped = np.maximum(usual + deviation, 0.0)
    found = [forecast(model, one.category, q) for q in at]
    for mean, q, p in zip(unclipped, at, found, strict=True):
        np.testing.assert_allclose(
            p.mean, one.sign * np.minimum(mean, room(one, q, limits)), rtol=1e-7, atol=1e-9
        )
    # scale² is the learned z² times u (x̂ + u/10)(1 + v), and z² is the same at both starts
    ratio = (unclipped[0] + 0.1 * usual) * (1.0 + variance[0])
    ratio /= (unclipped[1] + 0.1 * usual) * (1.0 + variance[1])
    np.testing.assert_allclose((found[0].scale / found[1].scale) ** 2, ratio, rtol=1e-7)


@given(seed=seeds, count=st.integers(6, 40))
@few
def test_without_prior_and_forgetting_it_is_the_faithful_mode(seed: int, count: int) -> None:
    one = data(seed, count)
    rows = np.column_stack((one.q, np.ones(count)))
    assume(np.linalg.cond(rows[:4]) < 1e3)
    nothing = PriorConfig(weight=1e-9, slope_weight=1e-9)
    config = RampeConfig(basis="affine", borrow=0.0, forgetting=1.0, prior=nothing, n_init=4)
    model = one.feed(Rampe(2, config=config))
    faithful = one.feed(Rampe(2, mode="faithful", n_init=4))
    assume(undisturbed(model, one, 1.0))
    at = np.array([1.0, 3.0])
    expected = forecast(faithful, one.category, at).mean
    assume((one.sign * expected > 0.0).all())
    np.testing.assert_allclose(
        forecast(model, one.category, at).mean, expected, rtol=1e-6, atol=1e-7
    )


@dataclass
class Stream:
    """Primitives of several categories, some of them with two futures."""

    steps: list[tuple[Category, FloatArray, FloatArray]]
    limits: FloatArray

    @property
    def n(self) -> int:
        return len(self.limits)

    def permuted(self, order: list[int]) -> "Stream":
        steps = [(tuple(c[j] for j in order), q[order], x[order]) for c, q, x in self.steps]
        return Stream(steps, self.limits[order])

    def scaled(self, factor: FloatArray) -> "Stream":
        steps = [(c, q * factor, x * factor) for c, q, x in self.steps]
        return Stream(steps, self.limits * factor[:, None])

    def model(self, basis: Basis, *, limits: bool) -> Rampe:
        model = Rampe(self.n, limits=self.limits if limits else None, basis=basis)
        for category, q, x in self.steps:
            model.observe(category, q, x)
        return model


def stream(seed: int, n: int, count: int = 70) -> Stream:
    rng = np.random.default_rng(seed)
    pool = [tuple(int(s) for s in row) for row in rng.integers(-1, 2, (40, n)) if row.any()][:12]
    habits = {c: rng.uniform(0.2, 1.0, n) for c in pool}
    split = set(pool[:2])
    steps = []
    for _ in range(count):
        category = pool[min(int(rng.exponential(3.0)), len(pool) - 1)]
        size = habits[category] * (1.0 + 0.1 * rng.standard_normal(n))
        if category in split and rng.random() < 0.5:
            size = size * 3.0
        x = np.array(category) * np.maximum(size, 0.01)
        steps.append((category, rng.uniform(4.0, 8.0, n), x))
    return Stream(steps, np.tile([0.0, 12.0], (n, 1)))


def same(found: DisplacementForecast, expected: DisplacementForecast) -> None:
    """All fields, to rounding."""
    assert found.category == expected.category
    assert found.occurrences == expected.occurrences
    assert set(found.related) == set(expected.related)
    assert found.bimodal == expected.bimodal
    for name in ("mean", "scale", "dof", "covariance", "shape", "mode_weights", "room", "modes"):
        a, b = getattr(found, name), getattr(expected, name)
        if b is not None:
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-9, err_msg=name)
    assert found.weights is not None
    assert expected.weights is not None
    np.testing.assert_array_equal(found.weights.shared, expected.weights.shared)
    np.testing.assert_array_equal(found.weights.offset, expected.weights.offset)


def transformed(
    p: DisplacementForecast, order: list[int], factor: FloatArray
) -> DisplacementForecast:
    """The forecast of actuators in another order and of other units."""
    assert p.shape is not None
    assert p.room is not None
    return replace(
        p,
        category=tuple(p.category[j] for j in order),
        mean=(p.mean * factor)[order],
        scale=(p.scale * factor)[order],
        dof=p.dof[order],
        related=tuple(tuple(c[j] for j in order) for c in p.related),
        covariance=(p.covariance * np.outer(factor, factor))[np.ix_(order, order)],
        shape=p.shape[order],
        modes=None if p.modes is None else (p.modes * factor)[:, order],
        room=(p.room * factor)[order],
    )


@given(
    seed=seeds,
    n=st.sampled_from([2, 3, 5]),
    basis=st.sampled_from(["affine", "quadratic", "radial"]),
    limits=st.booleans(),
)
@few
def test_order_of_the_actuators_does_not_matter(
    seed: int, n: int, basis: Basis, *, limits: bool
) -> None:
    one = stream(seed, n)
    order = [int(j) for j in np.random.default_rng(seed).permutation(n)]
    model = one.model(basis, limits=limits)
    other = one.permuted(order).model(basis, limits=limits)
    assert model.refused == other.refused
    for category, q, _ in one.steps[-8:]:
        p = forecast(model, category, q)
        permuted = tuple(category[j] for j in order)
        same(forecast(other, permuted, q[order]), transformed(p, order, np.ones(n)))


def test_witnesses_with_equal_experience_are_heard_whatever_the_order() -> None:
    """More neighbours than are heard, each seen once: which ones must not follow the order."""
    rng = np.random.default_rng(4)
    singles = [tuple(int(s) for s in row) for row in np.vstack((np.eye(6), -np.eye(6)))]
    steps = [(c, rng.uniform(4.0, 8.0, 6), rng.uniform(0.3, 1.0) * np.array(c)) for c in singles]
    one = Stream(steps, np.tile([0.0, 12.0], (6, 1)))
    q = np.full(6, 6.0)
    for j, s in product(range(1, 6), (1, -1)):
        c = (1, *(s * (j == k) for k in range(1, 6)))
        one.steps.append((c, rng.uniform(4.0, 8.0, 6), rng.uniform(0.3, 1.0) * np.array(c)))
    order = [5, 4, 3, 2, 1, 0]
    p = forecast(one.model("radial", limits=True), (1, 0, 0, 0, 0, 0), q)
    other = one.permuted(order).model("radial", limits=True)
    same(forecast(other, (0, 0, 0, 0, 0, 1), q), transformed(p, order, np.ones(6)))


def same_in_other_units(one: Stream, basis: Basis, factor: FloatArray, *, limits: bool) -> None:
    model = one.model(basis, limits=limits)
    other = one.scaled(factor).model(basis, limits=limits)
    assert model.refused == other.refused
    for category, q, _ in one.steps[-8:]:
        found = forecast(other, category, q * factor)
        p = forecast(model, category, q)
        same(transformed(found, list(range(one.n)), 1.0 / factor), p)


@given(
    seed=seeds, n=st.sampled_from([1, 2, 4]), exponent=st.floats(-4.0, 4.0), limits=st.booleans()
)
@settings(max_examples=20, deadline=None)
def test_units_of_an_actuator_do_not_matter(
    seed: int, n: int, exponent: float, *, limits: bool
) -> None:
    """From metres to micrometres: its own forecast is scaled, and that of no other changes."""
    factor = np.ones(n)
    factor[seed % n] = 10.0**exponent
    same_in_other_units(stream(seed, n), "radial", factor, limits=limits)


@pytest.mark.parametrize("limits", [True, False], ids=["limits", "unlimited"])
@pytest.mark.parametrize("basis", ["affine", "quadratic"])
def test_units_do_not_matter_to_the_other_bases(basis: Basis, *, limits: bool) -> None:
    same_in_other_units(stream(0, 2), basis, np.array([1.0, 100.0]), limits=limits)
