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

from typing import Literal, TypeAlias, get_args

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
FAULTS: frozenset[str] = frozenset(get_args(Refusal)) - {"outlier"}
"""Refusals that speak of a wrong column or a faulty sensor."""
MOST_TAPS = 2
"""Primitives without motion in a row that may be taps; more is a frozen sensor."""
_AGAINST = 0.5
"""Motion against the lever, or without it, that lag and load explain [usual displacements]."""
_HARDLY = 0.1
"""Motion with the lever that is hardly any [usual displacements]."""
_LARGEST = 1e100
"""Values beyond are no measurements: their squares must stay finite."""
_IMPOSSIBLE = 20.0
"""Times the largest displacement of an actuator that is well known."""
_WELL_KNOWN = 25.0
"""Displacements by which that is so: the first few of an operator may all be taps."""
_STILL = 1e-9
_UNKNOWN = 1e-9
"""Usual displacement of an actuator that was never seen to move."""


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
    # neither could be NaN or infinite without the sum being so
    if not (np.abs(end) < _LARGEST).all() or not (np.abs(x) < _LARGEST).all():
        return "not_finite"
    lowest, highest = np.minimum(q, end), np.maximum(q, end)
    if (lowest < scales.lowest).any() or (highest > scales.highest).any():
        return "outside_limits"
    sign = np.array(category, dtype=np.float64)
    driven = sign != 0.0
    # where nothing is known of an actuator, any motion against its lever is too much
    moved = x / np.where(np.isnan(scales.usual), _UNKNOWN, scales.usual)
    if (sign * moved < -_AGAINST).any():
        return "against_lever"
    share = np.abs(moved)
    if share[driven].max() < _HARDLY and (share[~driven & scales.known] > _AGAINST).any():
        return "wrong_actuator"
    return None if scales.all_bounded else _too_far(driven, x, scales)


def _too_far(driven: npt.NDArray[np.bool_], x: FloatArray, scales: Scales) -> Refusal | None:
    known = driven & ~scales.bounded & (scales.count >= _WELL_KNOWN)
    return "impossible" if (np.abs(x) > _IMPOSSIBLE * scales.largest)[known].any() else None
