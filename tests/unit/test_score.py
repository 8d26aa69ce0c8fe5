"""Scoring on hand-made timelines, and its laws on random ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.alarm import Level
from rampe_guard.evaluate.episodes import (
    AlertSpan,
    Contact,
    alert_episodes,
    contact_episodes,
    spans_from_transitions,
)
from rampe_guard.evaluate.score import LevelScore, score, score_zone, total

MINUTE = (0.0, 60.0)


def scored(
    contacts: Sequence[tuple[float, float | None]],
    alerts: Sequence[tuple[Level, float, float | None]],
    level: Level = Level.WARNING,
    window: tuple[float, float] = MINUTE,
) -> LevelScore:
    return score_zone(
        [Contact("wall", a, b) for a, b in contacts],
        [AlertSpan("wall", lv, a, b) for lv, a, b in alerts],
        "wall",
        level,
        window,
    )


def test_an_alert_on_at_the_entry_warns_from_its_start() -> None:
    result = scored([(10.0, 11.0)], [(Level.WARNING, 9.2, 12.0)])
    assert (result.contacts, result.warned, result.missed) == (1, 1, 0)
    assert result.leads_s == pytest.approx((0.8,))
    assert result.false_alarms == 0


@pytest.mark.parametrize(("ended", "warned"), [(9.5, 1), (9.49, 0)])
def test_an_alert_may_end_half_a_second_before_the_entry(ended: float, warned: int) -> None:
    result = scored([(10.0, 11.0)], [(Level.WARNING, 8.0, ended)])
    assert result.warned == warned
    assert result.false_alarms == 1 - warned


def test_an_alert_raised_at_the_entry_or_after_it_is_no_warning_but_not_false() -> None:
    for start in (10.0, 10.3):
        result = scored([(10.0, 11.0)], [(Level.WARNING, start, 12.0)])
        assert (result.missed, result.false_alarms) == (1, 0)


def test_an_alert_that_begins_after_the_arm_has_left_is_false() -> None:
    assert scored([(10.0, 11.0)], [(Level.WARNING, 11.01, 12.0)]).false_alarms == 1


def test_short_silence_joins_alerts_and_long_silence_parts_them() -> None:
    joined = scored([(10.0, 11.0)], [(Level.WARNING, 8.0, 9.0), (Level.WARNING, 9.5, 10.5)])
    assert joined.leads_s == pytest.approx((2.0,))
    parted = scored([(10.0, 11.0)], [(Level.WARNING, 8.0, 8.9), (Level.WARNING, 9.5, 10.5)])
    assert parted.leads_s == pytest.approx((0.5,))
    assert (parted.alarms, parted.false_alarms) == (2, 1)


def test_a_quick_reentry_is_the_same_contact() -> None:
    assert scored([(10.0, 10.2), (10.6, 10.8)], []).contacts == 1
    assert scored([(10.0, 10.2), (10.8, 10.9)], []).contacts == 2


def test_one_long_alarm_earns_no_credit_twice() -> None:
    result = scored([(10.0, 11.0), (13.0, 14.0)], [(Level.WARNING, 9.0, 15.0)])
    assert result.leads_s == pytest.approx((1.0, 2.0))


def test_levels_below_the_asked_one_do_not_count() -> None:
    alerts = [(Level.WARNING, 9.0, 9.7), (Level.IMMINENT, 9.7, 11.0)]
    assert scored([(10.0, 11.0)], alerts, Level.WARNING).leads_s == pytest.approx((1.0,))
    assert scored([(10.0, 11.0)], alerts, Level.IMMINENT).leads_s == pytest.approx((0.3,))
    cautions = [(Level.CAUTION, 9.0, 11.0)]
    assert scored([(10.0, 11.0)], cautions, Level.WARNING).missed == 1


def test_a_contact_from_before_the_window_is_not_counted_but_excuses_its_alarm() -> None:
    result = scored([(0.0, 5.0)], [(Level.IMMINENT, 1.0, 6.0)])
    assert (result.contacts, result.false_alarms) == (0, 0)


def test_an_alarm_still_on_at_the_end_is_undecided() -> None:
    result = scored([], [(Level.WARNING, 58.0, None)])
    assert (result.alarms, result.false_alarms, result.undecided) == (1, 0, 1)


def test_another_zone_changes_nothing() -> None:
    contacts = [Contact("wall", 10.0, 11.0)]
    spans = [AlertSpan("line", Level.WARNING, 9.0, 12.0)]
    by_zone = score(contacts, spans, ["wall", "line"], Level.WARNING, MINUTE)
    assert by_zone["wall"].missed == 1
    assert by_zone["line"].false_alarms == 1


def test_rates_and_shares() -> None:
    result = scored(
        [(10.0, 11.0), (20.0, 21.0), (30.0, 31.0)],
        [(Level.WARNING, 9.6, 12.0), (Level.WARNING, 18.0, 22.0), (Level.WARNING, 50.0, 51.0)],
    )
    assert result.median_lead_s == pytest.approx(1.2)
    assert result.share_at_least(0.3) == pytest.approx(2 / 3)
    assert result.share_at_least(1.0) == pytest.approx(1 / 3)
    assert result.false_per_minute == pytest.approx(1.0)
    both = total([result, scored([], [])])
    assert both.false_per_minute == pytest.approx(0.5)
    assert both.contacts == 3


def test_nothing_seen_is_none_and_not_perfect() -> None:
    empty = scored([], [], window=(0.0, 0.0))
    assert empty.share_at_least(0.3) is None
    assert empty.median_lead_s is None
    assert empty.false_per_minute is None


def test_wrong_calls_are_refused() -> None:
    with pytest.raises(ValueError, match="before it starts"):
        scored([], [], window=(1.0, 0.0))
    with pytest.raises(ValueError, match="one level"):
        total([scored([], []), scored([], [], Level.IMMINENT)])
    with pytest.raises(ValueError, match="one level"):
        total([])


def test_transitions_become_spans() -> None:
    spans = spans_from_transitions(
        [
            (1.0, "wall", Level.WARNING),
            (1.2, "wall", Level.WARNING),
            (1.5, "line", Level.CAUTION),
            (2.0, "wall", Level.IMMINENT),
            (3.0, "wall", Level.CLEAR),
        ]
    )
    assert set(spans) == {
        AlertSpan("wall", Level.WARNING, 1.0, 2.0),
        AlertSpan("wall", Level.IMMINENT, 2.0, 3.0),
        AlertSpan("line", Level.CAUTION, 1.5, None),
    }


# Times on a grid of 1/8 s, exact in binary, so that laws hold without rounding slack.
grid = st.integers(1, 400).map(lambda i: i / 8)
intervals = st.lists(st.tuples(grid, grid).map(lambda ab: (min(ab), max(ab))), max_size=8)
levelled = st.lists(
    st.tuples(st.sampled_from([Level.CAUTION, Level.WARNING, Level.IMMINENT]), grid, grid).map(
        lambda lab: (lab[0], min(lab[1:]), max(lab[1:]))
    ),
    max_size=8,
)


def brute(
    contacts: list[tuple[float, float]], alerts: list[tuple[Level, float, float]], level: Level
) -> tuple[int, int, int]:
    """Contacts, warned, false alarms by painting time on a grid of 1/8 s: an independent way."""
    cells = range(8 * 52)
    inside = [any(a <= i / 8 <= b for a, b in contacts) for i in cells]
    alarm = [any(lv >= level and a <= i / 8 <= b for lv, a, b in alerts) for i in cells]
    inside, alarm = closed(inside), closed(alarm)
    entries = [i for i in cells if inside[i] and not inside[i - 1]]
    starts = [i for i in cells if alarm[i] and not alarm[i - 1]]
    warned = 0
    for i in entries:
        before = [j for j in range(i - 4, i) if j >= 0 and alarm[j]]
        warned += bool(before)
    false = 0
    for start in starts:
        end = start
        while alarm[end + 1]:
            end += 1
        false += not any(inside[start : end + 5])
    return len(entries), warned, false


def closed(mask: list[bool]) -> list[bool]:
    """Fill gaps of up to 0.5 s (three empty cells between two painted ones)."""
    out = list(mask)
    last: int | None = None
    for i, on in enumerate(mask):
        if on:
            if last is not None and i - last <= 4:
                out[last:i] = [True] * (i - last)
            last = i
    return out


@given(intervals, levelled, st.sampled_from([Level.WARNING, Level.IMMINENT]))
def test_agrees_with_painting_time_on_a_grid(
    contacts: list[tuple[float, float]], alerts: list[tuple[Level, float, float]], level: Level
) -> None:
    result = scored(contacts, alerts, level)
    assert (result.contacts, result.warned, result.false_alarms) == brute(contacts, alerts, level)
    assert all(lead > 0.0 for lead in result.leads_s)


@given(intervals, levelled)
def test_a_higher_level_never_warns_of_more(
    contacts: list[tuple[float, float]], alerts: list[tuple[Level, float, float]]
) -> None:
    warning = scored(contacts, alerts, Level.WARNING)
    imminent = scored(contacts, alerts, Level.IMMINENT)
    assert imminent.warned <= warning.warned
    assert imminent.contacts == warning.contacts
    assert warning.share_at_least(0.5) is None or (warning.share_at_least(1.0) or 0.0) <= (
        warning.share_at_least(0.5) or 0.0
    )


@given(intervals, levelled)
def test_shifting_all_times_changes_no_count(
    contacts: list[tuple[float, float]], alerts: list[tuple[Level, float, float]]
) -> None:
    here = scored(contacts, alerts)
    there = scored(
        [(a + 256, b + 256) for a, b in contacts],
        [(lv, a + 256, b + 256) for lv, a, b in alerts],
        window=(256.0, 316.0),
    )
    assert here == there


@given(intervals)
def test_episodes_are_apart_and_cover_what_they_join(spans: list[tuple[float, float]]) -> None:
    alerts = [AlertSpan("wall", Level.WARNING, a, b) for a, b in spans]
    episodes = alert_episodes(alerts, "wall", Level.WARNING)
    assert all(b0 + 0.5 < a1 for (_, b0), (a1, _) in pairwise(episodes))
    assert all(any(a >= e0 and b <= e1 for e0, e1 in episodes) for a, b in spans)
    contacts = contact_episodes([Contact("wall", a, b) for a, b in spans], "wall")
    assert [(c.entered_s, c.left_s) for c in contacts] == list(episodes)
