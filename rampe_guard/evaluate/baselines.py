"""The baselines: what a site would have without rampe-guard, or with a part of it.

Each makes a `Trace` of the same moments, by the same certified sweep:

- *constant velocity*: touches within h seconds if every actuator goes on as it moves now;
- *proximity*: nearer than a distance, whatever it does, as a fence or a sensor would have it;
- *stopping*: the floor of the guard alone: the way to rest if the lever is let go now;
- *RAMPE of the primitive*: the floor, and the probability that the primitive under way touches;
- *running mean*: the floor, and the mean displacement of the primitive's category.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.touch import Touch
from rampe_guard.evaluate.trace import Mask, Trace
from rampe_guard.evaluate.walk import Moment

HORIZONS_S: Final = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""Of constant velocity."""
LONGEST_S: Final = 3.0
"""How far ahead constant velocity is carried on for its trade-off curve [s]."""
NEAR: Final = (0.02, 0.05, 0.10, 0.15, 0.20)
"""Distances of proximity: share of the actuator's range, or of the arm's reach."""
FAMILY_S: Final = tuple(round(0.1 * k, 1) for k in range(1, 31))
"""Horizons of the trade-off curve of constant velocity [s]."""
FAMILY_NEAR: Final = tuple(round(0.01 * k, 2) for k in range(1, 31))
"""Distances of the trade-off curve of proximity."""
STOPPING: Final = "stopping"
PRIMITIVE: Final = "rampe_primitive"
USUAL: Final = "running_mean"


def velocity_name(horizon_s: float) -> str:
    """Name of constant velocity with this horizon."""
    return f"constant_velocity_{horizon_s:g}"


def proximity_name(near: float) -> str:
    """Name of proximity with this distance."""
    return f"proximity_{near * 100:g}_percent"


DESCRIPTIONS: Final[Mapping[str, str]] = {
    **{
        velocity_name(h): f"touches within {h:g} s if every actuator goes on as it moves now"
        for h in HORIZONS_S
    },
    **{
        proximity_name(near): (
            f"nearer than {near:.0%} of the actuator's range, or of the arm's reach; standing or"
            " moving"
        )
        for near in NEAR
    },
    STOPPING: "the way to rest touches, if the lever is let go now (the guard's floor)",
    PRIMITIVE: "probability that the primitive under way touches, by RAMPE; over the floor",
    USUAL: "the mean displacement of the primitive's category touches; over the floor",
}
"""What each baseline is, in the order of every table."""


@dataclass(frozen=True, slots=True)
class Raw:
    """What all baselines of one log are made of: k moments, z zones.

    Attributes:
        time_s: of the moments (k,) [s].
        zones: names (z).
        contact_s: time to contact at constant velocity (k, z) [s], inf beyond `LONGEST_S`.
        clearance: distance now (k, z) [m, or the actuator's unit for limits].
        floor: the stopping path touches (k, z).
        intent: probability that the primitive under way touches, by RAMPE (k, z).
        usual: the mean displacement of its category touches (k, z).
    """

    time_s: FloatArray
    zones: tuple[str, ...]
    contact_s: FloatArray
    clearance: FloatArray
    floor: Mask
    intent: FloatArray
    usual: Mask


def raw(moments: Sequence[Moment], touch: Touch, limits: FloatArray) -> Raw:
    """Sweep every path of every moment.

    Args:
        moments: of one log, at least one.
        touch: sweeps of the zones.
        limits: actuator limits (n, 2) [unit]: no path leads past them.
    """
    q = np.array([m.q for m in moments])
    stopping = np.array([m.stopping for m in moments])
    usual = np.clip(
        np.array([m.mean for m in moments]),
        np.minimum(limits[:, 0] - q, 0.0),
        np.maximum(limits[:, 1] - q, 0.0),
    )
    return Raw(
        time_s=np.array([m.time_s for m in moments]),
        zones=touch.zones,
        contact_s=_constant_velocity(q, np.array([m.velocity for m in moments]), touch, limits),
        clearance=touch.clearance(q),
        floor=np.isfinite(touch.first(q, stopping)),
        intent=_intent(moments, q, touch),
        usual=np.isfinite(touch.first(q, usual)),
    )


def traces(found: Raw, unit: FloatArray) -> dict[str, Trace]:
    """Every baseline of one log, by name.

    Args:
        found: of the log.
        unit: the actuator's range or the arm's reach, by zone (z,) [unit].
    """
    made = {velocity_name(h): constant_velocity(found, h) for h in HORIZONS_S}
    made |= {proximity_name(near): proximity(found, near, unit) for near in NEAR}
    nothing = np.zeros_like(found.intent)
    return made | {
        STOPPING: Trace(found.time_s, found.zones, nothing, found.floor),
        PRIMITIVE: Trace(found.time_s, found.zones, found.intent, found.floor),
        USUAL: Trace(found.time_s, found.zones, found.usual.astype(np.float64), found.floor),
    }


def constant_velocity(found: Raw, horizon_s: float) -> Trace:
    """Alarm when the contact is no further than the horizon [s]."""
    return _yes_or_no(found, found.contact_s <= horizon_s)


def proximity(found: Raw, near: float, unit: FloatArray) -> Trace:
    """Alarm when the distance is no more than a share of the unit (z,)."""
    return _yes_or_no(found, found.clearance <= near * unit)


def _yes_or_no(found: Raw, yes: Mask) -> Trace:
    return Trace(found.time_s, found.zones, yes.astype(np.float64), np.zeros_like(yes))


def _constant_velocity(
    q: FloatArray, velocity: FloatArray, touch: Touch, limits: FloatArray
) -> FloatArray:
    """Time to contact (k, z) [s]; an actuator that reaches its end stays there."""
    start, v = q.copy(), velocity.copy()
    found = np.full((len(q), len(touch.zones)), np.inf)
    spent = np.zeros(len(q))
    # each leg ends where another actuator reaches its end, or the time is up
    for _ in range(q.shape[1] + 1):
        end = np.where(v > 0.0, limits[:, 1], limits[:, 0])
        room = np.where(v != 0.0, (end - start) / np.where(v != 0.0, v, 1.0), np.inf)
        v = np.where(room <= 0.0, 0.0, v)
        room = np.where(room <= 0.0, np.inf, room)
        leg = np.minimum(room.min(axis=1), LONGEST_S - spent)
        going = np.flatnonzero((leg > 0.0) & v.any(axis=1))
        if not going.size:
            break
        way = v[going] * leg[going, None]
        at = touch.first(start[going], way)
        met = spent[going, None] + at * leg[going, None]
        found[going] = np.minimum(found[going], met)
        start[going] += way
        stopped = room[going] <= leg[going, None]
        v[going] = np.where(stopped, 0.0, v[going])
        spent[going] += leg[going]
    return found


def _intent(moments: Sequence[Moment], q: FloatArray, touch: Touch) -> FloatArray:
    """Probability of contact on the intent path (k, z)."""
    found = np.zeros((len(moments), len(touch.zones)))
    rows = [k for k, m in enumerate(moments) if m.intent is not None]
    if not rows:
        return found
    ways = np.array([m.intent.displacement for m in moments if m.intent is not None])
    at = touch.first(q[rows], ways)
    for row, where in zip(rows, at, strict=True):
        intent = moments[row].intent
        for z in np.flatnonzero(np.isfinite(where)).tolist():
            if intent is not None:
                found[row, z] = intent.probability_at(float(where[z]))
    return found
