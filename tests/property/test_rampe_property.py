"""What every forecast keeps to, whatever was learned; and the front of both modes."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.passing import Moment, UnderWay
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray

LIMITS = np.array([[-1.0, 3.0], [0.0, 0.5], [-20.0, 20.0]])
seeds = st.integers(0, 100_000)
few = settings(max_examples=20, deadline=None)


@dataclass
class Asked:
    """A model of a random operator, a category, a start and the forecast there."""

    model: Rampe
    category: Category
    q: FloatArray
    limits: FloatArray | None
    p: DisplacementForecast

    @property
    def sign(self) -> FloatArray:
        return np.array(self.category, dtype=float)

    @property
    def room(self) -> FloatArray:
        if self.limits is None:
            return np.full(3, np.inf)
        return np.where(self.sign > 0, self.limits[:, 1] - self.q, self.q - self.limits[:, 0])


def asked(seed: int, count: int, *, limits: bool) -> Asked:
    """Mixed habits: long, short, scattered, two futures, taps; now and then nonsense."""
    rng = np.random.default_rng(seed)
    model = Rampe(3, limits=LIMITS if limits else None)
    pool = [tuple(int(s) for s in row) for row in rng.integers(-1, 2, (12, 3)) if row.any()][:6]
    span = LIMITS[:, 1] - LIMITS[:, 0]
    habit = {c: span * rng.uniform(0.02, 0.7, 3) for c in pool}
    scatter = rng.choice([0.02, 0.2, 0.7])
    for k in range(count):
        category = pool[rng.integers(len(pool))]
        q = rng.uniform(LIMITS[:, 0], LIMITS[:, 1])
        size = habit[category] * np.maximum(1.0 + scatter * rng.standard_normal(3), 0.0)
        size = size * rng.choice([0.2, 1.0]) if category == pool[0] else size
        x = np.array(category) * size * (rng.random() > 0.1)
        end = np.clip(q + x, LIMITS[:, 0], LIMITS[:, 1])
        x = rng.standard_normal(3) * span if k % 17 == 16 else end - q
        known = model.predict(category, q)
        if model.observe(category, q, x) is None and known is not None:
            lever = UnderWay(rng.random(3), np.ones(3), rng.random(3))
            model.learn_passing(known, [Moment(0.5 * np.abs(x), lever)], x)
    category, q = pool[seed % len(pool)], rng.uniform(LIMITS[:, 0], LIMITS[:, 1])
    p = model.predict(category, q)
    assume(p is not None)
    assert p is not None
    return Asked(model, category, q, LIMITS if limits else None, p)


cases = given(seed=seeds, count=st.integers(1, 80), limits=st.booleans())


@cases
@few
def test_mean_and_ends_lead_along_the_category_and_stay_in_the_limits(
    seed: int, count: int, *, limits: bool
) -> None:
    one = asked(seed, count, limits=limits)
    ends = [one.p.mean, one.p.likeliest, *(() if one.p.modes is None else one.p.modes)]
    for x in ends:
        assert np.isfinite(x).all()
        assert (one.sign * x >= 0.0).all()
        assert (np.abs(x) <= one.room * (1.0 + 1e-12)).all()
        np.testing.assert_array_equal(x[one.sign == 0.0], 0.0)


@cases
@few
def test_covariance_is_one_and_fits_the_scale(seed: int, count: int, *, limits: bool) -> None:
    p = asked(seed, count, limits=limits).p
    np.testing.assert_array_equal(p.covariance, p.covariance.T)
    assert np.linalg.eigvalsh(p.covariance)[0] >= -1e-9 * np.trace(p.covariance)
    still = np.array(p.category) == 0
    assert (p.scale[~still] > 0.0).all()
    np.testing.assert_array_equal(p.scale[still], 0.0)
    np.testing.assert_array_equal(p.covariance[still], 0.0)
    # a Student-t has a variance from 2 degrees of freedom on; below 3 that of 3 is taken
    dof = np.maximum(p.dof, 3.0)
    within = p.scale**2 * dof / (dof - 2.0)
    if p.modes is not None:
        within = within + p.mode_weights.prod() * (p.modes[0] - p.modes[1]) ** 2
    np.testing.assert_allclose(np.diagonal(p.covariance), within, rtol=1e-9, atol=1e-15)


@cases
@few
def test_quantiles_rise_and_invert_the_survival(seed: int, count: int, *, limits: bool) -> None:
    one = asked(seed, count, limits=limits)
    levels = np.linspace(0.005, 0.995, 67)
    along = np.array([one.sign * one.p.quantile(float(level)) for level in levels])
    assert (along >= 0.0).all()
    assert (along <= one.room * (1.0 + 1e-12)).all()
    assert (np.diff(along, axis=0) >= -1e-9 * np.abs(along[1:])).all()
    for level, x in zip(levels, along, strict=True):
        free = (one.sign != 0.0) & (x > 0.0) & (x < one.room)
        np.testing.assert_allclose(one.p.survival(x)[free], 1.0 - level, atol=1e-6)
    np.testing.assert_array_equal(one.p.survival(along[30])[one.sign == 0.0], 0.0)


@given(seed=seeds, count=st.integers(1, 80), limits=st.booleans(), lever=st.booleans())
@few
def test_passing_falls_from_one_and_reach_is_its_inverse(
    seed: int, count: int, *, limits: bool, lever: bool
) -> None:
    one = asked(seed, count, limits=limits)
    rng, active = np.random.default_rng(seed), one.sign != 0.0
    now = UnderWay(rng.random(3), np.ones(3), rng.random(3)) if lever else None
    progress = np.abs(one.p.quantile(float(rng.uniform(0.05, 0.7))))
    far = np.where(active, np.abs(one.p.quantile(0.999)) - progress, 1.0)
    steps = np.linspace(-0.5, 1.5, 41)
    passing = np.array([one.p.passing(progress + s * far, progress, now) for s in steps])
    assert ((passing >= 0.0) & (passing <= 1.0)).all()
    assert (passing[steps <= 0.0][:, active] == 1.0).all()
    assert (np.diff(passing, axis=0) <= 1e-12).all()
    for probability in (0.1, 0.5, 0.9):
        reach = one.p.reach(probability, progress, now)
        assert (reach >= progress).all()
        found = one.p.passing(reach, progress, now)
        # at the limit all that is left ends, and at once where the lever says so
        free = active & (reach > progress) & (reach < one.room * (1.0 - 1e-9))
        if lever:
            plain = one.p.passing(reach, progress)
            free &= (plain > 1e-4) & (plain < 1.0 - 1e-4)
        np.testing.assert_allclose(found[free], probability, atol=1e-5)


@given(seed=seeds, limits=st.booleans())
@few
def test_any_finite_primitives_leave_finite_forecasts(seed: int, *, limits: bool) -> None:
    """From a billionth to a million units, in any order: never NaN, nor a warning."""
    rng = np.random.default_rng(seed)
    model = Rampe(2, limits=LIMITS[:2] if limits else None)
    for _ in range(40):
        category: Category = ((1, 0), (-1, 1), (1, 1))[rng.integers(3)]
        size = 10.0 ** rng.uniform(-9.0, 6.0, 2) * rng.choice(
            [1.0, 0.0, -1.0], 2, p=[0.8, 0.1, 0.1]
        )
        q = rng.uniform(LIMITS[:2, 0], LIMITS[:2, 1])
        p = model.predict(category, q)
        if p is not None:
            for values in (p.mean, p.scale, p.dof, p.covariance, p.quantile(0.9)):
                assert np.isfinite(values).all()
        model.observe(category, q, np.array(category) * size)


# the front of both modes -----------------------------------------------------------------------


@given(seeds, st.integers(5, 40), st.floats(0.8, 1.0))
@few
def test_faithful_equals_batch_weighted_least_squares(seed: int, count: int, lam: float) -> None:
    rng = np.random.default_rng(seed)
    q = rng.uniform(LIMITS[:2, 0], LIMITS[:2, 1], (count, 2))
    x = q @ rng.normal(size=(2, 2)) * 0.1 + [0.8, 0.1] + 0.05 * rng.normal(size=(count, 2))
    model = Rampe(2, mode="faithful", n_init=4, forgetting=lam, tol=1e-14)
    for qi, xi in zip(q, x, strict=True):
        assert model.observe((1, 1), qi, xi) is None
    h = np.column_stack([q, np.ones(count)])
    w = np.array([[np.sqrt(lam**age)] for age in reversed(range(count))], dtype=np.float64)
    assume(np.linalg.cond((w * h)[:4]) < 1e4)
    assume(np.linalg.cond(w * h) < 1e4)
    theta = np.asarray(np.linalg.lstsq(w * h, w * x, rcond=None)[0], dtype=np.float64)
    at = np.array([0.3, 0.2])
    p = model.predict((1, 1), at)
    assert p is not None
    np.testing.assert_allclose(p.mean, np.append(at, 1.0) @ theta, rtol=1e-6, atol=1e-9)
    assert np.isnan(p.scale).all()
    assert p.occurrences == count
    assert model.categories == {(1, 1): count}
    assert model.refused == {}


def test_faithful_forecasts_nothing_before_n_init_and_refuses_by_an_error() -> None:
    model = Rampe(2, mode="faithful", n_init=3)
    rng = np.random.default_rng(0)
    for k in range(5):
        assert (model.predict((1, 0), np.zeros(2)) is None) == (k < 3)
        model.observe((1, 0), rng.random(2), np.array([1.0, 0.0]))
    with pytest.raises(ValueError, match="finite"):
        model.observe((1, 0), [np.nan, 0.0], [1.0, 0.0])
    assert model.categories == {(1, 0): 5}


@pytest.mark.parametrize("mode", ["bayesian", "faithful"])
@pytest.mark.parametrize(
    ("category", "q", "x", "said"),
    [
        ((1, 1), [0.0], [1.0, 1.0], "q and ξ have 1"),
        ((1, 1), [0.0, 0.0, 0.0], [1.0, 1.0], "q and ξ have 3"),
        ((1, 1), [0.0, 0.0], [1.0], "x has shape"),
        ((1,), [0.0, 0.0], [1.0, 1.0], "category"),
        ((0, 0), [0.0, 0.0], [1.0, 1.0], "category"),
        ((2, 0), [0.0, 0.0], [1.0, 1.0], "category"),
    ],
)
def test_what_cannot_be_a_primitive_is_an_error_and_changes_nothing(
    mode: str, category: Category, q: list[float], x: list[float], said: str
) -> None:
    model = Rampe(2, mode="faithful" if mode == "faithful" else "bayesian", n_init=1)
    model.observe((1, 1), [0.1, 0.2], [1.0, 0.5])
    before = model.predict((1, 1), [0.1, 0.2])
    with pytest.raises(ValueError, match=said):
        model.observe(category, q, x)
    after = model.predict((1, 1), [0.1, 0.2])
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(before.mean, after.mean)
    assert model.categories == {(1, 1): 1}


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="forgetting is 1"):
        Rampe(1, forgetting=1.5)
    with pytest.raises(ValueError, match="limits have shape"):
        Rampe(2, limits=np.zeros((1, 2)))
    with pytest.raises(ValueError, match="basis"):
        Rampe(3, basis=("radial", "affine"))


def test_the_table_shows_what_was_learned() -> None:
    model = Rampe(2, limits=LIMITS[:2])
    for k in range(4):
        model.observe((-1, 0), [1.0, 0.2], [-0.4 - 0.1 * k, 0.0])
    model.observe((0, 1), [1.0, 0.2], [0.0, 0.1])
    often, once = model.table()
    assert (often.category, often.occurrences) == ((-1, 0), 4)
    np.testing.assert_allclose(often.mean_displacement, [-0.55, 0.0])
    scatter = float(np.array([0.4, 0.5, 0.6, 0.7]).std())
    np.testing.assert_allclose(often.spread, [scatter, 0.0])
    assert (once.category, once.occurrences) == ((0, 1), 1)
