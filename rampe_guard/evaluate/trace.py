"""What a forecaster said of each zone at each evaluation, and which alarms follow from it.

Every forecaster, the guard and each baseline, becomes a `Trace`, and every trace goes through
the same life of an alarm:

- *cause*: at an evaluation the floor holds, or the score is at least the threshold;
- *on*: from the evaluation at which the cause was seen ``debounce`` times in a row, or the floor
  ``imminent`` times (`Manners`);
- *off*: with its last cause, once there was none for `SILENCE_S`; what comes sooner than that
  belongs to the same alarm.

So an off-delay, which makes an alarm longer without foreseeing anything, earns nobody credit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.config import AlertConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.episodes import SILENCE_S

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Manners:
    """How often in a row a cause must be seen, and a floor, before there is an alarm."""

    debounce: int = 1
    imminent: int = 1


def manners(alerts: AlertConfig) -> Manners:
    """Those of a site's alerts."""
    return Manners(alerts.debounce_steps, alerts.imminent_steps)


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
    """Alarm episodes of one zone (a, 2): start and last cause [s], in order.

    Args:
        trace: what was said.
        zone: index of the zone.
        threshold: smallest score that is a cause, above 0.
        how: manners of the alarm.
    """
    floor = trace.floor[:, zone]
    cause = floor | (trace.score[:, zone] >= threshold)
    seen = np.flatnonzero(cause)
    if not seen.size:
        return np.zeros((0, 2))
    shown = _in_a_row(cause, how.debounce) | _in_a_row(floor, how.imminent)
    # causes parted by no more than the silence hold one alarm, from its first shown one on
    seen_s = trace.time_s[seen]
    first = np.flatnonzero(np.diff(seen_s, prepend=-np.inf) > SILENCE_S)
    last = np.append(first[1:], len(seen)) - 1
    shown_at = np.append(np.flatnonzero(shown), len(cause))
    start = shown_at[np.searchsorted(shown_at, seen[first])]
    ever = start <= seen[last]
    return np.column_stack((trace.time_s[start[ever]], seen_s[last[ever]]))


def _in_a_row(on: Mask, steps: int) -> Mask:
    """Where ``on`` held at this and the ``steps - 1`` evaluations before."""
    held = on.copy()
    for back in range(1, steps):
        held[back:] &= on[:-back]
        held[:back] = False
    return held
