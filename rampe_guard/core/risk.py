"""One probability of contact per zone and horizon, from all three forecasts.

What the present motion and primitive say is the prior, worth four similar situations:

    π(h) = max(P of intent if it meets the zone within h,
               1/2 if the stopping path does, 4/5 if it does whatever the operator does)

What memory says is counted in: of similar situations with weights wᵢ, those that met the zone

    P(h) = (4 π(h) + Σ wᵢ [met within h]) / (4 + Σ wᵢ)

So in a new place the present motion speaks alone, and where the operator has been many times,
what he did there. Of the stopping paths that touch, a third to a half end in contact, since
operators brake by themselves. P is smoothed over 0.4 s, so that alarms do not
flicker with the choice of situations; what decides about the stopping path is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from rampe_guard.core.events import Source
from rampe_guard.core.foresight import Outlook

HORIZONS_S: Final = (0.5, 1.0, 2.0)
"""Horizons for which a probability is told [s]."""
_PRIOR_WEIGHT: Final = 4.0
_BRAKES: Final = 0.5
_TOO_LATE: Final = 0.8
_SMOOTH_S: Final = 0.4
_NOTHING: Final = 1e-9
"""A probability below this is none."""
_NEVER: Final = tuple(0.0 for _ in HORIZONS_S)


@dataclass(frozen=True, slots=True)
class Threat:
    """What the present motion and primitive say of one zone; infinite times: never.

    Attributes:
        stop_s: when the stopping path meets it [s].
        too_late: it will be met whatever the operator does.
        intent: probability that the primitive under way meets it [-].
        intent_s: when it does [s].
    """

    stop_s: float = math.inf
    too_late: bool = False
    intent: float = 0.0
    intent_s: float = math.inf

    def within(self, limit_s: float) -> float:
        """π of the time ``limit_s`` [s]."""
        stopping = _TOO_LATE if self.too_late else _BRAKES
        return max(
            self.intent if self.intent_s <= limit_s else 0.0,
            stopping if self.stop_s <= limit_s else 0.0,
        )


_NONE: Final = Threat()


@dataclass(frozen=True, slots=True)
class ZoneRisk:
    """The probability of contact with one zone.

    Attributes:
        zone: its name.
        within: P for each of `HORIZONS_S` [-].
        probability: of the longest look ahead, from which the level comes [-].
        instant: the same, before it is smoothed [-].
        soon: within the time that it takes to react and to stop [-].
        time_s: when, if it comes to contact [s]; None where nothing meets it.
        source: the forecast that says most of it.
        floor: it will be met whatever the operator does.
    """

    zone: str
    within: tuple[float, ...]
    probability: float
    instant: float
    soon: float
    time_s: float | None
    source: Source
    floor: bool


class RiskBook:
    """Keeps the smoothed probabilities of all zones.

    Args:
        horizon_s: how far memory looks [s].
    """

    def __init__(self, horizon_s: float) -> None:
        self._horizon_s = horizon_s
        self._smooth: dict[str, list[float]] = {}
        self._stamp_s: float | None = None
        self._share = 1.0
        self._first = True

    def forget(self) -> None:
        """Something was missing: what was, says nothing of what is."""
        self._smooth.clear()
        self._stamp_s = None

    def begin(self, stamp_s: float) -> None:
        """The zones of one evaluation follow, of this stamp [s]."""
        self._first = self._stamp_s is None
        past_s = 0.0 if self._stamp_s is None else max(stamp_s - self._stamp_s, 0.0)
        self._share = 1.0 - math.exp(-past_s / _SMOOTH_S)
        self._stamp_s = stamp_s

    def weigh(
        self, zone: str, threat: Threat, outlook: Outlook, reach_s: float, stamp_s: float
    ) -> ZoneRisk:
        """The risk of one zone.

        Args:
            zone: its name.
            threat: what the present motion says of it.
            outlook: what memory says.
            reach_s: time that it takes to react and to stop [s].
            stamp_s: now, on the clock of the inputs' stamps [s].
        """
        before = self._smooth.get(zone)
        if before is None and threat == _NONE and zone not in outlook.meetings:
            return ZoneRisk(zone, _NEVER, 0.0, 0.0, 0.0, None, "intent", floor=False)
        total = _PRIOR_WEIGHT + outlook.weight
        limits = (*HORIZONS_S, self._horizon_s, reach_s)
        met = outlook.met_within(zone, limits, stamp_s)
        raw = [
            (_PRIOR_WEIGHT * threat.within(limit_s) + weight) / total
            for limit_s, weight in zip(limits, met, strict=True)
        ]
        past = before or (raw if self._first else [0.0] * len(raw))
        smooth = [old + self._share * (new - old) for old, new in zip(past, raw, strict=True)]
        if max(smooth) > _NOTHING:
            self._smooth[zone] = smooth
        else:
            self._smooth.pop(zone, None)
        *within, probability, soon = smooth
        beyond = threat.intent if threat.intent_s > self._horizon_s else 0.0
        meeting = outlook.first(zone)
        remembered = met[-2] / outlook.weight if outlook.weight > 0.0 else 0.0
        by_memory = meeting is not None and remembered >= threat.intent
        time_s = min(threat.stop_s, threat.intent_s)
        if meeting is not None and (by_memory or math.isinf(time_s)):
            time_s = min(time_s, max(outlook.looked_s + meeting.time_s - stamp_s, 0.0))
        return ZoneRisk(
            zone=zone,
            within=tuple(within),
            probability=max(probability, beyond),
            instant=max(raw[-2], beyond),
            soon=soon,
            time_s=None if math.isinf(time_s) else time_s,
            source="next" if by_memory else "intent",
            floor=threat.too_late,
        )
