"""The paper's recursion against least squares of all occurrences at once, by another route.

The reference stacks H(y) of every occurrence, whitens it with a Cholesky factor of R⁻¹ and the
weights λ^age, and asks ``numpy.linalg.lstsq``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rampe_guard.core.basis import Regressor, affine, constant, quadratic, subset
from rampe_guard.core.faithful import Faithful
from rampe_guard.core.noise import weighting
from rampe_guard.core.rls import Shared, Stacked, cholesky_if_uncut, solve
from rampe_guard.core.types import FloatArray, Indices

KINDS: tuple[Regressor, ...] = (
    affine(3),
    quadratic(3),
    constant(),
    subset([1], affine(1)),
    subset([2, 0], quadratic(2)),
)
UP = (1, 1, 1, 1)
few = settings(max_examples=60, deadline=None)
seeds = st.integers(0, 100_000)
structures = st.lists(st.sampled_from(KINDS), min_size=1, max_size=4)
forgettings = st.sampled_from([1.0, 0.97, 0.8])


@dataclass
class Case:
    regressors: Sequence[Regressor]
    y: FloatArray
    x: FloatArray

    @property
    def n(self) -> int:
        return len(self.regressors)

    @property
    def category(self) -> tuple[int, ...]:
        return UP[: self.n]

    def model(
        self,
        n_init: int,
        forgetting: float = 1.0,
        noise: FloatArray | None = None,
        tol: float = 1e-9,
    ) -> Faithful:
        model = Faithful(self.n, self.regressors, n_init, tol, forgetting, noise)
        for y, x in zip(self.y, self.x, strict=True):
            model.observe(self.category, y, x)
        return model

    def rows(self, y: FloatArray) -> FloatArray:
        """H(y) (n, Σp)."""
        blocks = [r(y)[None, :] for r in self.regressors]
        h = np.zeros((self.n, sum(b.shape[1] for b in blocks)))
        at = 0
        for j, block in enumerate(blocks):
            h[j, at : at + block.shape[1]] = block
            at += block.shape[1]
        return h

    def stacked(self, forgetting: float, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
        """W₀H₀ and W₀x, one occurrence below the other."""
        whitener = np.linalg.cholesky(np.linalg.inv(noise)).T
        count = len(self.y)
        root = np.sqrt(forgetting ** np.arange(count - 1, -1, -1.0))
        h = [w * whitener @ self.rows(y) for w, y in zip(root, self.y, strict=True)]
        x = [w * whitener @ xi for w, xi in zip(root, self.x, strict=True)]
        return np.concatenate(h), np.concatenate(x)


def case(regressors: Sequence[Regressor], seed: int, count: int) -> Case:
    rng = np.random.default_rng(seed)
    n = len(regressors)
    y = rng.uniform(-1.0, 1.0, (count, 3))
    x = np.sin(y @ rng.normal(size=(3, n))) + 0.1 * rng.normal(size=(count, n)) + 0.5
    return Case(regressors, y, x)


def full_noise(n: int, seed: int, causes: int = 4, independent: float = 0.5) -> FloatArray:
    """A covariance that couples all actuators, of very different units."""
    rng = np.random.default_rng([seed, 1])
    a = rng.normal(size=(n, causes))
    unit = 10.0 ** rng.uniform(-3, 3, n)
    return (a @ a.T + independent * np.eye(n)) * unit[:, None] * unit


def parameters(model: Faithful, category: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    found = model.parameters(category)
    assert found is not None
    return found


def close(actual: FloatArray, expected: npt.NDArray[np.floating], rtol: float = 1e-9) -> None:
    """Each value to ``rtol`` of the largest."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=rtol * np.abs(expected).max())


