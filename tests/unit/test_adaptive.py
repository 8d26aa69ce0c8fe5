"""The default mode on simulated operators: borrowing, drift, spread, calibration, memory."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray
from tests.support.depth import depth

LIMITS = np.array([[-4.0, 4.0], [0.0, 6.0], [-2.0, 2.0]])
MEGABYTE = 1e6
known_or_not = pytest.mark.parametrize("limits", [LIMITS, None], ids=["limits", "unlimited"])


def forecast(model: Rampe, category: Category, q: FloatArray) -> DisplacementForecast:
    p = model.predict(category, q)
    assert p is not None
    return p


def starts(rng: np.random.Generator) -> FloatArray:
    return rng.uniform([-1.0, 2.5, -0.5], [1.0, 3.5, 0.5])


# categories ------------------------------------------------------------------------------------


def worked(limits: FloatArray | None, seed: int = 0) -> Rampe:
    """Swings of 1.2 and lifts of 0.5 alone; the third actuator has never moved."""
    rng = np.random.default_rng(seed)
    model = Rampe(3, limits=limits)
    for _ in range(25):
        size = 1.0 + 0.1 * rng.standard_normal(3)
        model.observe((1, 0, 0), starts(rng), size * [1.2, 0.0, 0.0])
        model.observe((0, 1, 0), starts(rng), size * [0.0, 0.5, 0.0])
    return model


@known_or_not
def test_a_category_never_seen_borrows_from_its_neighbours(limits: FloatArray | None) -> None:
    model, q = worked(limits), np.array([0.0, 3.0, 0.0])
    both = forecast(model, (1, 1, 0), q)
    assert both.occurrences == 0
    assert both.borrowed
    assert set(both.related) == {(1, 0, 0), (0, 1, 0)}
    np.testing.assert_allclose(both.mean, [1.2, 0.5, 0.0], rtol=0.2)
    swing, lift = forecast(model, (1, 0, 0), q), forecast(model, (0, 1, 0), q)
    assert not swing.borrowed
    assert both.scale[0] > 1.2 * swing.scale[0]
    assert both.scale[1] > 1.2 * lift.scale[1]


def test_what_neighbours_do_unlike_the_rest_is_borrowed() -> None:
    """Beside a lift he always swings little, to the left a lot: who lifts more swings so too."""
    rng = np.random.default_rng(1)
    model = Rampe(3, limits=LIMITS)
    for _ in range(25):
        size = 1.0 + 0.1 * rng.standard_normal(3)
        model.observe((1, 1, 0), starts(rng), size * [0.3, 0.5, 0.0])
        model.observe((-1, 0, 0), starts(rng), size * [-1.5, 0.0, 0.0])
        model.observe((0, 0, 1), starts(rng), size * [0.0, 0.0, 0.4])
    q = np.array([0.0, 3.0, 0.0])
    near, usual = forecast(model, (1, 1, 1), q), 0.9
    alone = Rampe(3, limits=LIMITS)
    alone.restore(model.snapshot())
    assert near.related == ((1, 1, 0),)
    assert near.mean[0] < usual - 0.25
    assert near.mean[2] == pytest.approx(0.4, rel=0.15)  # nothing to borrow: the usual one


@known_or_not
def test_an_actuator_that_never_moved_has_no_forecast(limits: FloatArray | None) -> None:
    model, q = worked(limits), np.array([0.0, 3.0, 0.0])
    assert model.predict((0, 0, 1), q) is None
    assert model.predict((1, 0, -1), q) is None
    assert Rampe(3, limits=limits).predict((1, 0, 0), q) is None


@known_or_not
def test_an_actuator_whose_only_primitive_was_refused_has_none(limits: FloatArray | None) -> None:
    """A first occurrence that is set aside as an outlier is no experience."""
    model, q = worked(limits), np.array([0.0, 3.0, 0.0])
    model.observe((1, 0, 1), q - [3.0, 0.0, 0.0], np.array([6.5, 0.0, 0.3]))
    if (1, 0, 1) not in model.categories:
        assert model.predict((1, 0, 1), q) is None
        assert model.predict((0, 0, 1), q) is None


def test_driven_but_never_moved_has_no_forecast_without_limits() -> None:
    """Its lever was held and it stood still: how far it goes is as unknown as before."""
    model = Rampe(2)
    model.observe((1, 1), np.zeros(2), np.array([0.5, 0.0]))
    assert model.predict((1, 1), np.zeros(2)) is None
    assert model.predict((1, 0), np.zeros(2)) is not None


@pytest.mark.parametrize("n_init", [1, 3])
def test_nothing_is_forecast_before_n_init(n_init: int) -> None:
    rng = np.random.default_rng(0)
    model = Rampe(3, limits=LIMITS, n_init=n_init)
    for k in range(n_init + 2):
        p = model.predict((1, 0, 0), np.zeros(3))
        assert (p is None) == (k < n_init)
        assert p is None or p.occurrences == k
        model.observe((1, 0, 0), starts(rng), np.array([1.0, 0.0, 0.0]))
    assert model.predict((-1, 0, 0), np.zeros(3)) is None


@pytest.mark.parametrize("size", [0.2, 1.5, 2.5])
def test_one_occurrence_is_already_of_use(size: float) -> None:
    """The believed displacement is 0.8; one primitive takes two thirds of the error at least."""
    model, q = Rampe(3, limits=LIMITS), np.array([-1.0, 3.0, 0.0])
    believed = 0.1 * (LIMITS[0, 1] - LIMITS[0, 0])
    model.observe((1, 0, 0), q, np.array([size, 0.0, 0.0]))
    p = forecast(model, (1, 0, 0), q)
    assert p.occurrences == 1
    assert abs(p.mean[0] - size) < 0.34 * abs(believed - size)
    unlimited = Rampe(3)
    unlimited.observe((1, 0, 0), q, np.array([size, 0.0, 0.0]))
    assert forecast(unlimited, (1, 0, 0), q).mean[0] == pytest.approx(size)


# drift and spread ------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [0.5, 2.0])
@known_or_not
def test_a_change_of_habit_is_followed_within_a_handful(
    limits: FloatArray | None, factor: float
) -> None:
    """Of the step, half is left after 4 occurrences of the new habit and a fifth after 10."""
    left: list[list[float]] = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        model = Rampe(3, limits=limits)
        left.append([])
        for k in range(50):
            size = 1.0 if k < 40 else factor
            x = size * (1.0 + 0.1 * rng.standard_normal())
            model.observe((1, 0, 0), starts(rng), np.array([x, 0.0, 0.0]))
            if k in (39, 43, 49):
                means = [forecast(model, (1, 0, 0), starts(rng)).mean[0] for _ in range(5)]
                left[-1].append(abs(float(np.mean(means)) - factor) / abs(1.0 - factor))
    before, soon, later = np.mean(left, axis=0)
    print(f"left of the step: {before:.2f}, after 4: {soon:.2f}, after 10: {later:.2f}")
    assert before > 0.9
    assert soon < 0.65
    assert later < 0.25


def test_a_slow_drift_is_followed() -> None:
    """From 0.8 to 1.6 over 80 primitives: on the whole a tenth behind (of two thirds)."""
    behind = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        model = Rampe(3, limits=LIMITS)
        for k in range(80):
            now, q = 0.8 + 0.01 * k, starts(rng)
            if k > 20:
                behind.append(forecast(model, (1, 0, 0), q).mean[0] / now - 1.0)
            x = now * (1.0 + 0.05 * rng.standard_normal())
            model.observe((1, 0, 0), q, np.array([x, 0.0, 0.0]))
    print(f"{np.mean(behind):.1%}")
    assert abs(float(np.mean(behind))) < 0.13


def test_scatter_is_learned_for_each_category_and_actuator() -> None:
    """R(Ω): to the right he is careful, to the left he is not, and lifting lies between."""
    rng = np.random.default_rng(0)
    model = Rampe(3, limits=LIMITS)
    scatter: dict[Category, float] = {(1, 0, 0): 0.03, (-1, 0, 0): 0.35, (0, 1, 0): 0.12}
    for _ in range(60):
        for category, part in scatter.items():
            x = np.array(category) * np.maximum(1.0 + part * rng.standard_normal(), 0.05)
            model.observe(category, starts(rng), x)
    q = np.array([0.0, 3.0, 0.0])
    shown = {c: float(np.sqrt(forecast(model, c, q).covariance.max())) for c in scatter}
    print(shown)
    assert shown[1, 0, 0] < 0.3 * shown[-1, 0, 0]
    assert shown[1, 0, 0] < shown[0, 1, 0] < shown[-1, 0, 0]
    assert 0.7 * 0.35 < shown[-1, 0, 0] < 1.4 * 0.35
    # the actuator's typical scatter, a mixture of 0.03 and 0.35, draws the careful one upwards
    assert 0.03 < shown[1, 0, 0] < 2.5 * 0.03


@pytest.mark.parametrize("sign", [1, -1])
def test_actuators_that_scatter_together_are_correlated(sign: int) -> None:
    """Along Ω by 0.9, drawn towards none; its sign is that of the directions of motion."""
    rng = np.random.default_rng(0)
    model = Rampe(3, limits=LIMITS)
    for _ in range(80):
        a, b = rng.multivariate_normal([0.0, 0.0], [[1.0, 0.9], [0.9, 1.0]])
        x = np.array([1.0 + 0.15 * a, sign * (0.5 + 0.08 * b), 0.0])
        model.observe((1, sign, 0), starts(rng), x)
        e, f = rng.standard_normal(2)
        x = np.array([-1.0 - 0.15 * e, sign * (0.5 + 0.08 * f), 0.0])
        model.observe((-1, sign, 0), starts(rng), x)
    q = np.array([0.0, 3.0, 0.0])
    p, apart = forecast(model, (1, sign, 0), q), forecast(model, (-1, sign, 0), q)
    deviation = np.sqrt(np.diagonal(p.covariance))[:2]
    assert p.covariance[0, 1] == p.covariance[1, 0]
    assert sign * p.covariance[0, 1] / np.prod(deviation) > 0.5
    deviation = np.sqrt(np.diagonal(apart.covariance))[:2]
    assert abs(apart.covariance[0, 1]) / np.prod(deviation) < 0.35


# calibration -----------------------------------------------------------------------------------

Law = Callable[[np.random.Generator, float], float]


def normal(rng: np.random.Generator, size: float) -> float:
    return size * abs(1.0 + 0.2 * rng.standard_normal())


def gamma(rng: np.random.Generator, size: float) -> float:
    return size * rng.gamma(4.0, 0.25)


def with_taps(rng: np.random.Generator, size: float) -> float:
    """One of five is hardly any way at all."""
    return size * (0.02 * rng.random() if rng.random() < 0.2 else 1.0 + 0.2 * rng.standard_normal())


@pytest.mark.no_cover  # statistics over ten thousand primitives
@pytest.mark.parametrize(
    ("law", "limits"),
    [
        *((law, LIMITS) for law in (normal, gamma, with_taps)),
        *((law, None) for law in (normal, gamma, with_taps)),
    ],
)
def test_intervals_hold_what_they_promise(limits: FloatArray | None, law: Law) -> None:
    """Central 50 % and 90 % of forecasts, over six operators after some ten of each category."""
    sizes: dict[Category, float] = {
        (1, 0, 0): 1.0,
        (-1, 0, 0): 1.3,
        (0, 1, 0): 0.4,
        (0, -1, 0): 0.6,
    }
    half, most = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        model = Rampe(3, limits=limits)
        for k in range(60):
            for category, size in sizes.items():
                q = starts(rng)
                place = 1.0 + 0.2 * q[0]  # further from the right than from the left
                x = np.array(category) * law(rng, size * place)
                if k >= 10:
                    p, j = forecast(model, category, q), int(np.argmax(np.abs(category)))
                    way = abs(x[j])
                    low, high = (abs(p.quantile(level)[j]) for level in (0.25, 0.75))
                    half.append(low <= way <= high)
                    low, high = (abs(p.quantile(level)[j]) for level in (0.05, 0.95))
                    most.append(low <= way <= high)
                model.observe(category, q, x)
    print(f"{law.__name__}: 50 % holds {np.mean(half):.1%}, 90 % holds {np.mean(most):.1%}")
    assert 0.45 <= np.mean(half) <= 0.57
    assert 0.85 <= np.mean(most) <= 0.95


# memory ----------------------------------------------------------------------------------------


def size_of(thing: Any, seen: set[int]) -> int:
    """Bytes of all arrays that can be reached from ``thing``, each once."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return size_of(thing.base, seen) if isinstance(thing.base, np.ndarray) else thing.nbytes
    if isinstance(thing, dict):
        return sum(size_of(v, seen) for v in (*thing.keys(), *thing.values()))
    if isinstance(thing, list | tuple | set):
        return sum(size_of(v, seen) for v in thing)
    names = {*getattr(thing, "__dict__", {}), *getattr(type(thing), "__slots__", ())}
    return sum(size_of(getattr(thing, name, None), seen) for name in names)


