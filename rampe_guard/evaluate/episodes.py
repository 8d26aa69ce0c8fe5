"""Contacts and alerts as spans of time, and how spans close to one another join."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.core.alarm import Level
from rampe_guard.core.types import FloatArray

SILENCE_S = 0.5
"""Spans parted by no more than this belong to one episode [s]."""


@dataclass(frozen=True, slots=True)
class Contact:
    """The arm inside the keep-out margin of ``zone``, or not provably outside.

    Attributes:
        zone: its name.
        entered_s: when it went in [s].
        left_s: when it was out again [s]; None while it is still in.
        unknown: some part of it is a sweep without an answer, which counts as contact.
    """

    zone: str
    entered_s: float
    left_s: float | None = None
    unknown: bool = False


@dataclass(frozen=True, slots=True)
class AlertSpan:
    """An alert of ``zone`` at one level from ``start_s`` to ``end_s`` [s]; None = still on.

    An alert that changes its level is several spans, one after the other.
    """

    zone: str
    level: Level
    start_s: float
    end_s: float | None = None


def contact_episodes(contacts: Iterable[Contact], zone: str) -> tuple[Contact, ...]:
    """Join the contacts of ``zone``: a re-entry within `SILENCE_S` of leaving is no new one."""
    joined: list[Contact] = []
    for contact in sorted((c for c in contacts if c.zone == zone), key=lambda c: c.entered_s):
        last = joined[-1] if joined else None
        if last is None or contact.entered_s > _or_inf(last.left_s) + SILENCE_S:
            joined.append(contact)
            continue
        left_s = max(_or_inf(last.left_s), _or_inf(contact.left_s))
        joined[-1] = replace(
            last,
            left_s=None if left_s == float("inf") else left_s,
            unknown=last.unknown or contact.unknown,
        )
    return tuple(joined)


def contact_times(contacts: Iterable[Contact]) -> FloatArray:
    """Entry and leaving of each contact (c, 2) [s]; inf while it is still in."""
    times = [(c.entered_s, _or_inf(c.left_s)) for c in contacts]
    return np.array(times, dtype=np.float64).reshape(-1, 2)


def inside_at_first_s(contacts: FloatArray, window: tuple[float, float]) -> float | None:
    """How long the arm was inside a zone from the beginning of a window on [s], None if it was not.

    Such a contact counts nowhere: nobody could have warned of it.

    Args:
        contacts: entry and leaving of each (c, 2) [s], joined and in order.
        window: start and end [s].
    """
    begin_s, end_s = window
    if not len(contacts) or contacts[0, 0] > begin_s:
        return None
    return float(min(contacts[0, 1], end_s)) - begin_s


def alert_episodes(
    spans: Iterable[AlertSpan], zone: str, level: Level
) -> tuple[tuple[float, float], ...]:
    """Join the spans of ``zone`` at ``level`` or above that silence of `SILENCE_S` parts at most.

    Returns:
        (start, end) of each episode in order [s]; the end is inf while it is still on.
    """
    times = sorted(
        (s.start_s, _or_inf(s.end_s)) for s in spans if s.zone == zone and s.level >= level
    )
    joined: list[tuple[float, float]] = []
    for start_s, end_s in times:
        if joined and start_s <= joined[-1][1] + SILENCE_S:
            joined[-1] = (joined[-1][0], max(joined[-1][1], end_s))
        else:
            joined.append((start_s, end_s))
    return tuple(joined)


def spans_from_transitions(
    transitions: Iterable[tuple[float, str, Level]],
) -> tuple[AlertSpan, ...]:
    """Turn published transitions (time [s], zone, level) into spans.

    Repeats of the same level change nothing; ``clear`` ends a span. What is still on at the
    end stays open.

    Args:
        transitions: in order of time.
    """
    spans: list[AlertSpan] = []
    open_spans: dict[str, AlertSpan] = {}
    for time_s, zone, level in transitions:
        now = open_spans.get(zone)
        if now is not None and now.level == level:
            continue
        if now is not None:
            spans.append(replace(open_spans.pop(zone), end_s=time_s))
        if level is not Level.CLEAR:
            open_spans[zone] = AlertSpan(zone, level, time_s)
    return (*spans, *open_spans.values())


def _or_inf(value: float | None) -> float:
    return float("inf") if value is None else value