@given(structures, seeds, st.integers(0, 25), forgettings)
@few
def test_equals_batch_weighted_least_squares(
    regressors: list[Regressor], seed: int, more: int, forgetting: float
) -> None:
    n_init = 15
    data = case(regressors, seed, n_init + more)
    noise = full_noise(data.n, seed)
    h, x = data.stacked(forgetting, noise)
    first = Case(regressors, data.y[:n_init], data.x[:n_init]).stacked(forgetting, noise)[0]
    column = np.linalg.norm(h, axis=0)
    assume(max(np.linalg.cond(h / column), np.linalg.cond(first / column)) < 1e3)
    model = data.model(n_init, forgetting, noise)
    theta, precision = parameters(model, data.category)
    # columns of one length: lstsq itself is exact to 1e-9 then
    expected = np.linalg.lstsq(h / column, x, rcond=None)[0] / column
    sizes = np.cumsum([r.size for r in regressors])[:-1]
    for mine, reference in zip(np.split(theta, sizes), np.split(expected, sizes), strict=True):
        close(mine, reference)
    np.testing.assert_allclose(
        precision / column / column[:, None], (h.T @ h) / column / column[:, None], atol=1e-9
    )
    y = np.array([0.2, -0.4, 0.3])
    estimate = model.predict(data.category, y)
    assert estimate is not None
    np.testing.assert_allclose(estimate, data.rows(y) @ expected, rtol=1e-9, atol=1e-9)
    covariance = model.covariance(data.category, y)
    assert covariance is not None
    rows = data.rows(y) / column
    unit = np.sqrt(noise.diagonal())
    spread = rows @ np.linalg.solve((h / column).T @ (h / column), rows.T)
    scaled = (spread + noise) / unit / unit[:, None]
    np.testing.assert_allclose(covariance / unit / unit[:, None], scaled, rtol=1e-7, atol=1e-9)


@given(structures, seeds, st.integers(1, 4), st.integers(0, 12), forgettings)
@few
def test_rank_deficient_data_give_the_minimum_norm_solution(
    regressors: list[Regressor], seed: int, n_init: int, more: int, forgetting: float
) -> None:
    """Starts on two points only: no model but the constant one is determined, ever."""
    data = case(regressors, seed, n_init + more)
    two = data.y[:1] * [[1.0], [0.5]]
    data.y = two[np.random.default_rng(seed).integers(0, 2, len(data.y))]
    noise = full_noise(data.n, seed)
    unit = np.sqrt(noise.diagonal())
    h, x = data.stacked(forgetting, noise / unit / unit[:, None])
    # displacements in units of their noise, as R's own units are without meaning to a norm
    data.x = data.x * unit
    theta, _ = parameters(data.model(n_init, forgetting, noise), data.category)
    s = np.linalg.svd(h, compute_uv=False)
    kept = s[s > 1e-10 * s[0]]
    assume(kept[-1] > 1e-2 * s[0])
    expected = np.linalg.lstsq(h, x, rcond=1e-10)[0]
    owner = np.repeat(np.arange(data.n), [r.size for r in regressors])
    close(theta / unit[owner], expected, 1e-8)


def shuffled(noise: FloatArray, order: Indices) -> FloatArray:
    swapped: FloatArray = noise[np.ix_(order, order)]
    return swapped


@given(structures, seeds, st.booleans(), forgettings)
@few
def test_order_of_actuators_does_not_matter(
    regressors: list[Regressor], seed: int, coupled: bool, forgetting: float
) -> None:
    data = case(regressors, seed, 20)
    order = np.random.default_rng([seed, 2]).permutation(data.n)
    noise = full_noise(data.n, seed) if coupled else np.eye(data.n)
    other = Case([regressors[j] for j in order], data.y, data.x[:, order])
    assume(np.linalg.cond(data.stacked(forgetting, np.eye(data.n))[0]) < 1e4)
    y = np.array([0.1, 0.2, -0.3])
    mine = data.model(12, forgetting, noise).predict(data.category, y)
    theirs = other.model(12, forgetting, shuffled(noise, order)).predict(data.category, y)
    assert mine is not None
    assert theirs is not None
    np.testing.assert_allclose(mine[order], theirs, rtol=1e-8, atol=1e-8)


