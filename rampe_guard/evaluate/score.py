"""Were contacts warned of, how early, and how often in vain.

Definitions, for one zone and one level (an alert counts if it is at this level or above):

- *contact*: an entry into the zone's margin within the window. A re-entry within 0.5 s of
  leaving is the same contact. A contact that was there when the window began cannot be
  warned of: it is not counted, but it excuses an alarm.
- *alarm*: an episode of alerts, joined across silence of up to 0.5 s, that touches the window.
- *warned*: an alarm began before the entry, and was on at the entry or had ended at most
  0.5 s before it. There is at most one such alarm. *Missed*: not warned.
- *not monitored*: a contact that came while the guard said NOT MONITORING, or at the moment
  at which it saw again. It is neither warned nor missed. An alert that was frozen meanwhile is no
  warning: it begins anew when the guard sees again. Whether it was false is judged as if it had
  been on all the time, since it was shown.
- *lead time*: entry less the start of that alarm; where an earlier contact lies within the
  alarm, less the time that contact was left, so that one long alarm earns no credit twice.
- *false alarm*: no contact overlaps the alarm or the 0.5 s after it. An alarm that is still
  on 0.5 s before the end of the window and has no contact yet is *undecided*, not false.

Shares are of all contacts that came while the guard monitored: a missed one counts as not early
enough. Rates are of the time in which it did.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from rampe_guard.core.alarm import Level
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.blindness import NEVER
from rampe_guard.evaluate.episodes import (
    AlertSpan,
    Contact,
    alert_episodes,
    contact_episodes,
    contact_times,
)
from rampe_guard.evaluate.outcome import FALSE, UNDECIDED, judge, watched_minutes


@dataclass(frozen=True, slots=True)
class LevelScore:
    """Counts for one level, of one zone or of all zones together.

    Attributes:
        level: alerts at this level or above count.
        leads_s: lead time of each warned contact, in order of zone and time [s].
        missed: contacts without a warning.
        alarms: alarm episodes.
        false_alarms: those without a contact.
        undecided: those that the end of the window kept from being true or false.
        unknown_contacts: contacts that rest on a sweep without an answer.
        zone_minutes: time in which the guard monitored [min], summed over zones.
        unmonitored: contacts that came while it did not; neither warned nor missed.
    """

    level: Level
    leads_s: tuple[float, ...]
    missed: int
    alarms: int
    false_alarms: int
    undecided: int
    unknown_contacts: int
    zone_minutes: float
    unmonitored: int = 0

    @property
    def warned(self) -> int:
        """Contacts with a warning."""
        return len(self.leads_s)

    @property
    def contacts(self) -> int:
        """All contacts that came while the guard monitored."""
        return self.warned + self.missed

    @property
    def median_lead_s(self) -> float | None:
        """Median lead time of the warned contacts [s]; None without any."""
        return median(self.leads_s) if self.leads_s else None

    @property
    def false_per_minute(self) -> float | None:
        """False alarms per minute and zone [1/min]; None when nothing was watched."""
        return self.false_alarms / self.zone_minutes if self.zone_minutes > 0.0 else None

    def share_at_least(self, lead_s: float) -> float | None:
        """Share of all contacts warned of at least ``lead_s`` ahead; None without contacts."""
        early = sum(lead >= lead_s for lead in self.leads_s)
        return early / self.contacts if self.contacts else None


def score_zone(
    contacts: Iterable[Contact],
    spans: Iterable[AlertSpan],
    zone: str,
    level: Level,
    window_s: tuple[float, float],
    blind: FloatArray = NEVER,
) -> LevelScore:
    """Score one zone at one level over ``window_s`` (start, end) [s].

    ``blind`` are the spans in which the guard did not monitor (b, 2) [s].

    Raises:
        ValueError: the window ends before it starts.
    """
    begin_s, end_s = window_s
    if end_s < begin_s:
        raise ValueError(f"window ends at {end_s} s, before it starts at {begin_s} s")
    entries = contact_episodes(contacts, zone)
    alarms = np.array(alert_episodes(spans, zone, level)).reshape(-1, 2)
    found = judge(contact_times(entries), alarms, window_s, blind)
    leads = found.lead_s.tolist()
    return LevelScore(
        level=level,
        leads_s=tuple(lead for lead in leads if not math.isnan(lead)),
        missed=sum(map(math.isnan, leads)),
        alarms=len(found.alarms),
        false_alarms=int((found.verdict == FALSE).sum()),
        undecided=int((found.verdict == UNDECIDED).sum()),
        unknown_contacts=sum(c.unknown for c in entries if begin_s < c.entered_s <= end_s),
        zone_minutes=watched_minutes(window_s, blind),
        unmonitored=found.unmonitored,
    )


def score(
    contacts: Sequence[Contact],
    spans: Sequence[AlertSpan],
    zones: Iterable[str],
    level: Level,
    window_s: tuple[float, float],
    blind: FloatArray = NEVER,
) -> dict[str, LevelScore]:
    """Score every zone at one level; see `total` for all of them together."""
    return {zone: score_zone(contacts, spans, zone, level, window_s, blind) for zone in zones}


def total(scores: Iterable[LevelScore]) -> LevelScore:
    """Add the scores of several zones at one level.

    Raises:
        ValueError: no scores, or scores of different levels.
    """
    parts = tuple(scores)
    levels = {part.level for part in parts}
    if len(levels) != 1:
        raise ValueError(f"can only add scores of one level, not of {sorted(levels)}")
    return LevelScore(
        level=parts[0].level,
        leads_s=tuple(lead for part in parts for lead in part.leads_s),
        missed=sum(part.missed for part in parts),
        alarms=sum(part.alarms for part in parts),
        false_alarms=sum(part.false_alarms for part in parts),
        undecided=sum(part.undecided for part in parts),
        unknown_contacts=sum(part.unknown_contacts for part in parts),
        zone_minutes=sum(part.zone_minutes for part in parts),
        unmonitored=sum(part.unmonitored for part in parts),
    )
