"""Within a primitive: what lever and speed add to the survival form, and when they do not."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.passing import (
    _COUNT,
    Moment,
    PassingModel,
    PassingWeights,
    UnderWay,
    condition,
    uncondition,
)
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import FloatArray

LIMITS = np.array([[0.0, 10.0]])
BINS = 10
held = UnderWay(np.ones(1), np.ones(1), np.full(1, 0.5))
released = UnderWay(np.full(1, 0.5), np.ones(1), np.full(1, 0.5))


@dataclass
class Way:
    """A primitive of one actuator: its forecast, its moments, and how far it went."""

    forecast: DisplacementForecast
    moments: list[Moment]
    x: float


def primitive(model: Rampe, rng: np.random.Generator) -> Way | None:
    """A half-released lever means "ends now"; until then it is held hard, more or less."""
    q = rng.uniform(1.0, 5.0, 1)
    x = float(rng.gamma(6.0, 1.0 / 6.0))
    forecast = model.predict((1,), q)
    moments = []
    for share in np.arange(0.05, 1.0, 0.1):
        ends = x * (1.0 - share) < 0.12
        command = rng.uniform(0.3, 0.6) if ends else rng.uniform(0.85, 1.0)
        speed = np.full(1, command * rng.uniform(0.5, 0.7))
        lever = UnderWay(np.full(1, command), np.ones(1), speed)
        moments.append(Moment(np.full(1, share * x), lever))
    refusal = model.observe((1,), q, np.array([x]))
    if forecast is None or refusal is not None:
        return None
    return Way(forecast, moments, x)


def asked(ways: list[Way]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Probability with lever and speed, by the survival form, and what became of it."""
    rows = []
    for way in ways:
        for moment in way.moments:
            for ahead in (0.15, 0.3, 0.6, 1.0):
                distance = moment.progress + ahead
                told = way.forecast.passing(distance, moment.progress, moment.under_way)
                plain = way.forecast.passing(distance, moment.progress)
                rows.append((told[0], plain[0], float(way.x >= distance[0])))
    told, plain, became = np.array(rows).T
    return told, plain, became


def brier(p: FloatArray, became: FloatArray) -> float:
    return float(np.mean((p - became) ** 2))


def calibration_error(p: FloatArray, became: FloatArray) -> float:
    """ECE: |promised - kept| of ten equal bins, weighed by how many fell in each."""
    at = np.minimum((p * BINS).astype(int), BINS - 1)
    gaps = [
        np.count_nonzero(at == b) * abs(p[at == b].mean() - became[at == b].mean())
        for b in range(BINS)
        if (at == b).any()
    ]
    return float(np.sum(gaps)) / len(p)


def test_what_a_released_lever_means_is_learned() -> None:
    """On primitives held out, ECE below 0.05 and a better Brier score than without."""
    rng = np.random.default_rng(0)
    model = Rampe(1, limits=LIMITS)
    for _ in range(300):
        way = primitive(model, rng)
        if way is not None:
            model.learn_passing(way.forecast, way.moments, np.array([way.x]))
    kept = [way for _ in range(300) if (way := primitive(model, rng)) is not None]
    told, plain, became = asked(kept)
    gap, without = calibration_error(told, became), calibration_error(plain, became)
    print(f"ECE {gap:.3f} without {without:.3f}")
    print(f"Brier {brier(told, became):.4f} without {brier(plain, became):.4f}")
    assert gap < 0.05
    assert brier(told, became) < 0.9 * brier(plain, became)


def test_a_released_lever_says_it_will_end_from_the_first_primitive() -> None:
    weights = PassingModel(1).weights
    ratio = np.array([0.7])
    assert condition(ratio, weights, released)[0] < 0.3
    assert condition(ratio, weights, held)[0] == pytest.approx(0.7)


def test_an_operator_whose_lever_says_nothing_gets_the_survival_form_back() -> None:
    """The lever flutters at random: the belief in it goes, and the score is as without."""
    rng = np.random.default_rng(0)
    model = PassingModel(1)
    for _ in range(1500):
        ratio = rng.uniform(0.05, 0.95, 4)
        passed = (rng.random(4) < ratio).astype(float)
        lever = UnderWay(rng.uniform(0.2, 1.0, 4), np.ones(4), rng.random(4))
        model.learn(ratio, lever, np.zeros(4), passed)
    ratio = np.linspace(0.1, 0.9, 9)
    for now in (held, released):
        np.testing.assert_allclose(condition(ratio, model.weights, now), ratio, atol=0.1)


