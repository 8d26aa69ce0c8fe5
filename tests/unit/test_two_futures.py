"""Two futures from one start: seen where they are, and not where they are not."""

from collections.abc import Callable

import numpy as np
import pytest

from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.modes import two_futures
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import FloatArray

LIMITS = np.array([[-2.0, 2.0], [0.0, 3.0]])
Draw = Callable[[np.random.Generator], FloatArray]


def learned(draw: Draw, seed: int, count: int = 40, *, limits: bool = True) -> Rampe:
    """An operator who always begins about (0, 1) and goes ``draw`` (2,)."""
    rng = np.random.default_rng(seed)
    model = Rampe(2, limits=LIMITS if limits else None)
    for _ in range(count):
        start = np.array([0.0, 1.0]) + 0.02 * rng.standard_normal(2)
        model.observe((1, 1), start, draw(rng))
    return model


def forecast(model: Rampe) -> DisplacementForecast:
    p = model.predict((1, 1), [0.0, 1.0])
    assert p is not None
    return p


def near_or_far(share: float) -> Draw:
    """To 0.2 with probability ``share``, else to 0.6; the other actuator goes along."""

    def draw(rng: np.random.Generator) -> FloatArray:
        end = np.array([0.2, 0.5]) if rng.random() < share else np.array([0.6, 0.5])
        return end + 0.02 * rng.standard_normal(2)

    return draw


@pytest.mark.parametrize("limits", [True, False], ids=["limits", "unlimited"])
def test_both_ends_and_their_shares(limits: bool) -> None:
    for seed in range(20):
        p = forecast(learned(near_or_far(0.5), seed, limits=limits))
        assert p.bimodal
        assert p.modes is not None
        ends = p.modes[np.argsort(p.modes[:, 0])]
        np.testing.assert_allclose(ends, [[0.2, 0.5], [0.6, 0.5]], atol=0.03)
        assert p.mode_weights.sum() == pytest.approx(1.0)
        assert p.mode_weights.min() > 0.25
        assert p.mode_weights[0] >= p.mode_weights[1]
        np.testing.assert_array_equal(p.likeliest, p.modes[0])


def test_shares_are_right_on_the_whole() -> None:
    """Three of five go near: so say the forecasts of 30 operators, to 0.05."""
    shares = []
    for seed in range(30):
        p = forecast(learned(near_or_far(0.6), seed))
        if p.modes is not None:
            shares.append(p.mode_weights[np.argmin(p.modes[:, 0])])
    assert len(shares) >= 27
    assert abs(float(np.mean(shares)) - 0.6) < 0.05


def test_the_likeliest_is_never_where_he_never_stops() -> None:
    p = forecast(learned(near_or_far(0.5), 3))
    assert 0.3 < p.mean[0] < 0.5  # the mean of both, where nobody ever stopped
    assert min(abs(p.likeliest[0] - 0.2), abs(p.likeliest[0] - 0.6)) < 0.03


def test_he_goes_further_only_with_the_share_of_the_far_end() -> None:
    """Passing 0.4 is the share of the far end; having passed 0.4, the far end is sure."""
    p = forecast(learned(near_or_far(0.5), 4))
    assert p.modes is not None
    far = float(p.mode_weights[np.argmax(p.modes[:, 0])])
    middle, beyond = np.array([0.4, 0.45]), np.array([0.5, 0.46])
    assert p.survival(middle)[0] == pytest.approx(far, abs=0.02)
    assert p.passing(beyond, middle)[0] > 0.95


def test_a_forecast_of_two_futures_is_a_distribution() -> None:
    """Quantiles rise, invert the survival, and the reach inverts the passing."""
    p = forecast(learned(near_or_far(0.5), 5))
    levels = np.linspace(0.02, 0.98, 49)
    quantiles = np.array([p.quantile(float(level)) for level in levels])
    assert (np.diff(quantiles, axis=0) >= -1e-12).all()
    for level, x in zip(levels, quantiles, strict=True):
        free = (x > 0.0) & (x < LIMITS[:, 1] - [0.0, 1.0])
        np.testing.assert_allclose(p.survival(x)[free], 1.0 - level, atol=1e-6)
    here = np.array([0.3, 0.3])
    distances = np.linspace(0.0, 1.5, 40)
    passing = np.array([p.passing(np.full(2, d), here) for d in distances])
    assert ((passing >= 0.0) & (passing <= 1.0)).all()
    assert (passing[distances <= 0.3] == 1.0).all()
    assert (np.diff(passing, axis=0) <= 1e-12).all()
    for probability in (0.2, 0.5, 0.8):
        reach = p.reach(probability, here)
        np.testing.assert_allclose(p.passing(reach, here), probability, atol=1e-6)