@given(seeds, st.lists(st.integers(0, 2), min_size=10, max_size=30))
@few
def test_categories_do_not_disturb_each_other(seed: int, turns: list[int]) -> None:
    """Bit for bit: occurrences of others, in whatever order, change nothing."""
    names = ((1, -1), (-1, 0), (0, 1))
    data = case([affine(3), quadratic(3)], seed, len(turns))
    mixed = Faithful(2, data.regressors, noise="learned")
    for turn, y, x in zip(turns, data.y, data.x, strict=True):
        mixed.observe(names[turn], y, x)
    at = np.array([0.3, 0.0, -0.5])
    for i, name in enumerate(names):
        alone = Faithful(2, data.regressors, noise="learned")
        for turn, y, x in zip(turns, data.y, data.x, strict=True):
            if turn == i:
                alone.observe(name, y, x)
        a, b = alone.predict(name, at), mixed.predict(name, at)
        assert (a is None) == (b is None) == (turns.count(i) < 3)
        if a is not None and b is not None:
            np.testing.assert_array_equal(a, b)
        assert alone.categories.get(name) == mixed.categories.get(name)


@given(structures, seeds, st.floats(1e-6, 1e6), forgettings)
@few
def test_a_constant_factor_of_r_does_not_change_theta(
    regressors: list[Regressor], seed: int, factor: float, forgetting: float
) -> None:
    data = case(regressors, seed, 20)
    assume(np.linalg.cond(data.stacked(forgetting, np.eye(data.n))[0]) < 1e4)
    noise = full_noise(data.n, seed)
    a, p = parameters(data.model(12, forgetting, noise), data.category)
    b, q = parameters(data.model(12, forgetting, factor * noise), data.category)
    np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(p, factor * q, rtol=1e-9)


@given(structures, seeds, st.integers(1, 12), forgettings)
@few
def test_a_diagonal_r_does_not_change_theta(
    regressors: list[Regressor], seed: int, n_init: int, forgetting: float
) -> None:
    """Not even while the data are rank-deficient, and whatever ``tol`` cuts."""
    data = case(regressors, seed, 14)
    noise = np.diag(10.0 ** np.random.default_rng(seed).uniform(-6, 6, data.n))
    a, _ = parameters(data.model(n_init, forgetting, None, tol=1e-3), data.category)
    b, _ = parameters(data.model(n_init, forgetting, noise, tol=1e-3), data.category)
    np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-7)


@given(seeds, st.floats(0.5, 0.95))
@few
def test_forgetting_follows_a_change_and_its_absence_averages(seed: int, lam: float) -> None:
    rng = np.random.default_rng(seed)
    x = np.concatenate([np.zeros(20), np.ones(20)]) + 0.01 * rng.normal(size=40)
    estimates = []
    for forgetting in (1.0, lam):
        model = Faithful(1, [constant()], 3, forgetting=forgetting)
        for xi in x:
            model.observe((1,), np.zeros(0), np.array([xi]))
        estimate = model.predict((1,), np.zeros(0))
        assert estimate is not None
        estimates.append(float(estimate[0]))
    assert estimates[0] == pytest.approx(x.mean(), abs=1e-12)
    weights = lam ** np.arange(39, -1, -1.0)
    assert estimates[1] == pytest.approx(weights @ x / weights.sum(), abs=1e-12)
    assert abs(estimates[1] - 1.0) < abs(estimates[0] - 1.0)


class Own:
    """The same function as ``affine(3)``, but an estimator cannot know."""

    size = 4

    def __call__(self, y: FloatArray, /) -> FloatArray:
        return np.append(y, 1.0)


@given(st.integers(2, 4), seeds, st.integers(1, 6), forgettings, st.sampled_from([1e-9, 0.02]))
@settings(max_examples=150, deadline=None)
def test_one_regressor_for_all_equals_the_stacked_system(
    n: int, seed: int, n_init: int, forgetting: float, tol: float
) -> None:
    """The short way (``Shared``) and P in full, where singular values are cut and where not."""
    data = case([affine(3)] * n, seed, 12)
    if seed % 2:
        data.y[:, 1] = 2.0 * data.y[:, 0]  # never determined
    noise = full_noise(n, seed) if seed % 3 else full_noise(n, seed, 1, 1e-3)
    full = Case([Own() for _ in range(n)], data.y, data.x)
    a, b = (c.model(n_init, forgetting, noise, tol) for c in (data, full))
    memories = (a._memory[data.category], b._memory[data.category])
    assert [type(m.states[0]) for m in memories] == [Shared, Stacked]
    (ta, pa), (tb, pb) = parameters(a, data.category), parameters(b, data.category)
    unit = np.repeat(1.0 / np.sqrt(noise.diagonal()), 4)
    np.testing.assert_allclose(ta * unit, tb * unit, rtol=1e-5, atol=1e-5 * np.abs(ta * unit).max())
    np.testing.assert_allclose(pa / unit / unit[:, None], pb / unit / unit[:, None], atol=1e-9)
    va, vb = a.covariance(data.category, data.y[3]), b.covariance(data.category, data.y[3])
    assert va is not None
    assert vb is not None
    scale = np.sqrt(noise.diagonal())
    np.testing.assert_allclose(va / scale / scale[:, None], vb / scale / scale[:, None], atol=1e-5)


