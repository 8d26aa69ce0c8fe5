"""What became of the contacts and alarms of one zone, as arrays: the rules of `score`, at speed.

A curve asks for hundreds of scores of the same log, so the rules work on sorted arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.blindness import NEVER, blind_s, hidden, seen, since, together
from rampe_guard.evaluate.episodes import SILENCE_S

TRUE: Final = 0
FALSE: Final = 1
UNDECIDED: Final = 2
"""What an alarm was: there was a contact, there was none, or the end of the window hides it."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One zone over one window: c contacts that count, a alarms that touch the window.

    Attributes:
        entered_s: when each contact that came while the guard monitored began (c,) [s].
        lead_s: lead time of each (c,) [s], nan where it was missed.
        unmonitored: contacts that came while it did not; neither warned of nor missed.
        alarms: start and end of each alarm (a, 2) [s]; inf while it is still on.
        verdict: `TRUE`, `FALSE` or `UNDECIDED` (a,).
        window: start and end of what was watched [s].
        blind: spans in which the guard did not monitor (b, 2) [s].
        outside_s: monitored time of the window that the arm was not in the zone [s].
        alarmed_s: how much of that an alarm was on [s].
    """

    entered_s: FloatArray
    lead_s: FloatArray
    unmonitored: int
    alarms: FloatArray
    verdict: npt.NDArray[np.int8]
    window: tuple[float, float]
    blind: FloatArray
    outside_s: float
    alarmed_s: float


def judge(
    contacts: FloatArray,
    alarms: FloatArray,
    window: tuple[float, float],
    blind: FloatArray = NEVER,
) -> Outcome:
    """Hold alarms against contacts by the rules of `score`.

    Args:
        contacts: entry and leaving of each (c, 2) [s], inf while still in; joined and in order.
        alarms: start and end of each (a, 2) [s], inf while still on; joined and in order.
        window: start and end [s].
        blind: spans in which the guard did not monitor (b, 2) [s].
    """
    begin_s, end_s = window
    contacts, alarms = contacts.reshape(-1, 2), alarms.reshape(-1, 2)
    alarms = alarms[(alarms[:, 0] <= end_s) & (alarms[:, 1] >= begin_s)]
    counted = (contacts[:, 0] > begin_s) & (contacts[:, 0] <= end_s)
    told = counted & ~hidden(contacts[:, 0], blind)
    live = seen(alarms, blind)
    # time of the window inside each contact, or blind, and all before it
    edges = np.clip(together(contacts, blind), begin_s, end_s)
    inside = np.cumsum(edges[:, 1] - edges[:, 0])
    return Outcome(
        entered_s=contacts[told, 0],
        lead_s=_leads(contacts, live, blind)[told],
        unmonitored=int(counted.sum() - told.sum()),
        alarms=alarms,
        verdict=_verdicts(contacts, alarms, end_s),
        window=window,
        blind=blind,
        outside_s=end_s - begin_s - (float(inside[-1]) if len(inside) else 0.0),
        alarmed_s=_alarmed(edges, inside, live, window) if len(live) else 0.0,
    )


def _alarmed(
    edges: FloatArray, inside: FloatArray, alarms: FloatArray, window: tuple[float, float]
) -> float:
    """Monitored time of the window outside all contacts that an alarm was on [s]."""
    times = np.clip(alarms, *window)
    if len(edges):
        reached = np.column_stack((inside - (edges[:, 1] - edges[:, 0]), inside))
        times = times - np.interp(times, edges.ravel(), reached.ravel())
    return float((times[:, 1] - times[:, 0]).sum())


def watched_minutes(window: tuple[float, float], blind: FloatArray) -> float:
    """Time of a window in which the guard monitored [min]."""
    return (window[1] - window[0] - blind_s(blind, window)) / 60.0


def _leads(contacts: FloatArray, alarms: FloatArray, blind: FloatArray) -> FloatArray:
    """Lead time of each contact (c,) [s], nan where it was missed."""
    entered = contacts[:, 0]
    if not len(alarms) or not len(contacts):
        return np.full(len(contacts), np.nan)
    # alarms are parted by more than the silence: only the last that began before can be on
    last = np.searchsorted(alarms[:, 0], entered, side="left") - 1
    on = (last >= 0) & (entered <= alarms[last, 1] + SILENCE_S)
    # what was said before the guard was blind is no warning of what came after
    on &= alarms[last, 0] >= since(entered, blind)
    left_before = np.concatenate(([-np.inf], contacts[:-1, 1]))
    left_before[left_before >= entered] = -np.inf
    lead: FloatArray = np.where(on, entered - np.maximum(alarms[last, 0], left_before), np.nan)
    return lead


def _verdicts(contacts: FloatArray, alarms: FloatArray, end_s: float) -> npt.NDArray[np.int8]:
    """What each alarm was (a,)."""
    if not len(alarms):
        return np.zeros(0, dtype=np.int8)
    until = alarms[:, 1] + SILENCE_S
    if len(contacts):
        last = np.searchsorted(contacts[:, 0], until, side="right") - 1
        met = (last >= 0) & (contacts[last, 1] >= alarms[:, 0])
    else:
        met = np.zeros(len(alarms), dtype=np.bool_)
    verdict = np.where(met, TRUE, np.where(until > end_s, UNDECIDED, FALSE))
    return verdict.astype(np.int8)
