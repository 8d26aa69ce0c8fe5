"""Where the arm is going, as a few of its postures on the way.

The number of postures is always the same: a page moves its ghosts, it makes no new ones.
"""

from __future__ import annotations

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.dashboard.model import Model
from rampe_guard.dashboard.sight import Sight

INTENT = 4
STOPPING = 2
NEXT = 1
_LEAST_SHARE = 0.004
"""A way shorter than this share of the travel is no way to look at."""


def intent_ghosts(model: Model, sight: Sight) -> FloatArray | None:
    """On to the predicted end, half of them to each of two futures (4, L, 4, 4); None: no way."""
    prediction, q = sight.prediction, sight.position
    if prediction is None or q is None or prediction.endpoint is None:
        return None
    names = model.site.actuator_names
    sign = np.array(prediction.category, dtype=float)
    ends = [np.array([e.position.get(n, np.nan) for n in names]) for e in prediction.endpoints]
    if not ends:
        ends = [np.array([prediction.endpoint.get(n, np.nan) for n in names])]
    ways = [np.where(sign != 0.0, np.maximum(sign * (end - q), 0.0) * sign, 0.0) for end in ends]
    ways = [np.where(np.isfinite(way), way, 0.0) for way in ways]
    if all(_short(model, way) for way in ways):
        return None
    each = INTENT // len(ways)
    shares = np.arange(1, each + 1) / each
    return model.poses(np.concatenate([q + shares[:, None] * way for way in ways]))


def next_ghost(model: Model, sight: Sight) -> tuple[FloatArray, str] | None:
    """Where the likeliest way on from memory leads (1, L, 4, 4), and why, in words.

    None: memory knows no way, or the likeliest is to stay.
    """
    prediction, q = sight.prediction, sight.position
    if prediction is None or q is None or not prediction.scenarios:
        return None
    way = prediction.scenarios[0]
    end = np.array([way.endpoint.get(name, np.nan) for name in model.site.actuator_names])
    if not np.isfinite(end).all() or _short(model, end - q):
        return None
    asked = sum(scenario.count for scenario in prediction.scenarios)
    words = f"in {way.count} of {asked} similar situations you went on to here"
    return model.poses(end[None]), words


def stopping_ghosts(model: Model, sight: Sight) -> FloatArray | None:
    """On to where the arm rests if the lever is let go now (2, L, 4, 4); None: it stands."""
    q, velocity = sight.position, sight.velocity
    if q is None or velocity is None:
        return None
    lever = np.zeros(len(q)) if sight.command is None or sight.command_stale else sight.command
    way = model.forecaster.stopping(q, velocity, lever).displacement
    if _short(model, way):
        return None
    shares = np.arange(1, STOPPING + 1) / STOPPING
    return model.poses(q + shares[:, None] * way)


def _short(model: Model, way: FloatArray) -> bool:
    travel = model.arm.limits[:, 1] - model.arm.limits[:, 0]
    travel = np.where(np.isfinite(travel), travel, 2.0 * np.pi)
    return bool((np.abs(way) < _LEAST_SHARE * travel).all())
