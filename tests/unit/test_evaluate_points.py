"""Figures, intervals and reliability from hand-made outcomes."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.evaluate.episodes import Contact
from rampe_guard.evaluate.foretold import came
from rampe_guard.evaluate.judging import RATES, THRESHOLDS, curve, truth
from rampe_guard.evaluate.odds import odds
from rampe_guard.evaluate.outcome import Outcome, judge
from rampe_guard.evaluate.points import RESAMPLES, Pool, block_of, draws, figures, pool, spread
from rampe_guard.evaluate.trace import Manners, Trace

TEN_MINUTES = (0.0, 600.0)


def outcome(leads: list[float | None], false_at: list[float]) -> Outcome:
    """A contact a minute with an alarm so long before, and false alarms."""
    entries = [60.0 * (k + 1) - 5.0 for k in range(len(leads))]
    contacts = np.array([(t, t + 1.0) for t in entries]).reshape(-1, 2)
    on = [(t - lead, t) for t, lead in zip(entries, leads, strict=True) if lead is not None]
    on += [(t, t + 0.2) for t in false_at]
    return judge(contacts, np.array(sorted(on)).reshape(-1, 2), TEN_MINUTES)


def test_figures_of_two_zones_and_two_logs() -> None:
    one = outcome([2.5, 1.2, 0.6, None], [10.0, 130.0])
    other = outcome([0.3], [])
    found = figures(pool([(one, other), (one, other)]))
    assert found.crossings == 10
    assert found.missed == 2
    assert found.warned == pytest.approx((0.6, 0.4, 0.2, 0.2))
    assert found.median_lead_s == pytest.approx(0.9)
    assert found.lead_5_percent_s == pytest.approx(0.3)
    assert (found.alarms, found.false_alarms, found.undecided) == (12, 4, 0)
    assert found.zone_minutes == pytest.approx(40.0)
    assert found.false_per_min_per_zone == pytest.approx(0.1)
    alarmed = 2 * (2.5 + 1.2 + 0.6 + 0.3 + 2 * 0.2)
    assert found.alarmed_share == pytest.approx(alarmed / (4 * 600.0 - 10.0))


def test_without_contacts_or_time_nothing_is_made_up() -> None:
    found = figures(pool([(outcome([], [5.0]),)]))
    assert found.warned == (None,) * 4
    assert found.median_lead_s is None
    assert found.false_per_min_per_zone == pytest.approx(0.1)
    around = spread(pool([(outcome([], [5.0]),)]))
    assert around.warned == (None,) * 4
    assert around.median_lead_s is None
    nothing = judge(np.zeros((0, 2)), np.zeros((0, 2)), (3.0, 3.0))
    assert figures(pool([(nothing,)])).false_per_min_per_zone is None
    assert figures(pool([(nothing,)])).alarmed_share is None


def test_intervals_hold_the_figure_and_narrow_with_more_logs() -> None:
    leads = [None if k % 3 == 0 else 0.3 * (k % 7) for k in range(1, 10)]
    logs = [(outcome(leads, [7.0, 77.0, 304.0, 305.0]),)]
    widths = []
    for many in (1, 16):
        found, around = figures(pool(logs * many)), spread(pool(logs * many))
        for value, interval in (
            (found.warned[0], around.warned[0]),
            (found.median_lead_s, around.median_lead_s),
            (found.false_per_min_per_zone, around.false_per_min_per_zone),
        ):
            assert value is not None
            assert interval is not None
            assert interval[0] <= value <= interval[1]
        assert around.warned[0] is not None
        widths.append(around.warned[0][1] - around.warned[0][0])
    assert widths[1] == pytest.approx(widths[0] / 4, rel=0.25)  # by the root of the logs


def test_whole_blocks_are_drawn_and_always_the_same() -> None:
    weight = draws(20)
    assert weight.shape == (RESAMPLES, 20)
    assert (weight.sum(axis=1) == 20).all()
    assert (weight == draws(20)).all()
    # all that happens within one block is drawn together: all zones' alarms or none
    together = Pool(np.zeros(0), np.zeros(0, int), np.full(8, 3), np.ones(20), 8, 0, 1.0, 0.0)
    apart = Pool(np.zeros(0), np.zeros(0, int), np.arange(8), np.ones(20), 8, 0, 1.0, 0.0)
    wide, narrow = (spread(p).false_per_min_per_zone for p in (together, apart))
    assert wide is not None
    assert narrow is not None
    assert wide[1] - wide[0] > 2 * (narrow[1] - narrow[0])


def test_blocks_of_a_window_hold_its_ends() -> None:
    assert block_of(np.array([-1.0, 0.0, 29.9, 30.0, 600.0, 700.0]), TEN_MINUTES).tolist() == [
        0, 0, 0, 1, 19, 19,
    ]  # fmt: skip
    assert block_of(np.array([3.0]), (3.0, 3.0)).tolist() == [0]


def test_a_curve_has_intervals_where_rates_are_asked_for() -> None:
    # n alarms in ten minutes, each in its own half minute, for the n of the point
    def said(count: float) -> tuple[list[Trace], float]:
        time_s = np.arange(0.0, 600.0, 0.1)
        score = np.zeros((len(time_s), 1))
        for k in range(int(count)):
            score[30 + 300 * k : 40 + 300 * k] = 0.9
        return [Trace(time_s, ("wall",), score, np.zeros(score.shape, dtype=np.bool_))], 0.5

    log = truth("a log", ("wall",), [Contact("wall", 595.0, 596.0)], TEN_MINUTES)
    found = curve([log], range(20), said, Manners(release=1, off_delay_s=0.5))
    assert [j.figures.false_alarms for j in found] == list(range(20))
    assert [j.strict.false_alarms for j in found if j.strict] == list(range(20))
    # staying on costs time: the last 0.5 s and the evaluation at which it ends
    last = found[-1]
    assert last.strict is not None
    assert last.figures.alarmed_share is not None
    assert last.strict.alarmed_share is not None
    assert last.figures.alarmed_share > 1.4 * last.strict.alarmed_share > 0.0
    chosen = {j.threshold for j in found if j.spread is not None}
    assert chosen == {10.0 * rate for rate in RATES if rate <= 1.9} | {19.0}
    assert len(THRESHOLDS) >= 60
    assert list(THRESHOLDS) == sorted(set(THRESHOLDS))


def test_reliability_of_honest_and_of_boasting_odds() -> None:
    rng = np.random.default_rng(5)
    said = rng.random(20_000)
    happened = rng.random(20_000) < said
    block = np.arange(20_000) // 500
    honest = odds(said, happened, block)
    assert honest.error == pytest.approx(0.0, abs=0.02)
    assert honest.answers == 20_000
    assert [b.count for b in honest.bins] == np.bincount((said * 10).astype(int)).tolist()
    for b in honest.bins:
        assert b.spread is not None
        assert b.spread[0] <= b.happened <= b.spread[1]
        assert b.spread[0] - 0.02 <= b.said <= b.spread[1] + 0.02
    boasting = odds(np.minimum(said + 0.3, 1.0), happened, block)
    assert boasting.error == pytest.approx(np.minimum(0.3, 1.0 - said).mean(), abs=0.02)
    assert odds(np.zeros(0), np.zeros(0, bool), np.zeros(0, int)).error is None


def test_what_came_within_a_horizon() -> None:
    contacts = np.array([(2.0, 3.0), (6.0, 9.5)])
    times = np.array([0.0, 1.0, 1.5, 2.0, 2.5, 3.5, 5.1, 7.0, 9.8])
    it_came, judged = came(times, contacts, 1.0, 10.0)
    assert judged.tolist() == [True, True, True, False, False, True, True, False, False]
    assert it_came[judged].tolist() == [False, True, True, False, True]
    nothing, seen = came(times, np.zeros((0, 2)), 1.0, 10.0)
    assert not nothing.any()
    assert seen.tolist() == [True] * 8 + [False]
