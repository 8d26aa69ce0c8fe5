"""Actuators as bars: where each is, where it is expected to end, and what is barred."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rampe_guard.dashboard.model import Model
from rampe_guard.dashboard.picture import Bar
from rampe_guard.dashboard.sight import Sight
from rampe_guard.dashboard.tones import Tone

_LONG = 0.5
"""Travel from which two decimals are enough [unit]."""


def bars(model: Model, sight: Sight, tones: Mapping[str, Tone], *, lost: bool) -> tuple[Bar, ...]:
    """One bar per actuator.

    Args:
        model: limits and actuator limits.
        sight: positions, levers and prediction.
        tones: of actuator limits in alert, by zone.
        lost: nobody watches: no prediction is shown.
    """
    return tuple(_bar(model, sight, i, tones, lost=lost) for i in range(len(model.arm.limits)))


def basis(sight: Sight, *, lost: bool) -> str:
    """What the prediction rests on."""
    prediction = sight.prediction
    if lost or prediction is None or prediction.mean is None:
        return "no prediction"
    seen = prediction.observations
    return f"prediction from {seen} earlier move{'' if seen == 1 else 's'} like this"


def _bar(model: Model, sight: Sight, i: int, tones: Mapping[str, Tone], *, lost: bool) -> Bar:
    actuator = model.site.guard.actuators[i]
    low, high = (float(v) for v in model.arm.limits[i])
    endless = not (math.isfinite(low) and math.isfinite(high))
    if endless:
        low, high = -math.pi, math.pi
    places = 2 if high - low >= _LONG else 3

    def share(value: float) -> float:
        turned = math.remainder(value, math.tau) if endless else value
        return min(1.0, max(0.0, (turned - low) / (high - low)))

    here = None
    value = "—"
    if sight.position is not None and not sight.position_stale:
        here = share(float(sight.position[i]))
        value = f"{sight.position[i]:.{places}f} {actuator.unit}"
    there = near = far = None
    expected = ""
    prediction = None if lost else sight.prediction
    if prediction is not None and prediction.category[i] != 0:
        end = (prediction.endpoint or {}).get(actuator.name)
        spread = (prediction.scale or {}).get(actuator.name)
        mean = (prediction.mean or {}).get(actuator.name)
        if end is not None and mean is not None:
            there, expected = share(end), f"{mean:+.{places}f}"
        if end is not None and spread is not None:
            near, far = sorted((share(end - spread), share(end + spread)))
            expected = f"{expected} ± {spread:.{places}f}"
    barred = [
        (share(a), share(b), tones.get(limit.name, Tone.LOST if lost else Tone.CALM))
        for limit in model.limits
        if limit.actuator == i
        for a, b in ((low, limit.below), (limit.above, high))
        if a is not None and b is not None
    ]
    lever = "—"
    if sight.command is not None and not sight.command_stale:
        lever = f"{round(float(sight.command[i]), 2) + 0.0:+.0%}"
    return Bar(actuator.name, here, there, near, far, tuple(barred), value, expected, lever)
