"""What was learned, as arrays: restored to the last bit, and refused when damaged."""

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.config import Basis
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.passing import Moment, UnderWay
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray
from tests.support.models import same_bits

Arrays = dict[str, npt.NDArray[Any]]
Step = tuple[Category, FloatArray, FloatArray, FloatArray]
LIMITS = np.array([[-3.0, 3.0], [0.0, 2.0], [-1.0, 1.0]])
POOL: tuple[Category, ...] = ((1, 0, 0), (-1, 0, 0), (1, 1, 0), (0, -1, 1), (0, 0, -1))
bases = pytest.mark.parametrize(
    "basis", ["affine", "quadratic", "radial", ("radial", "affine", "quadratic")]
)


def steps(seed: int, count: int, observed: int = 0) -> list[Step]:
    """Several categories, among them one with two futures, and now and then a bad primitive."""
    rng = np.random.default_rng(seed)
    result = []
    for k in range(count):
        category = POOL[rng.integers(len(POOL))]
        q = rng.uniform([-1.0, 0.7, -0.4], [1.0, 1.3, 0.4])
        size = np.array([0.5, 0.2, 0.15]) * (1.0 + 0.1 * rng.standard_normal(3))
        if category == (1, 0, 0) and rng.random() < 0.5:
            size = 3.0 * size
        if k % 23 == 22:
            size = np.array([np.nan, 9.0, 0.1])
        x = np.array(category) * size
        result.append(
            (category, q, np.where(np.array(category) == 0, 0.0, x), rng.random(observed))
        )
    return result


def taught(some: Sequence[Step], basis: Any = "radial", observed: int = 0) -> Rampe:
    model = Rampe(3, limits=LIMITS, basis=basis, observations=observed)
    return teach(model, some)


def teach(model: Rampe, some: Sequence[Step]) -> Rampe:
    """Observe, and learn from lever and speed on the way."""
    for category, q, x, xi in some:
        known = model.predict(category, q, xi)
        refusal = model.observe(category, q, x, xi)
        if known is not None and refusal is None:
            way = np.abs(x)
            lever = UnderWay(np.full(3, 0.6), np.ones(3), np.full(3, 0.4))
            model.learn_passing(known, [Moment(0.2 * way, lever), Moment(0.7 * way, lever)], x)
    return model


def bits(p: DisplacementForecast | None) -> list[bytes] | None:
    if p is None:
        return None
    assert p.weights is not None
    arrays = [p.mean, p.scale, p.dof, p.covariance, p.mode_weights, p.weights.shared]
    optional = [np.zeros(0) if a is None else a for a in (p.shape, p.modes, p.room)]
    extra = np.array([p.occurrences, *(s for c in p.related for s in c)])
    return [a.tobytes() for a in (*arrays, *optional, p.weights.offset, extra)]


def same_model(a: Rampe, b: Rampe, some: Sequence[Step]) -> None:
    for category, q, _, xi in some:
        assert bits(a.predict(category, q, xi)) == bits(b.predict(category, q, xi))
    assert a.categories == b.categories
    assert a.refused == b.refused


@bases
@pytest.mark.parametrize("observed", [0, 2])
def test_a_restored_model_is_the_same_and_goes_on_the_same(
    basis: Basis | tuple[Basis, ...], observed: int
) -> None:
    lessons, more = steps(1, 120, observed), steps(2, 60, observed)
    model = taught(lessons, basis, observed)
    assert any(p.bimodal for c, q, _, xi in more if (p := model.predict(c, q, xi)) is not None)
    arrays = deepcopy(model.snapshot())
    other = Rampe(3, limits=LIMITS, basis=basis, observations=observed)
    other.restore(arrays)
    same_model(model, other, more)
    assert same_bits(other.snapshot(), arrays)
    teach(model, more)
    teach(other, more)
    same_model(model, other, steps(3, 30, observed))
    assert same_bits(model.snapshot(), other.snapshot())


def test_a_suspect_waits_for_its_second_beyond_a_restart() -> None:
    model = Rampe(1, limits=[[-10.0, 10.0]])
    rng = np.random.default_rng(0)
    for _ in range(40):
        model.observe((1,), rng.uniform(-1.0, 1.0, 1), 1.0 + 0.02 * rng.standard_normal(1))
    assert model.observe((1,), [0.0], [7.0]) == "outlier"
    other = Rampe(1, limits=[[-10.0, 10.0]])
    other.restore(model.snapshot())
    assert other.observe((1,), [0.0], [7.1]) is None
    p = other.predict((1,), [0.0])
    assert p is not None
    assert p.mean[0] > 1.5


