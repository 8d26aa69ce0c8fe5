"""What must not be learned: refusal of primitives that cannot be what they seem.

==================  ==================================================================
``not_finite``      a start or displacement is NaN or infinite
``outside_limits``  it began or ended beyond the joint's limits
``against_lever``   an actuator went far against its own lever
``wrong_actuator``  the actuators that were not commanded moved, those commanded did not
``no_motion``       several primitives in a row without any motion: a frozen sensor
``impossible``      many times farther than this actuator ever went (without limits)
``outlier``         so far from experience that it is set aside; a second one like it is
                    a change of habit, and is learned
==================  ==================================================================

A single primitive without motion is a tap on the lever, and as real as any. It is held back
until something moves again.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from rampe_guard.core.scales import Scales
from rampe_guard.core.types import Category, FloatArray

Refusal: TypeAlias = Literal[
    "not_finite",
    "outside_limits",
    "against_lever",
    "wrong_actuator",
    "no_motion",
    "impossible",
    "outlier",
]
MOST_TAPS = 2
"""Primitives without motion in a row that may be taps; more is a frozen sensor."""
_AGAINST = 0.1
"""Motion against the lever that lag and load explain [share of the range]."""
_IMPOSSIBLE = 20.0
"""Times the largest displacement of an actuator that is well known."""
_WELL_KNOWN = 25.0
"""Displacements by which that is so: the first few of an operator may all be taps."""
_STILL = 1e-9
_SETTLED_COUNT = 5.0
"""Displacements after which the range worked in is known, where there are no limits."""


def is_still(x: FloatArray, scales: Scales) -> bool:
    """True if nothing moved at all in the displacement x (n,)."""
    size = np.abs(x)
    if scales.all_bounded:
        return bool((size <= _STILL * scales.span).all())
    span = np.where(scales.bounded, scales.span, np.maximum(scales.largest, _STILL))
    return bool((size <= _STILL * span).all())


def screen(category: Category, q: FloatArray, x: FloatArray, scales: Scales) -> Refusal | None:
    """Reason not to learn the primitive from q (n,) that went x (n,), or None.

    Args:
        category: Ω.
        q: start [unit].
        x: displacement [unit].
        scales: learned units.
    """
    end = q + x
    if not np.isfinite(end).all():  # neither could be NaN or infinite without the sum being so
        return "not_finite"
    lowest, highest = np.minimum(q, end), np.maximum(q, end)
    if (lowest < scales.lowest).any() or (highest > scales.highest).any():
        return "outside_limits"
    sign = np.array(category, dtype=np.float64)
    moved = x / _span(scales)
    if (sign * moved < -_AGAINST).any():
        return "against_lever"
    driven = sign != 0.0
    share = np.abs(moved)
    if share[~driven].sum() > max(share[driven].sum(), _AGAINST):
        return "wrong_actuator"
    return None if scales.all_bounded else _too_far(driven, x, scales)


def _too_far(driven: npt.NDArray[np.bool_], x: FloatArray, scales: Scales) -> Refusal | None:
    known = driven & ~scales.bounded & (scales.count >= _WELL_KNOWN)
    return "impossible" if (np.abs(x) > _IMPOSSIBLE * scales.largest)[known].any() else None


def _span(scales: Scales) -> FloatArray:
    """Range per actuator [unit]: by its limits, else as worked in; infinite while unknown."""
    if scales.all_bounded:
        return scales.span
    worked = (scales.high - scales.low)[: len(scales.span)]
    settled = (scales.count >= _SETTLED_COUNT) & (worked > 0.0)
    return np.where(scales.bounded, scales.span, np.where(settled, worked, np.inf))
