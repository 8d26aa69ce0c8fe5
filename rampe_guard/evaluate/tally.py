"""Keeps the score while it happens: true motion to the referee, alerts to spans."""

from __future__ import annotations

from rampe_guard.core.alarm import Level
from rampe_guard.core.types import FloatArray, PathSweeper
from rampe_guard.evaluate.episodes import spans_from_transitions
from rampe_guard.evaluate.referee import ContactEvent, Referee
from rampe_guard.evaluate.score import LevelScore, score


class Tally:
    """Scores one machine over one stretch of work.

    Args:
        sweeper: decides what is a contact.
        zones: names of all zones.
    """

    def __init__(self, sweeper: PathSweeper, zones: tuple[str, ...]) -> None:
        self._referee = Referee(sweeper)
        self._zones = zones
        self._transitions: list[tuple[float, str, Level]] = []
        self._first_s: float | None = None
        self._last_s = 0.0

    @property
    def duration_s(self) -> float:
        """Time watched [s]."""
        return 0.0 if self._first_s is None else self._last_s - self._first_s

    def position(self, time_s: float, q: FloatArray) -> tuple[ContactEvent, ...]:
        """Take where the arm truly was; returns entries and exits that this shows."""
        if self._first_s is None:
            self._first_s = time_s
        self._last_s = time_s
        return self._referee.feed(time_s, q)

    def alert(self, time_s: float, zone: str, level: Level) -> None:
        """Take a published alert transition, on the same clock."""
        self._transitions.append((time_s, zone, level))

    def scores(self, level: Level) -> dict[str, LevelScore]:
        """Score of every zone for alerts at ``level`` or above."""
        window = (self._last_s if self._first_s is None else self._first_s, self._last_s)
        spans = spans_from_transitions(sorted(self._transitions, key=lambda t: t[0]))
        return score(self._referee.contacts, spans, self._zones, level, window)