def test_an_unlearned_model_is_restored_too() -> None:
    other = taught(steps(1, 30))
    other.restore(Rampe(3, limits=LIMITS).snapshot())
    assert other.categories == {}
    assert other.predict((1, 0, 0), np.zeros(3)) is None


def test_a_snapshot_is_a_moment_and_does_not_learn_on() -> None:
    """It may be written by another thread while the model learns."""
    model = taught(steps(1, 40))
    arrays = model.snapshot()
    before = deepcopy(arrays)
    teach(model, steps(2, 40))
    assert same_bits(arrays, before)
    other = Rampe(3, limits=LIMITS)
    other.restore(arrays)
    teach(other, steps(3, 40))
    assert same_bits(arrays, before)


@pytest.mark.parametrize(
    "other",
    [
        Rampe(2),
        Rampe(3, basis="affine"),
        Rampe(3, basis=("radial", "radial", "affine")),
        Rampe(3, observations=1),
        Rampe(3, mode="faithful"),
    ],
    ids=["two actuators", "basis", "one basis", "observations", "faithful"],
)
def test_what_another_estimator_learned_is_refused(other: Rampe) -> None:
    model = taught(steps(1, 40))
    before = deepcopy(model.snapshot())
    with pytest.raises(ValueError, match=r"is|has|missing|need"):
        model.restore(other.snapshot())
    assert same_bits(model.snapshot(), before)
    with pytest.raises(ValueError, match=r"is|has|missing|need"):
        other.restore(before)
    assert other.categories == {}


LEARNED = {
    basis: taught(steps(1, 60), basis) for basis in ("radial", ("affine", "quadratic", "radial"))
}


def damage(array: npt.NDArray[Any], how: str, draw: st.DataObject) -> npt.NDArray[Any] | None:
    """The array with one thing wrong; None where this cannot be done to it."""
    flat = array.ravel().copy()
    if how in ("nan", "infinite", "minus"):
        if len(flat) == 0:
            return None
        at = draw.draw(st.integers(0, len(flat) - 1))
        values = flat.astype(np.float64)
        values[at] = {"nan": np.nan, "infinite": np.inf, "minus": -1e6}[how]
        return values.reshape(array.shape)
    if how == "truncated":
        return None if len(flat) == 0 or array.ndim == 0 else flat[:-1]
    if how == "longer":
        return np.append(flat, flat[-1:] if len(flat) else 0.0)
    if how == "reshaped":
        return array.reshape(1, *array.shape)
    return np.array(["no number"] * max(len(flat), 1))


@pytest.mark.parametrize("basis", list(LEARNED), ids=["radial", "mixed"])
@pytest.mark.parametrize(
    "how", ["nan", "infinite", "minus", "truncated", "longer", "reshaped", "text", "dropped"]
)
@given(draw=st.data())
@settings(max_examples=12, deadline=None)
def test_damaged_arrays_are_refused_and_change_nothing(
    basis: Any, how: str, draw: st.DataObject
) -> None:
    """What cannot be refused because it may well be so is at least harmless."""
    model = LEARNED[basis]
    whole = deepcopy(model.snapshot())
    arrays = dict(whole)
    name = draw.draw(st.sampled_from(sorted(whole)))
    if how == "dropped":
        del arrays[name]
    else:
        bad = damage(arrays[name], how, draw)
        if bad is None or np.array_equal(bad, whole[name]):
            return
        arrays[name] = bad
    other = Rampe(3, limits=LIMITS, basis=basis)
    try:
        other.restore(arrays)
    except ValueError:
        assert other.categories == {}
        assert other.predict((1, 0, 0), np.zeros(3)) is None
        with pytest.raises(ValueError, match=r"."):
            model.restore(arrays)
        assert same_bits(model.snapshot(), whole)
        return
    # only a value that could be true comes through: one that changes sign, or has no bound
    assert (how, name) in {
        *(("minus", n) for n in ("starts", "moves", "drift", "surprise", "suspects")),
        *(("minus", n) for n in ("ridge_centers", "ridge_sums", "passing_mean", "scale_low")),
    }, f"{name} {how} was taken"
    for category, q, _, _ in steps(4, 10):
        p = other.predict(category, q)
        assert p is None or (np.isfinite(p.mean).all() and np.isfinite(p.scale).all())
