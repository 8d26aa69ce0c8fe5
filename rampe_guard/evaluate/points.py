"""From outcomes to the figures of a report: shares, leads and rates, with bootstrap intervals.

What happens within half a minute hangs together (one dig, one truck), so the bootstrap draws
blocks of `BLOCK_S` of each log, all zones together, and not single contacts or alarms.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.blindness import blind_s
from rampe_guard.evaluate.outcome import FALSE, UNDECIDED, Outcome

LEADS_S: Final = (0.5, 1.0, 1.5, 2.0)
BLOCK_S: Final = 30.0
RESAMPLES: Final = 1000
_SEED = 20140501
_QUANTILES = (0.025, 0.975)
_LOW_LEAD = 0.05

IntArray = npt.NDArray[np.int64]
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Pool:
    """Outcomes of many zones and logs together.

    Attributes:
        lead_s: lead time of each contact (c,) [s], nan where missed.
        contact_block: the block that each contact lies in (c,).
        false_block: the block in which each false alarm began (f,).
        minutes: monitored zone minutes of each block (b,).
        alarms: all alarms.
        undecided: those that the end of a log kept from being true or false.
        outside_s: time outside contact, summed over zones [s].
        alarmed_s: how much of that an alarm was on [s].
        unmonitored: contacts that came while the guard did not monitor; in none of the above.
    """

    lead_s: FloatArray
    contact_block: IntArray
    false_block: IntArray
    minutes: FloatArray
    alarms: int
    undecided: int
    outside_s: float
    alarmed_s: float
    unmonitored: int = 0


def block_count(window: tuple[float, float]) -> int:
    """Blocks of a window [s], all of one length as near to `BLOCK_S` as can be."""
    return max(1, round((window[1] - window[0]) / BLOCK_S))


def block_of(time_s: FloatArray, window: tuple[float, float]) -> IntArray:
    """The block of a window that each time lies in (k,), or the nearest."""
    count = block_count(window)
    length_s = (window[1] - window[0]) / count or 1.0
    index: IntArray = np.clip((time_s - window[0]) // length_s, 0, count - 1).astype(np.int64)
    return index


def pool(logs: Iterable[Sequence[Outcome]]) -> Pool:
    """Put the outcomes of each log, one for each zone, into one pool."""
    leads: list[FloatArray] = []
    contact_block: list[IntArray] = []
    false_block: list[IntArray] = []
    minutes: list[FloatArray] = []
    alarms = undecided = unmonitored = first = 0
    outside_s = alarmed_s = 0.0
    for zones in logs:
        if not zones:
            continue
        window = zones[0].window
        count = block_count(window)
        for outcome in zones:
            false = outcome.alarms[outcome.verdict == FALSE, 0]
            leads.append(outcome.lead_s)
            contact_block.append(first + block_of(outcome.entered_s, window))
            false_block.append(first + block_of(false, window))
            alarms += len(outcome.alarms)
            outside_s += outcome.outside_s
            alarmed_s += outcome.alarmed_s
            undecided += int((outcome.verdict == UNDECIDED).sum())
            unmonitored += outcome.unmonitored
        minutes.append(_watched_s(window, zones[0].blind) * len(zones) / 60.0)
        first += count
    return Pool(
        lead_s=_floats(leads),
        contact_block=_blocks(contact_block),
        false_block=_blocks(false_block),
        minutes=_floats(minutes),
        alarms=alarms,
        undecided=undecided,
        outside_s=outside_s,
        alarmed_s=alarmed_s,
        unmonitored=unmonitored,
    )


def _watched_s(window: tuple[float, float], blind: FloatArray) -> FloatArray:
    """Monitored time of each block of a window (b,) [s]."""
    count = block_count(window)
    length_s = (window[1] - window[0]) / count
    edges = [window[0] + length_s * k for k in range(count + 1)]
    return length_s - np.array([blind_s(blind, block) for block in pairwise(edges)])


def _floats(parts: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate([np.zeros(0), *parts])


def _blocks(parts: Sequence[IntArray]) -> IntArray:
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])


@dataclass(frozen=True, slots=True)
class Figures:
    """The figures of one pool; None where there is nothing to reckon from.

    Attributes:
        crossings: contacts that came while the guard monitored.
        missed: those without an alarm before them.
        warned: share of all contacts warned of at least each of `LEADS_S` ahead.
        median_lead_s: median lead time of the warned contacts [s].
        lead_5_percent_s: lead time that 95 % of the warned contacts exceed [s].
        alarms: alarm episodes.
        false_alarms: those without a contact.
        undecided: those that the end of a log kept from being true or false.
        zone_minutes: time in which the guard monitored, summed over zones [min].
        false_per_min_per_zone: [1/min].
        alarmed_share: share of the time outside contact that an alarm was on.
        unmonitored: contacts that came while it did not.
    """

    crossings: int
    missed: int
    warned: tuple[float | None, ...]
    median_lead_s: float | None
    lead_5_percent_s: float | None
    alarms: int
    false_alarms: int
    undecided: int
    zone_minutes: float
    false_per_min_per_zone: float | None
    alarmed_share: float | None
    unmonitored: int = 0


def figures(of: Pool) -> Figures:
    """Reckon the figures of a pool."""
    known = np.sort(of.lead_s[~np.isnan(of.lead_s)])
    crossings = len(of.lead_s)
    minutes = float(of.minutes.sum())
    return Figures(
        crossings=crossings,
        missed=crossings - len(known),
        warned=tuple(
            float((known >= lead).sum()) / crossings if crossings else None for lead in LEADS_S
        ),
        median_lead_s=float(np.median(known)) if known.size else None,
        lead_5_percent_s=float(np.quantile(known, _LOW_LEAD)) if known.size else None,
        alarms=of.alarms,
        false_alarms=len(of.false_block),
        undecided=of.undecided,
        zone_minutes=minutes,
        false_per_min_per_zone=len(of.false_block) / minutes if minutes > 0.0 else None,
        alarmed_share=of.alarmed_s / of.outside_s if of.outside_s > 0.0 else None,
        unmonitored=of.unmonitored,
    )


@dataclass(frozen=True, slots=True)
class Spread:
    """95 % bootstrap intervals of the figures of a pool; None where nothing can be drawn."""

    warned: tuple[Interval | None, ...]
    missed: Interval | None
    median_lead_s: Interval | None
    lead_5_percent_s: Interval | None
    false_per_min_per_zone: Interval | None


def spread(of: Pool) -> Spread:
    """Draw the blocks of a pool with replacement, `RESAMPLES` times (seeded)."""
    weight = draws(len(of.minutes))  # (R, b)
    order = np.argsort(of.lead_s)  # missed ones last
    lead = of.lead_s[order]
    known = ~np.isnan(lead)
    drawn = weight[:, of.contact_block[order]]  # (R, c)
    contacts = drawn.sum(axis=1)
    false = weight[:, of.false_block].sum(axis=1)
    counted = drawn[:, known]
    return Spread(
        warned=tuple(
            interval(drawn[:, known & (lead >= least)].sum(axis=1), contacts) for least in LEADS_S
        ),
        missed=interval(contacts - counted.sum(axis=1), np.ones(len(contacts))),
        median_lead_s=_quantile(lead[known], counted, 0.5),
        lead_5_percent_s=_quantile(lead[known], counted, _LOW_LEAD),
        false_per_min_per_zone=interval(false, weight @ of.minutes),
    )


@lru_cache(maxsize=16)
def draws(blocks: int) -> FloatArray:
    """How often each block is drawn in each resample (RESAMPLES, blocks); always the same."""
    if not blocks:
        return np.zeros((RESAMPLES, 0))
    rng = np.random.default_rng(_SEED)
    return rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), size=RESAMPLES).astype(float)


def interval(above: FloatArray, below: FloatArray) -> Interval | None:
    """Quantiles of a ratio over the resamples in which there is one."""
    some = below > 0.0
    if not some.any():
        return None
    low, high = np.quantile(above[some] / below[some], _QUANTILES).tolist()
    return low, high


def _quantile(lead: FloatArray, weight: FloatArray, at: float) -> Interval | None:
    """Interval of a quantile of leads (w,), in order, of which each is drawn so often (R, w)."""
    total = weight.sum(axis=1)
    some = total > 0.0
    if not some.any():
        return None
    below = np.cumsum(weight[some], axis=1)
    index = (below < at * total[some, None]).sum(axis=1)
    low, high = np.quantile(lead[np.minimum(index, len(lead) - 1)], _QUANTILES).tolist()
    return low, high
