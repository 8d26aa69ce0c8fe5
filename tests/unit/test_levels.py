import numpy as np
import pytest

from rampe_guard.core.alarm import Level
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.events import Evidence
from rampe_guard.core.forecast import IntentForecast, StoppingForecast
from rampe_guard.core.levels import LevelRules, worst
from rampe_guard.core.types import Certificate, ZoneSweep

RULES = LevelRules(AlertConfig())
STOPPING = StoppingForecast(np.array([1.0]), np.array([1.0]), np.array([0.5]), np.array([1.0]))


def intent(duration: float, mean: float = 1.0) -> IntentForecast:
    belief = DisplacementForecast(
        (1,), np.array([mean]), scale=np.array([0.2]), dof=np.array([9.0]), occurrences=7
    )
    return IntentForecast(np.array([2.0]), np.array([0.0]), belief, None, duration)


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


def judge(
    forecast: IntentForecast | StoppingForecast,
    sweep: ZoneSweep,
    shown: Level = Level.CLEAR,
    stop_s: float = 0.8,
) -> Evidence:
    return RULES.judge(forecast, sweep, shown, stop_s)


def test_a_free_path_is_clear() -> None:
    assert judge(STOPPING, zone()).level is Level.CLEAR
    assert judge(intent(3.0), zone()).level is Level.CLEAR


def test_a_stopping_path_that_touches_is_imminent_and_certain() -> None:
    found = judge(STOPPING, zone(0.5))
    assert (found.level, found.source, found.probability) == (Level.IMMINENT, "stopping", 1.0)
    assert found.time_to_collision_s == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("fraction", "duration", "level"),
    [
        (0.4, 4.0, Level.WARNING),  # likely, 1.6 s ahead
        (0.4, 1.5, Level.IMMINENT),  # likely, 0.6 s ahead: too late to stop
        (0.55, 4.0, Level.CAUTION),  # P about 0.3
        (0.7, 4.0, Level.CLEAR),  # P about 0.04
        (0.4, 20.0, Level.CAUTION),  # likely, but beyond the horizon
    ],
)
def test_intent_levels(fraction: float, duration: float, level: Level) -> None:
    found = judge(intent(duration), zone(fraction))
    assert found.level is level
    assert found.source == "intent"


def test_a_sweep_without_an_answer_is_taken_as_contact() -> None:
    unknown = zone(0.3, certificate=Certificate.UNKNOWN)
    assert judge(STOPPING, unknown).level is Level.IMMINENT
    lost = zone(None, certificate=Certificate.UNKNOWN)
    assert judge(STOPPING, lost).level is Level.IMMINENT


def test_moving_away_is_never_alarmed_even_from_inside() -> None:
    away = zone(0.0, now=-0.1, closing=False)
    assert judge(STOPPING, away).level is Level.CLEAR
    assert judge(intent(1.0), away).level is Level.CLEAR
    inwards = judge(STOPPING, zone(0.0, now=-0.1))
    assert (inwards.level, inwards.source) == (Level.IMMINENT, "contact")


def test_a_shown_level_is_kept_a_little_below_its_threshold() -> None:
    just_below = zone(0.51)  # P about 0.46
    assert judge(intent(4.0), just_below).level is Level.CAUTION
    assert judge(intent(4.0), just_below, Level.WARNING).level is Level.WARNING
    late = intent(2.2)  # 0.88 s for a stop of 0.8 s
    assert judge(late, zone(0.4)).level is Level.WARNING
    assert judge(late, zone(0.4), Level.IMMINENT).level is Level.IMMINENT


def test_grazing_keeps_what_is_shown_but_raises_nothing() -> None:
    grazing = zone(None, clearance=0.01)
    assert judge(STOPPING, grazing).level is Level.CLEAR
    assert judge(STOPPING, grazing, Level.WARNING).level is Level.WARNING
    assert judge(intent(1.0), grazing, Level.IMMINENT).level is Level.WARNING
    assert judge(STOPPING, zone(None, clearance=0.1), Level.WARNING).level is Level.CLEAR


def test_the_worst_evidence_is_the_most_urgent_then_the_soonest() -> None:
    late = Evidence(Level.WARNING, "intent", 0.9, 2.0, None)
    soon = Evidence(Level.WARNING, "intent", 0.6, 1.0, None)
    grave = Evidence(Level.IMMINENT, "stopping", 1.0, 3.0, None)
    never = Evidence(Level.WARNING, "intent", 0.9, None, None)
    assert worst([late, soon, never]) is soon
    assert worst([late, grave, soon]) is grave
