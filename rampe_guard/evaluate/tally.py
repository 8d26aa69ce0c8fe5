"""Keeps the score while it happens: true motion to the referee, alerts to spans."""

from __future__ import annotations

from rampe_guard.core.alarm import Level
from rampe_guard.core.types import FloatArray, PathSweeper
from rampe_guard.evaluate.blindness import Blindness, blind_s
from rampe_guard.evaluate.episodes import (
    contact_episodes,
    contact_times,
    inside_at_first_s,
    spans_from_transitions,
)
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
        self._blindness = Blindness()
        self._first_s: float | None = None
        self._last_s = 0.0

    @property
    def duration_s(self) -> float:
        """Time watched [s]."""
        return 0.0 if self._first_s is None else self._last_s - self._first_s

    @property
    def blind_s(self) -> float:
        """How much of that the guard did not monitor [s]."""
        return blind_s(self._blindness.spans, self._window)

    @property
    def inside_at_first_s(self) -> dict[str, float]:
        """Zones that the arm was in from the first position on, and for how long [s]."""
        found = {}
        for zone in self._zones:
            contacts = contact_times(contact_episodes(self._referee.contacts, zone))
            inside_s = inside_at_first_s(contacts, self._window)
            if inside_s is not None:
                found[zone] = inside_s
        return found

    def position(self, time_s: float, q: FloatArray) -> tuple[ContactEvent, ...]:
        """Take where the arm truly was; returns entries and exits that this shows."""
        if self._first_s is None:
            self._first_s = time_s
        self._last_s = time_s
        return self._referee.feed(time_s, q)

    def alert(self, time_s: float, zone: str, level: Level) -> None:
        """Take a published alert transition, on the same clock."""
        self._transitions.append((time_s, zone, level))

    def status(self, time_s: float, *, monitoring: bool) -> None:
        """Take whether the guard said that it monitors, on the same clock, in order of time."""
        self._blindness.take(time_s, monitoring=monitoring)

    def scores(self, level: Level) -> dict[str, LevelScore]:
        """Score of every zone for alerts at ``level`` or above."""
        spans = spans_from_transitions(sorted(self._transitions, key=lambda t: t[0]))
        found, blind = self._referee.contacts, self._blindness.spans
        return score(found, spans, self._zones, level, self._window, blind)

    @property
    def _window(self) -> tuple[float, float]:
        return (self._last_s if self._first_s is None else self._first_s, self._last_s)
