import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.forecast import Forecaster, IntentForecast
from rampe_guard.core.primitive import Primitive
from rampe_guard.core.types import FloatArray

ACTUATORS = (
    ActuatorConfig("swing", 0, 1, 0.6, 1.2, 0.2, 0.1, "rad"),
    ActuatorConfig("boom", 1, 1, 0.2, 0.4, 0.1, 0.1, "m"),
)
LIMITS = np.array([[-np.inf, np.inf], [0.0, 1.0]])
Q = np.array([0.3, 0.5])
NONE = np.zeros(2)


def forecaster(tail: float = 0.15) -> Forecaster:
    return Forecaster(ACTUATORS, LIMITS, reaction_s=0.3, tail=tail)


def intent(q: FloatArray, tail: float = 0.15, sign: tuple[int, int] = (1, 0)) -> IntentForecast:
    belief = DisplacementForecast(
        sign, np.array([0.8, 0.0]) * sign, np.array([0.1, 0.01]), np.array([7.0, 7.0]), 5
    )
    command = np.array([0.5, 0.0]) * sign
    return forecaster(tail).intent(q, NONE, command, Primitive(sign, Q, 0.0), belief)


def test_at_rest_with_the_lever_free_the_arm_stays() -> None:
    f = forecaster().stopping(Q, NONE, NONE)
    np.testing.assert_array_equal(f.displacement, [0.0, 0.0])
    assert f.stop_s == 0.0
    assert f.time_at(0.5) == 0.0


def test_let_go_it_coasts_for_the_lag_and_brakes() -> None:
    f = forecaster().stopping(Q, np.array([0.6, 0.0]), NONE)
    np.testing.assert_allclose(f.displacement, [0.6 * 0.2 + 0.36 / 2.4, 0.0])
    assert f.stop_s == pytest.approx(0.2 + 0.5)


def test_a_held_lever_adds_the_reaction_time() -> None:
    f = forecaster().stopping(Q, np.array([0.6, 0.0]), np.array([1.0, 0.0]))
    np.testing.assert_allclose(f.displacement, [0.6 * 0.5 + 0.36 / 2.4, 0.0])


def test_a_pushed_lever_counts_before_the_arm_moves() -> None:
    f = forecaster().stopping(Q, NONE, np.array([-1.0, 0.0]))
    np.testing.assert_allclose(f.displacement, [-0.6 * 0.3 - 0.36 / 2.4, 0.0])


def test_a_reversed_lever_does_not_lengthen_the_way() -> None:
    against = forecaster().stopping(Q, np.array([0.6, 0.0]), np.array([-1.0, 0.0]))
    free = forecaster().stopping(Q, np.array([0.6, 0.0]), NONE)
    np.testing.assert_allclose(against.displacement, free.displacement)


def test_no_forecast_leads_past_a_limit() -> None:
    f = forecaster().stopping(np.array([0.0, 0.99]), np.array([0.0, 0.2]), np.array([0.0, 1.0]))
    assert f.displacement[1] == pytest.approx(0.01)
    beyond = forecaster().stopping(np.array([0.0, 1.02]), np.array([0.0, 0.2]), NONE)
    assert beyond.displacement[1] == 0.0


@given(st.floats(0.05, 0.6), st.floats(0.0, 1.0))
def test_time_to_collision_is_that_of_an_operator_who_goes_on(
    speed: float, fraction: float
) -> None:
    f = forecaster().stopping(Q, np.array([speed, 0.0]), NONE)
    assert f.time_at(fraction) * speed == pytest.approx(fraction * f.displacement[0])


def test_intent_leads_to_the_far_quantile() -> None:
    f = intent(Q)
    law = stats.t(7.0, 0.8, 0.1)
    here = law.sf(0.0)
    np.testing.assert_allclose(f.displacement, [law.isf(0.15 * here), 0.0])
    assert f.probability_at(1.0) == pytest.approx(0.15)
    assert f.probability_at(0.0) == pytest.approx(1.0)


@given(st.floats(0.0, 1.2), st.floats(0.0, 1.0))
def test_probability_is_conditioned_on_progress(progress: float, fraction: float) -> None:
    f = intent(Q + np.array([progress, 0.0]))
    law = stats.t(7.0, 0.8, 0.1)
    d = progress + fraction * f.displacement[0]
    if f.displacement[0] > 0:
        expected = law.sf(d) / law.sf(progress)
        assert f.probability_at(fraction) == pytest.approx(expected, rel=1e-6)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_going_further_is_never_more_likely(a: float, b: float) -> None:
    f = intent(Q, sign=(-1, 0))
    near, far = sorted((a, b))
    assert f.probability_at(near) >= f.probability_at(far)
    assert f.time_at(near) <= f.time_at(far)
    assert f.displacement[0] < 0


def test_time_of_the_way_follows_the_commanded_speed_and_the_lag() -> None:
    f = intent(Q)
    assert f.time_at(1.0) == pytest.approx(f.displacement[0] / 0.3 + 0.2)


def test_beyond_all_experience_nothing_more_is_foreseen() -> None:
    f = intent(Q + np.array([400.0, 0.0]))
    np.testing.assert_array_equal(f.displacement, [0.0, 0.0])
    assert f.probability_at(0.5) == 0.0
