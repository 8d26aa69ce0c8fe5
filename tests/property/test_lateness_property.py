"""How late is a message, told from stamps alone? Never later than it is, nor much younger."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.sender_clock import LOSS, SenderClock

AHEAD_S = 1.7e9
ROUNDING_S = 1e-6


@st.composite
def journeys(draw: st.DrawFn) -> list[tuple[float, float]]:
    """(sent [s], on the way [s]) of messages that do not overtake one another."""
    gaps = draw(st.lists(st.floats(1e-3, 2.0), min_size=2, max_size=60))
    delays = draw(st.lists(st.floats(0.0, 15.0), min_size=len(gaps), max_size=len(gaps)))
    sent = np.cumsum(gaps)
    arrivals = np.maximum.accumulate(sent + np.array(delays))
    return list(zip(sent.tolist(), (arrivals - sent).tolist(), strict=True))


@given(journeys())
def test_late_by_no_more_than_it_was_and_by_as_much_as_the_promptest_shows(
    journeys: list[tuple[float, float]],
) -> None:
    clock, least_s = SenderClock(), float("inf")
    began_s = sum(journeys[0])
    for sent_s, way_s in journeys:
        stamp_s, arrival_s = AHEAD_S + sent_s, sent_s + way_s
        clock = clock.followed(stamp_s, arrival_s)
        least_s = min(least_s, way_s)
        late_s = arrival_s - clock.measured_s(stamp_s, arrival_s)
        assert -ROUNDING_S <= late_s <= way_s + ROUNDING_S
        assert late_s >= way_s - least_s - LOSS * (arrival_s - began_s) - ROUNDING_S


@given(journeys(), st.floats(0.0, 0.9 * LOSS))
def test_a_clock_that_loses_less_than_allowed_makes_nothing_later(
    journeys: list[tuple[float, float]], loses: float
) -> None:
    clock = SenderClock()
    for sent_s, way_s in journeys:
        stamp_s, arrival_s = AHEAD_S + sent_s * (1.0 - loses), sent_s + way_s
        clock = clock.followed(stamp_s, arrival_s)
        assert arrival_s - clock.measured_s(stamp_s, arrival_s) <= way_s + ROUNDING_S


@given(journeys())
def test_without_delay_nothing_is_late(journeys: list[tuple[float, float]]) -> None:
    clock = SenderClock()
    for (sent_s, _), (next_s, _) in pairwise(journeys):
        clock = clock.followed(AHEAD_S + sent_s, sent_s)
        assert next_s > sent_s
        assert sent_s - clock.measured_s(AHEAD_S + sent_s, sent_s) <= ROUNDING_S