def test_ends_respect_sign_and_limits() -> None:
    """The far end lies beyond the limit from a start that is nearer to it."""
    rng = np.random.default_rng(0)
    model = Rampe(1, limits=[[-1.0, 1.0]])
    for k in range(40):
        move = 0.3 if k % 2 else 0.9
        model.observe((-1,), 0.1 * rng.standard_normal(1), [-move + 0.02 * rng.standard_normal()])
    p = model.predict((-1,), [-0.2])
    assert p is not None
    assert p.modes is not None
    assert (p.modes <= 0.0).all()
    assert (p.modes >= -0.8).all()
    assert (p.quantile(0.99) >= -0.8).all()


def test_the_covariance_of_two_futures_holds_the_way_between_them() -> None:
    """Joint covariance of x: ends 0.4 apart alone make a deviation of 0.2."""
    p = forecast(learned(near_or_far(0.5), 6))
    assert np.sqrt(p.covariance[0, 0]) == pytest.approx(0.2, abs=0.03)
    assert np.linalg.eigvalsh(p.covariance)[0] >= -1e-12
    assert np.sqrt(p.covariance[1, 1]) < 0.08


def test_both_actuators_part_together() -> None:
    """Ends (0.2, 0.8) and (0.6, 0.3): they are pairs, not four."""

    def draw(rng: np.random.Generator) -> FloatArray:
        end = [0.2, 0.8] if rng.random() < 0.5 else [0.6, 0.3]
        return np.array(end) + 0.02 * rng.standard_normal(2)

    p = forecast(learned(draw, 1))
    assert p.modes is not None
    ends = p.modes[np.argsort(p.modes[:, 0])]
    np.testing.assert_allclose(ends, [[0.2, 0.8], [0.6, 0.3]], atol=0.03)


def test_from_two_places_two_ends_is_no_ambiguity() -> None:
    """Where he begins says where he goes: one future at each place, and the right one."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        model = Rampe(2, limits=LIMITS)
        for k in range(40):
            left = k % 2 == 0
            start = np.array([-1.0 if left else 0.5, 1.0]) + 0.02 * rng.standard_normal(2)
            model.observe(
                (1, 1), start, np.array([0.2 if left else 0.6, 0.5]) + 0.02 * rng.standard_normal(2)
            )
        for at, end in ((-1.0, 0.2), (0.5, 0.6)):
            p = model.predict((1, 1), [at, 1.0])
            assert p is not None
            assert not p.bimodal
            assert abs(p.mean[0] - end) < 0.06


def test_the_change_from_one_habit_to_another_is_not_two_futures_for_long() -> None:
    """Forty to 0.2, then only to 0.6: soon there is one future again, the new one."""
    rng = np.random.default_rng(2)
    model = learned(near_or_far(1.0), 2)
    for _ in range(30):
        start = np.array([0.0, 1.0]) + 0.02 * rng.standard_normal(2)
        model.observe((1, 1), start, near_or_far(0.0)(rng))
    p = forecast(model)
    assert not p.bimodal
    assert abs(p.mean[0] - 0.6) < 0.06


@pytest.mark.parametrize(
    "law",
    [
        lambda rng: np.abs(0.5 + 0.15 * rng.standard_normal(2)),
        lambda rng: rng.uniform(0.1, 0.9, 2),
        lambda rng: rng.gamma(3.0, 0.15, 2),
    ],
    ids=["normal", "even", "gamma"],
)
def test_one_wide_spread_is_rarely_taken_for_two_futures(law: Draw) -> None:
    """At most one operator in 20 of the 100, after 8 to 40 primitives each."""
    found = [forecast(learned(law, seed, 8 + seed % 33)).bimodal for seed in range(100)]
    assert np.mean(found) <= 0.05


def test_few_primitives_are_no_evidence() -> None:
    """Below eight nothing is said; from then on, as soon as both sides were seen thrice."""
    assert not any(forecast(learned(near_or_far(0.5), s, 7)).bimodal for s in range(20))
    early = [forecast(learned(near_or_far(0.5), s, 12)).bimodal for s in range(20)]
    assert np.mean(early) > 0.6


def test_ends_closer_than_half_of_what_is_usual_are_one() -> None:
    moves = np.array([[0.9], [1.1]] * 10) + 0.001 * np.arange(20)[:, None]
    assert two_futures(moves, np.ones(20), np.ones(1)) is None
    apart = two_futures(np.array([[0.5], [1.5]] * 10), np.ones(20), np.ones(1))
    assert apart is not None
    np.testing.assert_allclose(np.sort(apart.ends[:, 0]), [0.5, 1.5])
    np.testing.assert_allclose(apart.shares, 0.5)
    assert two_futures(np.array([[0.5], [1.5]] * 10), np.zeros(20), np.ones(1)) is None
