"""The rhythm of the terminal's bell, listened to for a while at the rate of the screen."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rampe_guard.core.alarm import Level
from rampe_guard.view.bell import Bell

FRAME_S = 0.12


def strokes(
    levels: Callable[[float], list[Level]],
    seconds: float,
    lost: Callable[[float], bool] = lambda _: False,
) -> list[float]:
    """When it rang [s], the situation being a function of time."""
    bell, rang = Bell(), []
    for frame in range(int(seconds / FRAME_S)):
        now_s = frame * FRAME_S
        bell, ring = bell.ring(levels(now_s), 1000.0 + now_s, lost=lost(now_s))
        if ring:
            rang.append(now_s)
    return rang


@pytest.mark.parametrize(
    ("level", "expected"),
    [(Level.IMMINENT, 40), (Level.WARNING, 10), (Level.CAUTION, 0)],
)
def test_each_level_has_its_rhythm(level: Level, expected: int) -> None:
    assert len(strokes(lambda _: [Level.CAUTION, level], 10.0)) == expected


def test_it_rings_at_once_when_something_rises_whatever_rang_before() -> None:
    rang = strokes(lambda s: [Level.IMMINENT] if s >= 0.9 else [Level.WARNING], 2.0)
    assert rang[0] == 0.0
    assert min(s for s in rang if s >= 0.9) < 0.9 + FRAME_S
    assert strokes(lambda s: [Level.WARNING] if s >= 1.3 else [], 3.0)[0] < 1.3 + FRAME_S


def test_it_is_silent_as_soon_as_all_is_seen() -> None:
    assert max(strokes(lambda s: [Level.IMMINENT] if s < 2.0 else [], 9.0)) < 2.0


def test_lost_protection_rings_like_a_warning_and_then_reminds_every_half_minute() -> None:
    rang = strokes(lambda _: [], 125.0, lambda _: True)
    assert len([s for s in rang if s < 30.0]) == 30
    late = [s for s in rang if s >= 30.0]
    assert late == pytest.approx([30.0, 60.0, 90.0, 120.0], abs=2 * FRAME_S)


def test_an_alert_is_not_drowned_by_a_long_loss() -> None:
    rang = strokes(lambda s: [Level.IMMINENT] if s >= 60.0 else [], 62.0, lambda _: True)
    assert len([s for s in rang if s >= 60.0]) == 8
