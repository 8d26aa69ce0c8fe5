"""Alarms of a trace, and what became of them, against slow and plain forms of the same rules."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.alarm import Alarm, Level
from rampe_guard.core.config import AlertConfig
from rampe_guard.evaluate.episodes import SILENCE_S
from rampe_guard.evaluate.outcome import FALSE, TRUE, UNDECIDED, judge
from rampe_guard.evaluate.trace import Manners, Trace, alarms, lowered, manners

PERIOD_S = 0.1


def trace(scores: Sequence[float], floors: Sequence[bool] | None = None) -> Trace:
    k = len(scores)
    floor = (
        np.zeros((k, 1), dtype=np.bool_)
        if floors is None
        else np.array(floors, dtype=np.bool_).reshape(k, 1)
    )
    return Trace(
        np.arange(k, dtype=np.float64) * PERIOD_S, ("wall",), np.array(scores).reshape(k, 1), floor
    )


def slowly(said: Trace, threshold: float, how: Manners) -> list[tuple[float, float]]:
    """The strict form, one evaluation after the other, as the docstring says it."""
    found: list[tuple[float, float]] = []
    start: float | None = None
    last = -np.inf
    in_a_row = floor_in_a_row = 0
    for time_s, score, floor in zip(
        said.time_s.tolist(), said.score[:, 0].tolist(), said.floor[:, 0].tolist(), strict=True
    ):
        cause = floor or score >= threshold
        in_a_row = in_a_row + 1 if cause else 0
        floor_in_a_row = floor_in_a_row + 1 if floor else 0
        if cause:
            if time_s - last > SILENCE_S:
                if start is not None:
                    found.append((start, last))
                start = None
            last = time_s
            if start is None and (in_a_row >= how.debounce or floor_in_a_row >= how.imminent):
                start = time_s
    if start is not None:
        found.append((start, last))
    return found


@given(
    st.lists(st.tuples(st.sampled_from([0.0, 0.3, 0.7, 1.0]), st.booleans()), max_size=60),
    st.sampled_from([0.2, 0.5, 0.9]),
    st.integers(1, 4),
    st.integers(1, 3),
)
def test_strict_alarms_are_those_of_one_evaluation_after_the_other(
    said: list[tuple[float, bool]], threshold: float, debounce: int, imminent: int
) -> None:
    # a floor at every third at most, or it would hide the scores
    floors = [floor and k % 3 == 0 for k, (_, floor) in enumerate(said)]
    heard = trace([score for score, _ in said], floors)
    how = Manners(debounce, imminent, 5, 0.5, 1.0, 0.1, strict=True)
    assert alarms(heard, 0, threshold, how).tolist() == [
        list(span) for span in slowly(heard, threshold, how)
    ]


def lived(said: Trace, threshold: float, config: AlertConfig) -> list[tuple[float, float]]:
    """The guard's own alarm, stepped with what each evaluation says."""
    alarm = Alarm(config)
    found: list[tuple[float, float]] = []
    for time_s, score, floor in zip(
        said.time_s.tolist(), said.score[:, 0].tolist(), said.floor[:, 0].tolist(), strict=True
    ):
        was = alarm.level
        least = lowered(threshold, config.deadband_probability) if was else threshold
        alarm.step(Level.WARNING if floor or score >= least else Level.CLEAR, time_s)
        if alarm.level and not was:
            joined = found and time_s <= found[-1][1] + SILENCE_S
            found.append((found.pop()[0] if joined else time_s, np.inf))
        elif was and not alarm.level:
            found[-1] = (found[-1][0], time_s)
    return found


@given(
    st.lists(st.sampled_from([0.0, 0.0, 0.15, 0.22, 0.3, 0.7]), max_size=90),
    st.lists(st.sampled_from([0.04, 0.1, 0.1, 0.7]), min_size=90, max_size=90),
    st.sampled_from([0.2, 0.3, 0.5]),
    st.integers(1, 3),
    st.integers(1, 6),
    st.sampled_from([(0.0, 0.0), (0.5, 1.0), (0.3, 0.0), (0.0, 2.0)]),
)
def test_alarms_live_as_the_guards_published_alerts_do(
    scores: list[float],
    gaps: list[float],
    threshold: float,
    debounce: int,
    release: int,
    delays: tuple[float, float],
) -> None:
    config = AlertConfig(
        debounce_steps=debounce, release_steps=release, off_delay_s=delays[0], min_on_s=delays[1]
    )
    k = len(scores)
    heard = Trace(
        np.cumsum(gaps[:k]),
        ("wall",),
        np.array(scores).reshape(k, 1),
        np.zeros((k, 1), dtype=np.bool_),
    )
    assert alarms(heard, 0, threshold, manners(config)).tolist() == [
        list(span) for span in lived(heard, threshold, config)
    ]