@given(seeds, st.integers(1, 40), st.floats(-14.0, 0.0), st.sampled_from([1e-3, 1e-6, 1e-9]))
@settings(max_examples=300, deadline=None)
def test_cholesky_is_used_only_where_the_pseudo_inverse_cuts_nothing(
    seed: int, size: int, exponent: float, tol: float
) -> None:
    """Spectra whose smallest singular value lies above, at and below the threshold."""
    rng = np.random.default_rng(seed)
    v = np.linalg.qr(rng.normal(size=(size, size)))[0]
    s = 10.0 ** rng.uniform(exponent, 0.0, size)
    s[0], s[-1] = 1.0, 10.0**exponent
    p = (v * s) @ v.T
    p = 7.0 * (p + p.T) / 2
    b = rng.normal(size=size)
    share = s.min() / s.max()
    factor = cholesky_if_uncut(p, tol)
    if share <= tol:
        assert factor is None
    if share > 100.0 * size * tol:
        assert factor is not None
    if np.abs(s / s.max() / tol - 1.0).min() < 1e-3:
        return  # on the threshold itself rounding decides
    expected = np.linalg.pinv(p, rcond=tol, hermitian=True) @ b
    condition = 1.0 / s[s > tol * s.max()].min()
    close(solve(p, b, tol), expected, 1e-13 * size * max(condition, 10.0))


@given(structures, seeds, forgettings)
@few
def test_learned_noise_weighs_all_occurrences_by_the_newest_r(
    regressors: list[Regressor], seed: int, forgetting: float
) -> None:
    data = case(regressors, seed, 30)
    model = Faithful(data.n, regressors, 15, forgetting=forgetting, noise="learned")
    for y, x in zip(data.y, data.x, strict=True):
        model.observe(data.category, y, x)
        r = model.noise(data.category)
        if r is not None:
            assert np.linalg.eigvalsh(weighting(r, coupled=True).inverse).min() > 0.0
            np.linalg.cholesky(r)
    assert r is not None
    h, x = data.stacked(forgetting, r)
    assume(np.linalg.cond(h) < 1e3)
    theta, precision = parameters(model, data.category)
    close(theta, np.linalg.lstsq(h, x, rcond=None)[0], 1e-7)
    close(precision, h.T @ h, 1e-9)


@given(structures, seeds, st.integers(0, 25), st.sampled_from(["none", "full", "learned"]))
@few
def test_a_restored_estimator_goes_on_bit_for_bit(
    regressors: list[Regressor], seed: int, split: int, kind: str
) -> None:
    data = case(regressors, seed, 30)
    rng = np.random.default_rng(seed)
    names = [tuple(row) for row in rng.integers(-1, 2, (30, data.n)).tolist()]
    noise = {"none": None, "full": full_noise(data.n, seed), "learned": "learned"}[kind]

    def fresh() -> Faithful:
        return Faithful(data.n, regressors, forgetting=0.95, noise=noise)  # type: ignore[arg-type]

    first = fresh()
    for name, y, x in zip(names[:split], data.y, data.x, strict=False):
        first.observe(name, y, x)
    second = fresh()
    second.restore(first.snapshot())
    assert second.categories == first.categories
    for name, y, x in zip(names[split:], data.y[split:], data.x[split:], strict=True):
        a, b = first.predict(name, y), second.predict(name, y)
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert a.tobytes() == b.tobytes()
        first.observe(name, y, x)
        second.observe(name, y, x)
    ours, theirs = first.snapshot(), second.snapshot()
    assert list(ours) == list(theirs)
    for key, array in ours.items():
        assert array.tobytes() == theirs[key].tobytes()
