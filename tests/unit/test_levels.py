"""Levels of one zone, from what the sweeps proved and how probable contact is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.alarm import Level
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import Evidence
from rampe_guard.core.forecast import StoppingForecast
from rampe_guard.core.levels import LevelRules, worst
from rampe_guard.core.risk import ZoneRisk
from rampe_guard.core.types import Certificate, ZoneSweep

CONFIG = AlertConfig(imminent_probability=0.25, warning_probability=0.5, caution_probability=0.2)
RULES = LevelRules(CONFIG)
ONE = np.array([1.0])
STOPPING = StoppingForecast(ONE, ONE, 0.5 * ONE, ONE, 0.2 * ONE)


def risk(
    probability: float = 0.5, time_s: float | None = 0.5, *, soon: float = 0.0, floor: bool = False
) -> ZoneRisk:
    same = (probability,) * 3
    return ZoneRisk("wall", same, probability, probability, soon, time_s, "intent", floor)


def zone(
    fraction: float | None = None,
    *,
    certificate: Certificate | None = None,
    clearance: float = 0.5,
    now: float = 0.5,
    closing: bool = True,
) -> ZoneSweep:
    kind = certificate or (Certificate.FREE if fraction is None else Certificate.CONTACT)
    return ZoneSweep("wall", kind, fraction, "bucket", None, clearance, now, closing)


def stopping(
    sweep: ZoneSweep, odds: ZoneRisk | None = None, shown: Level = Level.CLEAR
) -> Evidence:
    return RULES.stopping(STOPPING, sweep, odds or risk(), shown)


def foreseen(
    sweep: ZoneSweep, odds: ZoneRisk, shown: Level = Level.CLEAR, stop_s: float = 0.8
) -> Evidence:
    return RULES.foreseen(sweep, odds, shown, stop_s)


def test_a_free_path_is_clear_whatever_the_odds() -> None:
    assert stopping(zone(), risk(0.9)).level is Level.CLEAR
    assert foreseen(zone(), risk(0.9)).level is Level.CLEAR


def test_a_stopping_path_that_touches_is_imminent_and_tells_its_odds() -> None:
    found = stopping(zone(0.5), risk(0.4))
    assert (found.level, found.source, found.probability) == (Level.IMMINENT, "stopping", 0.4)
    assert found.time_to_collision_s == pytest.approx(0.5)


def test_one_that_the_operator_always_ends_in_time_is_not() -> None:
    known = risk(0.2)
    assert stopping(zone(0.5), known).level is Level.CLEAR
    assert stopping(zone(0.5), known, Level.IMMINENT).level is Level.IMMINENT, "deadband"
    assert stopping(zone(0.5), replace(known, floor=True)).level is Level.IMMINENT
    never = LevelRules(replace(CONFIG, imminent_probability=0.0))
    assert never.stopping(STOPPING, zone(0.5), risk(0.0), Level.CLEAR).level is Level.IMMINENT


@pytest.mark.parametrize(
    ("odds", "level"),
    [
        (risk(0.6, 1.6), Level.WARNING),
        (risk(0.6, 0.6, soon=0.6), Level.IMMINENT),  # too late to stop
        (risk(0.6, 0.6, soon=0.3), Level.WARNING),  # likely, but hardly so soon
        (risk(0.3, 1.6), Level.CAUTION),
        (risk(0.1, 1.6), Level.CLEAR),
        (risk(0.6, 8.0), Level.CAUTION),  # beyond the horizon
    ],
)
def test_levels_of_what_is_foreseen(odds: ZoneRisk, level: Level) -> None:
    found = foreseen(zone(0.4), odds)
    assert found.level is level
    assert (found.source, found.probability) == ("intent", odds.probability)


def test_a_sweep_without_an_answer_is_taken_as_contact() -> None:
    unknown = zone(0.3, certificate=Certificate.UNKNOWN)
    assert stopping(unknown, risk(0.0)).level is Level.IMMINENT
    lost = zone(None, certificate=Certificate.UNKNOWN)
    assert stopping(lost, risk(0.0)).level is Level.IMMINENT


def test_moving_away_is_never_alarmed_even_from_inside() -> None:
    away = zone(0.0, now=-0.1, closing=False)
    assert stopping(away).level is Level.CLEAR
    inwards = stopping(zone(0.0, now=-0.1), risk(0.0))
    assert (inwards.level, inwards.source) == (Level.IMMINENT, "contact")


def test_a_shown_level_is_kept_a_little_below_its_threshold() -> None:
    just_below = risk(0.42, 2.0)
    assert foreseen(zone(0.4), just_below).level is Level.CAUTION
    assert foreseen(zone(0.4), just_below, Level.WARNING).level is Level.WARNING
    late = risk(0.6, 0.9, soon=0.6)  # for a stop of 0.8 s
    assert foreseen(zone(0.4), late).level is Level.WARNING
    assert foreseen(zone(0.4), late, Level.IMMINENT).level is Level.IMMINENT


def test_a_deadband_never_holds_a_level_for_ever() -> None:
    low = LevelRules(replace(CONFIG, caution_probability=0.05))
    assert low.foreseen(zone(0.4), risk(0.04), Level.CAUTION, 0.8).level is Level.CAUTION
    assert low.foreseen(zone(0.4), risk(0.01), Level.CAUTION, 0.8).level is Level.CLEAR


def test_grazing_keeps_what_is_shown_but_raises_nothing() -> None:
    grazing = zone(None, clearance=0.01)
    assert stopping(grazing).level is Level.CLEAR
    assert stopping(grazing, shown=Level.WARNING).level is Level.WARNING
    assert foreseen(grazing, risk(), Level.IMMINENT).level is Level.WARNING
    assert stopping(zone(None, clearance=0.1), shown=Level.WARNING).level is Level.CLEAR


def test_the_worst_evidence_is_the_most_urgent_then_the_soonest() -> None:
    late = Evidence(Level.WARNING, "intent", 0.9, 2.0, None)
    soon = Evidence(Level.WARNING, "intent", 0.6, 1.0, None)
    grave = Evidence(Level.IMMINENT, "stopping", 1.0, 3.0, None)
    never = Evidence(Level.WARNING, "intent", 0.9, None, None)
    assert worst([late, soon, never]) is soon
    assert worst([late, grave, soon]) is grave


def beyond(now: float, *, closing: bool = False) -> ZoneSweep:
    """The actuator stands so far from a limit's edge."""
    return replace(zone(0.0, now=now, clearance=0.0, closing=closing), link=None, margin_m=None)


def test_who_stands_past_a_limit_is_not_clear_of_it() -> None:
    at_rest = StoppingForecast(0.0 * ONE, 0.0 * ONE, 0.0 * ONE, ONE, 0.2 * ONE)
    for shown in (Level.CLEAR, Level.IMMINENT):
        found = RULES.stopping(at_rest, beyond(-0.15), risk(0.0), shown)
        assert found.level is Level.CAUTION
    assert RULES.stopping(at_rest, beyond(0.0), risk(0.0), Level.CLEAR).level is Level.CLEAR


def test_who_leaves_a_limit_keeps_its_alert_and_is_not_alarmed_anew() -> None:
    assert stopping(beyond(-0.15), shown=Level.IMMINENT).level is Level.CAUTION
    assert stopping(beyond(-0.15)).level is Level.CLEAR
    assert stopping(beyond(-0.15, closing=True)).level is Level.IMMINENT
