"""What the estimator refuses to be built from, and to be asked."""

import numpy as np
import pytest

from rampe_guard.core.config import PriorConfig, RampeConfig
from rampe_guard.core.rampe import Rampe

INF = float("inf")


@pytest.mark.parametrize(
    "limits",
    [[[1.0, 0.0]], [[0.5, 0.5]], [[np.nan, 1.0]], [[INF, INF]], [[0.0, 1e200]], [[0.0, 1.0, 2.0]]],
)
def test_limits_that_cannot_be(limits: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="limits"):
        Rampe(1, limits=limits)


def test_one_sided_limits_are_no_range_but_a_bound() -> None:
    model = Rampe(1, limits=[[-INF, 1.0]])
    for q in (0.0, 0.1, 0.2):
        assert model.observe((1,), [q], [0.7]) is None
    ahead = model.predict((1,), [0.8])
    assert ahead is not None
    assert ahead.mean[0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"n_init": -1}, "n_init"),
        ({"memory": 0}, "memory"),
        ({"borrow": 1.0}, "borrow"),
        ({"forgetting": 0.0}, "forgetting"),
        ({"prior": PriorConfig(spread=0.0)}, "prior"),
    ],
)
def test_settings_that_cannot_be(settings: dict[str, object], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        RampeConfig(**settings)  # type: ignore[arg-type]


def test_a_setting_of_the_other_mode_is_refused_and_not_ignored() -> None:
    with pytest.raises(ValueError, match="basis: only in mode 'bayesian'"):
        Rampe(1, mode="faithful", basis="affine")
    with pytest.raises(ValueError, match="noise: only in mode 'faithful'"):
        Rampe(1, noise="learned")


@pytest.mark.parametrize("mode", ["bayesian", "faithful"])
def test_a_category_may_be_any_sequence_of_signs(mode: str) -> None:
    model = Rampe(2, mode=mode)  # type: ignore[arg-type]
    model.observe([1, 0], [0.0, 0.0], [0.3, 0.0])  # type: ignore[arg-type]
    model.observe(np.array([1.0, 0.0]), [0.0, 0.0], [0.3, 0.0])  # type: ignore[arg-type]
    assert model.categories == {(1, 0): 2}
    for wrong in ((0, 0), (1,), (2, 0), (1, 0, 0)):
        with pytest.raises(ValueError, match="category"):
            model.observe(wrong, [0.0, 0.0], [0.3, 0.0])


def test_a_forecast_is_not_asked_what_has_no_answer() -> None:
    model = Rampe(1, limits=[[0.0, 1.0]])
    model.observe((1,), [0.1], [0.3])
    forecast = model.predict((1,), [0.1])
    assert forecast is not None
    for p in (-0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match="quantile"):
            forecast.quantile(p)
    for distance in ([np.nan], [0.1, 0.2]):
        with pytest.raises(ValueError, match="distance"):
            forecast.passing(np.array(distance), np.zeros(len(distance)))


def test_an_unknown_spread_is_no_certainty() -> None:
    model = Rampe(1, mode="faithful")
    for k in range(4):
        model.observe((1,), [0.1 * k], [0.1 + 0.2 * k])
    forecast = model.predict((1,), [0.2])
    assert forecast is not None
    assert np.isnan(forecast.passing(np.array([1.0]), np.zeros(1))[0])
    assert np.isnan(forecast.quantile(0.5)[0])


@pytest.mark.parametrize("limits", [None, [[0.0, 1.0], [0.0, 1.0]]])
def test_swapped_columns_are_refused_even_where_strokes_are_short(
    limits: list[list[float]] | None,
) -> None:
    model = Rampe(2, limits=limits)
    rng = np.random.default_rng(0)
    for _ in range(10):
        for category in ((1, 0), (0, 1)):
            x = 0.05 * np.array(category) * (1.0 + 0.1 * rng.standard_normal())
            assert model.observe(category, [0.2, 0.2], x) is None
    before = model.predict((1, 0), [0.2, 0.2])
    for _ in range(20):
        assert model.observe((1, 0), [0.2, 0.2], [0.0005, 0.05]) == "wrong_actuator"
    after = model.predict((1, 0), [0.2, 0.2])
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(before.mean, after.mean)
    assert model.refused == {"wrong_actuator": 20}


def test_against_the_lever_from_the_first_primitive_on() -> None:
    model = Rampe(2)
    for _ in range(5):
        assert model.observe((1, 0), [0.0, 0.0], [-0.3, 0.0]) == "against_lever"
    assert model.predict((1, 0), [0.0, 0.0]) is None