def test_learning_is_newton_s_step_on_the_penalised_likelihood() -> None:
    """The first step, by a gradient and a Hessian of finite differences."""
    rng = np.random.default_rng(3)
    ratio, actuator = rng.uniform(0.1, 0.9, 6), np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    lever = UnderWay(rng.random(6), np.ones(6), rng.random(6))
    passed = np.array([1.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    model = PassingModel(2)
    before, precision = model.mean.copy(), model.precision.copy()
    model.learn(ratio, lever, actuator, passed)

    def loss(theta: FloatArray) -> float:
        total = 0.5 * float((theta - before) @ precision @ (theta - before))
        for i in range(6):
            u, speed = float(lever.command[i]), float(lever.speed[i])
            odds = theta[0] * np.log(ratio[i] / (1.0 - ratio[i]))
            odds += theta[1] * (u - 1.0) + theta[2] * (u - 1.0) + theta[3] * (speed - 0.5)
            odds += theta[4 + int(actuator[i])]
            # moments of one primitive share one end: each counts as a part of an observation
            total += _COUNT * float(np.log1p(np.exp(odds)) - passed[i] * odds)
        return total

    step, unit = 1e-4, np.eye(6)
    gradient = np.array(
        [(loss(before + step * e) - loss(before - step * e)) / (2.0 * step) for e in unit]
    )
    hessian = np.array(
        [
            [
                loss(before + step * (a + b))
                - loss(before + step * (a - b))
                - loss(before + step * (b - a))
                + loss(before - step * (a + b))
                for b in unit
            ]
            for a in unit
        ]
    ) / (4.0 * step * step)
    np.testing.assert_allclose(model.precision, hessian, rtol=1e-4, atol=1e-4)
    expected = before - np.linalg.solve(hessian, gradient)
    np.testing.assert_allclose(model.mean, expected, rtol=1e-4, atol=1e-5)


few = settings(max_examples=60, deadline=None)
shares = st.floats(0.0, 1.0)


@given(
    theta=st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4),
    slope=st.floats(0.2, 3.0),
    command=shares,
    speed=shares,
)
@few
def test_conditioning_keeps_the_order_and_is_undone(
    theta: list[float], slope: float, command: float, speed: float
) -> None:
    weights = PassingWeights(np.array([slope, *theta[:3]]), np.array(theta[3:]))
    now = UnderWay(np.array([command]), np.ones(1), np.array([speed]))
    ratios = np.linspace(0.0, 1.0, 51)
    found = np.array([condition(np.array([r]), weights, now)[0] for r in ratios])
    assert ((found >= 0.0) & (found <= 1.0)).all()
    assert (np.diff(found) >= 0.0).all()
    assert found[0] == 0.0  # impossible stays impossible
    for r, p in zip(ratios[1:-1], found[1:-1], strict=True):
        if 1.01e-4 < p < 1.0 - 1.01e-4:  # beyond, both stay where they are
            back = uncondition(np.array([p]), weights, now)[0]
            assert back == pytest.approx(r, abs=1e-5)


def test_nothing_to_learn_from_changes_nothing() -> None:
    model = PassingModel(2)
    before = model.mean.copy()
    none = np.zeros(0)
    model.learn(none, UnderWay(none, none, none), none, none)
    np.testing.assert_array_equal(model.mean, before)
    rampe = Rampe(1, limits=LIMITS)
    rampe.observe((1,), [1.0], [1.0])
    p = rampe.predict((1,), [1.0])
    assert p is not None
    rampe.learn_passing(p, [], np.ones(1))
    rampe.learn_passing(p, [Moment(np.zeros(1), held)], np.array([np.nan]))
    after = rampe.predict((1,), [1.0])
    assert after is not None
    assert after.weights is not None
    assert p.weights is not None
    np.testing.assert_array_equal(after.weights.shared, p.weights.shared)
