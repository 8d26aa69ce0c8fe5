"""What a forecaster said of each zone at each evaluation, and which alarms follow from it.

Every forecaster, the guard and each baseline, becomes a `Trace`, and every trace goes through
the same life of an alarm, which is the one that the guard's published alerts live (`core.alarm`,
`core.levels`), since that is what the operator hears:

- *cause*: at an evaluation the floor holds, or the score is at least the threshold; of an alarm
  that is on, also where the score is only by its deadband below the threshold;
- *on*: from the evaluation at which the cause was seen ``debounce`` times in a row, or the floor
  ``imminent`` times;
- *off*: at the first evaluation with no cause for ``off_delay_s`` and ``release`` evaluations in a
  row, and at least ``min_on_s`` after it came on.

The *strict* form ends an alarm with its last cause instead: there, staying on for long without
foreseeing anything earns nobody credit.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from rampe_guard.core.config import AlertConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.episodes import SILENCE_S

Mask = npt.NDArray[np.bool_]


_DEADBAND_SHARE: Final = 0.4
"""As in `core.levels`: a deadband is no larger than this share of its threshold."""


@dataclass(frozen=True, slots=True)
class Manners:
    """How an alarm lives.

    Attributes:
        debounce: how often in a row a cause must be seen before there is an alarm.
        imminent: the same of a floor.
        release: how often in a row no cause must be seen before it goes.
        off_delay_s: for how long [s].
        min_on_s: shortest life [s].
        deadband: how far below its threshold a score holds an alarm [-].
        strict: an alarm ends with its last cause at the full threshold.
    """

    debounce: int = 1
    imminent: int = 1
    release: int = 1
    off_delay_s: float = 0.0
    min_on_s: float = 0.0
    deadband: float = 0.0
    strict: bool = False


def manners(alerts: AlertConfig) -> Manners:
    """Those of a site's alerts."""
    return Manners(
        alerts.debounce_steps,
        alerts.imminent_steps,
        alerts.release_steps,
        alerts.off_delay_s,
        alerts.min_on_s,
        alerts.deadband_probability,
    )


def lowered(threshold: float, deadband: float) -> float:
    """The score that holds what ``threshold`` raised."""
    return threshold - min(deadband, _DEADBAND_SHARE * threshold)


@dataclass(frozen=True, slots=True)
class Trace:
    """k evaluations of z zones.

    Attributes:
        time_s: of each evaluation (k,), increasing [s].
        zones: names (z).
        score: how surely each is touched (k, z), 0 to 1.
        floor: an alarm whatever the threshold (k, z).
        horizons_s: h times ahead that ``within`` is about [s]; none if it is empty.
        within: probability of contact within each horizon (h, k, z), None without horizons.
    """

    time_s: FloatArray
    zones: tuple[str, ...]
    score: FloatArray
    floor: Mask
    horizons_s: tuple[float, ...] = ()
    within: FloatArray | None = None

    def __post_init__(self) -> None:
        """Refuse what no forecaster can have said.

        Raises:
            ValueError: shapes do not fit, time does not advance, or a score is no share.
        """
        shape = (len(self.time_s), len(self.zones))
        if self.score.shape != shape or self.floor.shape != shape:
            raise ValueError(
                f"score {self.score.shape} and floor {self.floor.shape} are not of {shape[0]}"
                f" evaluations of {shape[1]} zones"
            )
        if len(self.time_s) > 1 and not (np.diff(self.time_s) > 0.0).all():
            raise ValueError("evaluations are not in order of time")
        within = np.zeros((0, *shape)) if self.within is None else self.within
        if within.shape != (len(self.horizons_s), *shape):
            raise ValueError(f"within {within.shape} is not of {len(self.horizons_s)} horizons")
        for values in (self.score, within):
            if not ((values >= 0.0) & (values <= 1.0)).all():  # False for NaN, too
                raise ValueError("a score is not between 0 and 1")

    @property
    def binary(self) -> bool:
        """Yes or no only: every threshold gives the same alarms."""
        return bool(((self.score == 0.0) | (self.score == 1.0)).all())


def alarms(trace: Trace, zone: int, threshold: float, how: Manners) -> FloatArray:
    """Alarm episodes of one zone (a, 2): start and end [s], in order; inf while still on.

    Alarms that no more than `SILENCE_S` parts are one episode.

    Args:
        trace: what was said.
        zone: index of the zone.
        threshold: smallest score that is a cause, above 0.
        how: manners of the alarm.
    """
    floor, score = trace.floor[:, zone], trace.score[:, zone]
    cause = floor | (score >= threshold)
    if not cause.any():
        return np.zeros((0, 2))
    shown = _in_a_row(cause, how.debounce) | _in_a_row(floor, how.imminent)
    if how.strict:
        return _to_last_cause(trace.time_s, cause, shown)
    held = floor | (score >= lowered(threshold, how.deadband))
    return _to_calm(trace.time_s, held, shown, how)


def _to_last_cause(time_s: FloatArray, cause: Mask, shown: Mask) -> FloatArray:
    """Causes parted by no more than the silence hold one alarm, from its first shown one on."""
    seen = np.flatnonzero(cause)
    seen_s = time_s[seen]
    first = np.flatnonzero(np.diff(seen_s, prepend=-np.inf) > SILENCE_S)
    last = np.append(first[1:], len(seen)) - 1
    shown_at = np.append(np.flatnonzero(shown), len(cause))
    start = shown_at[np.searchsorted(shown_at, seen[first])]
    ever = start <= seen[last]
    return np.column_stack((time_s[start[ever]], seen_s[last[ever]]))


def _to_calm(time_s: FloatArray, held: Mask, shown: Mask, how: Manners) -> FloatArray:
    """From each first shown cause to the first evaluation at which all is calm."""
    # calm lies between one held evaluation and the next: from ``calm`` to before ``following``
    at = np.flatnonzero(held)
    following = np.append(at[1:], len(held) + 1)
    calm = np.maximum(np.searchsorted(time_s, time_s[at] + how.off_delay_s), at + how.release)
    some = calm < np.minimum(following, len(held))
    calm_at, until = calm[some].tolist(), following[some].tolist()
    index = np.flatnonzero(shown)
    ripe = np.searchsorted(time_s, time_s[index] + how.min_on_s).tolist()
    starts = index.tolist()
    found: list[tuple[float, float]] = []
    k = 0
    while k < len(starts):
        start_s, end_s = float(time_s[starts[k]]), np.inf
        gap = bisect_right(until, ripe[k])
        end = max(calm_at[gap], ripe[k]) if gap < len(until) else len(held)
        if end < len(held):
            end_s = float(time_s[end])
        if found and start_s <= found[-1][1] + SILENCE_S:
            start_s = found.pop()[0]
        found.append((start_s, end_s))
        k = bisect_left(starts, end, k)
    return np.array(found).reshape(-1, 2)


def _in_a_row(on: Mask, steps: int) -> Mask:
    """Where ``on`` held at this and the ``steps - 1`` evaluations before."""
    held = on.copy()
    for back in range(1, steps):
        held[back:] &= on[:-back]
        held[:back] = False
    return held