@pytest.mark.no_cover  # nothing that others do not reach, and half as long
@pytest.mark.no_cover  # thousands of primitives
def test_only_categories_that_were_seen_cost_memory() -> None:
    """A glove of 28 axes, 3,684 categories of which most are rare, 20,000 primitives by night."""
    rng = np.random.default_rng(0)
    n, total, count = 28, 3_684, depth(6_000, 20_000)
    pool: dict[Category, None] = {}
    while len(pool) < total:
        signs = np.zeros(n, dtype=int)
        moving = rng.choice(n, rng.integers(1, 7), replace=False)
        signs[moving] = rng.choice([-1, 1], len(moving))
        pool[tuple(int(s) for s in signs)] = None
    names = list(pool)
    often = 1.0 / np.arange(1, total + 1)
    order = np.concatenate(
        (np.arange(total), rng.choice(total, count - total, p=often / often.sum()))
    )
    model = Rampe(n, limits=np.tile([-2.0, 2.0], (n, 1)))
    before = size_of(model, set())
    for i in rng.permutation(order):
        x = np.array(names[i]) * (0.4 + 0.03 * rng.standard_normal(n))
        model.observe(names[i], rng.uniform(0.0, 1.0, n), x)
    assert len(model.categories) == total
    assert sum(model.categories.values()) + sum(model.refused.values()) == count
    taken = size_of(model, set())
    print(f"{taken / MEGABYTE:.1f} MB")
    assert before < 0.1 * MEGABYTE
    assert taken < 50.0 * MEGABYTE
    assert taken > 0.5 * sum(a.nbytes for a in model.snapshot().values())
