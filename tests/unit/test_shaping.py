import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.shaping import ShapingLaw, legs

positive = st.floats(0.05, 5.0)
law = st.builds(
    lambda top, a, lag, hold: ShapingLaw(
        (ActuatorConfig("swing", 0, 1, top, a, lag, 0.1, "rad"),), hold
    ),
    positive,
    positive,
    st.floats(0.0, 0.5),
    st.floats(0.1, 1.0),
)
along = st.floats(-3.0, 3.0)


@given(law, along, st.floats(0.0, 10.0))
def test_a_share_keeps_within_its_room_and_no_larger_one_does(
    law: ShapingLaw, along: float, room: float
) -> None:
    share = law.share(0, along, room)
    assert 0.0 <= share <= 1.0
    least = law.reach(0, along, 0.0)
    if room >= least:
        assert law.reach(0, along, share) <= room + 1e-9
    else:
        assert share == 0.0
    if share < 0.999:
        assert law.reach(0, along, share + 1e-3) > min(room, least)


@given(law, along, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_command_goes_further_and_lasts_longer(
    law: ShapingLaw, along: float, one: float, other: float
) -> None:
    small, large = sorted((one, other))
    assert law.reach(0, along, small) <= law.reach(0, along, large)
    assert law.lasts_s(0, along, small) <= law.lasts_s(0, along, large)


@given(law, st.floats(0.0, 3.0))
def test_nothing_commanded_goes_as_far_as_it_coasts(law: ShapingLaw, along: float) -> None:
    way, _ = law.coast(np.array([along]))
    assert law.reach(0, along, 0.0) == pytest.approx(way[0])


vectors = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)
times = st.lists(st.floats(0.01, 3.0), min_size=3, max_size=3).map(np.array)


@given(vectors, times)
def test_legs_add_up_and_never_turn_back(way: np.ndarray, lasts_s: np.ndarray) -> None:
    found = list(legs(way, lasts_s))
    assert len(found) <= 3
    if not way.any():
        assert not found
        return
    assert np.allclose(np.sum(found, axis=0), way, rtol=0.0, atol=1e-12)
    for leg in found:
        assert (leg * np.sign(way) >= -1e-12).all()


def test_a_leg_ends_where_an_actuator_comes_to_rest() -> None:
    first, second = legs(np.array([1.0, 0.4]), np.array([1.0, 0.5]))
    assert np.allclose(first, [0.5, 0.4])
    assert np.allclose(second, [0.5, 0.0])
