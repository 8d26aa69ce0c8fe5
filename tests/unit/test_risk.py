"""One probability from three forecasts."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.core.foresight import NOTHING, Meeting, Outlook
from rampe_guard.core.risk import HORIZONS_S, RiskBook, Threat, ZoneRisk
from rampe_guard.core.scenario import Scenario
from rampe_guard.core.types import Certificate, ZoneSweep

SWEEP = ZoneSweep("wall", Certificate.CONTACT, 0.5, "bucket", None, 0.0, 0.4, closing=True)
HORIZON_S = 2.5


def outlook(*met: tuple[float, float], weight: float = 4.0) -> Outlook:
    """Scenarios that meet the wall: time [s] and weight of each."""
    meetings = tuple(Meeting(t, w, 1, 0.5, SWEEP, np.ones(1)) for t, w in met)
    way = Scenario(weight, 4, np.array([0.0, 2.5]), np.zeros((2, 1)))
    return Outlook(weight, 4, (way,), {"wall": meetings} if meetings else {}, 10.0)


def weigh(threat: Threat, seen: Outlook = NOTHING, stamp_s: float = 10.0) -> ZoneRisk:
    book = RiskBook(HORIZON_S)
    book.begin(stamp_s)
    return book.weigh("wall", threat, seen, 0.7, stamp_s)


def test_without_memory_the_present_motion_speaks_alone() -> None:
    risk = weigh(Threat(intent=0.6, intent_s=1.5))
    assert list(risk.within) == pytest.approx([0.0, 0.0, 0.6])
    assert risk.probability == pytest.approx(0.6)
    assert (risk.source, risk.time_s) == ("intent", 1.5)
    assert weigh(Threat(stop_s=0.4)).probability == pytest.approx(0.5)
    assert weigh(Threat(stop_s=0.1, too_late=True)).probability == pytest.approx(0.8)
    assert weigh(Threat()).time_s is None


def test_memory_counts_against_it_and_for_it() -> None:
    braking = Threat(stop_s=0.4)
    assert weigh(braking, outlook()).probability == pytest.approx(2.0 / 8.0)
    assert weigh(braking, outlook((0.5, 4.0))).probability == pytest.approx(6.0 / 8.0)
    ahead = weigh(Threat(), outlook((1.8, 3.0)))
    assert list(ahead.within) == pytest.approx([0.0, 0.0, 3.0 / 8.0])
    assert ahead.source == "next"
    assert ahead.time_s == pytest.approx(1.8)


def test_what_was_foreseen_comes_nearer() -> None:
    seen = outlook((1.2, 4.0))
    assert weigh(Threat(), seen).within[1] == 0.0
    later = weigh(Threat(), seen, stamp_s=10.3)
    assert later.within[1] == pytest.approx(4.0 / 8.0)
    assert later.time_s == pytest.approx(0.9)


def test_a_contact_beyond_what_memory_sees_is_not_lost() -> None:
    far = weigh(Threat(intent=0.7, intent_s=4.0), outlook())
    assert far.probability == pytest.approx(0.7)
    assert far.within[-1] == 0.0


def test_it_is_smoothed_and_what_decides_about_stopping_is_not() -> None:
    book = RiskBook(HORIZON_S)
    book.begin(10.0)
    book.weigh("wall", Threat(), NOTHING, 0.7, 10.0)
    book.begin(10.1)
    risk = book.weigh("wall", Threat(stop_s=0.3), NOTHING, 0.7, 10.1)
    assert risk.instant == pytest.approx(0.5)
    assert risk.probability == pytest.approx(0.5 * (1.0 - np.exp(-0.1 / 0.4)))
    book.forget()
    book.begin(10.2)
    assert book.weigh("wall", Threat(stop_s=0.3), NOTHING, 0.7, 10.2).probability == 0.5


def test_probabilities_grow_with_the_horizon() -> None:
    rng = np.random.default_rng(7)
    for _ in range(300):
        seen = outlook(*rng.uniform(0.0, [2.5, 1.0], (4, 2)).tolist())
        stop_s, intent_s = rng.uniform(0.0, [2.0, 3.0])
        threat = Threat(stop_s, intent=rng.uniform(), intent_s=intent_s)
        risk = weigh(threat, seen)
        assert len(risk.within) == len(HORIZONS_S)
        ladder = [0.0, *risk.within, risk.probability, 1.0]
        assert ladder == sorted(ladder)