def test_a_floor_alarms_at_once_and_holds_as_long_as_any_cause() -> None:
    heard = trace([0.0] * 40, [k in {3, 8} for k in range(40)])
    how = manners(AlertConfig())
    assert how.debounce > how.imminent == 1
    assert alarms(heard, 0, 0.5, how).tolist() == [[pytest.approx(0.3), pytest.approx(1.3)]]
    assert not len(alarms(trace([0.0, 0.9, 0.0, 0.9] * 9), 0, 0.5, how))  # never twice in a row


def test_a_lower_threshold_never_shortens_what_is_alarmed() -> None:
    heard = trace(np.random.default_rng(1).random(400).tolist())
    total = []
    for threshold in (0.1, 0.5, 0.9):
        spans = alarms(heard, 0, threshold, Manners())
        total.append(float((spans[:, 1] - spans[:, 0]).sum()))
    assert total == sorted(total, reverse=True)
    assert total[0] > total[-1]


def test_manners_are_those_of_the_sites_alerts() -> None:
    alerts = AlertConfig(
        debounce_steps=3, imminent_steps=2, release_steps=4, off_delay_s=0.6, min_on_s=0.9
    )
    assert manners(alerts) == Manners(3, 2, 4, 0.6, 0.9, alerts.deadband_probability)


@pytest.mark.parametrize("score", [-0.1, 1.1, float("nan")])
def test_a_score_that_is_no_share_is_refused(score: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        trace([0.2, score])


def test_time_that_does_not_advance_and_wrong_shapes_are_refused() -> None:
    none = np.zeros((2, 1), dtype=np.bool_)
    with pytest.raises(ValueError, match="order of time"):
        Trace(np.array([1.0, 1.0]), ("wall",), np.zeros((2, 1)), none)
    with pytest.raises(ValueError, match="evaluations of 2 zones"):
        Trace(np.array([1.0, 2.0]), ("wall", "roof"), np.zeros((2, 1)), none)
    with pytest.raises(ValueError, match="horizons"):
        Trace(np.array([1.0, 2.0]), ("wall",), np.zeros((2, 1)), none, (1.0,))


TENTHS = st.integers(0, 300).map(lambda k: k / 10)


def spans(times: list[float], gap: float) -> list[tuple[float, float]]:
    """Pairs of times as spans that are further apart than ``gap``."""
    found: list[tuple[float, float]] = []
    ordered = sorted(set(times))
    for start, end in zip(ordered[::2], ordered[1::2], strict=False):
        if not found or start > found[-1][1] + gap:
            found.append((start, end))
    return found


@given(st.lists(TENTHS, max_size=14), st.lists(TENTHS, max_size=14), st.booleans())
def test_outcomes_are_those_of_one_pair_after_the_other(
    contact_times: list[float], alarm_times: list[float], still_on: bool
) -> None:
    window = (0.0, 30.0)
    contacts = spans(contact_times, SILENCE_S)
    on = spans(alarm_times, SILENCE_S)
    if still_on and on:
        on[-1] = (on[-1][0], np.inf)
    found = judge(np.array(contacts).reshape(-1, 2), np.array(on).reshape(-1, 2), window)

    leads = []
    for index, (entered, _) in enumerate(contacts):
        if entered <= window[0]:
            continue
        warned = [a for a in on if a[0] < entered <= a[1] + SILENCE_S]
        before = contacts[index - 1][1] if index else -np.inf
        leads.append(entered - max(warned[0][0], before) if warned else None)
    told = [None if np.isnan(lead) else lead for lead in found.lead_s.tolist()]
    assert told == leads
    verdicts = []
    for start, end in on:
        met = any(c[0] <= end + SILENCE_S and c[1] >= start for c in contacts)
        late = end + SILENCE_S > window[1]
        verdicts.append(TRUE if met else UNDECIDED if late else FALSE)
    assert found.verdict.tolist() == verdicts

    tick = np.arange(0.0005, 30.0, 0.001)
    inside = np.zeros(len(tick), dtype=np.bool_)
    alarmed = np.zeros(len(tick), dtype=np.bool_)
    for start, end in contacts:
        inside |= (tick >= start) & (tick < end)
    for start, end in on:
        alarmed |= (tick >= start) & (tick < end)
    assert found.outside_s == pytest.approx((~inside).sum() * 0.001, abs=0.01)
    assert found.alarmed_s == pytest.approx((alarmed & ~inside).sum() * 0.001, abs=0.01)
