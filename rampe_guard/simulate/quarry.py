"""A day at the demo quarry: dig ahead, swing left, dump on the heap, swing back.

The figures belong to the excavator and the scene of the demo site: swing in [rad], cylinders
as stroke in [m]. A good cycle keeps clear of every margin. The slips do not: a swing that
does not stop in time gets to the wall, a boom pulled up instead of let down brings the
stretched arm to the power line.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.operator import Operator
from rampe_guard.simulate.work import Habits, Move, Overshoot, Waypoint

ACTUATORS = ("swing", "boom", "stick", "bucket")
START: FloatArray = np.array([0.0, 0.70, 0.20, 0.20])
"""Above the trench, arm stretched, bucket open."""

CYCLE = (
    Waypoint(
        "dig",
        (
            Move("boom", 0.60, 0.012),
            Move("stick", 0.38, 0.02, start_s=0.15),
            Move("bucket", 0.52, 0.03, start_s=0.25),
        ),
    ),
    Waypoint("lift", (Move("boom", 0.79, 0.015),)),
    Waypoint(
        "swing to heap",
        (Move("swing", 1.20, 0.02), Move("boom", 0.88, 0.015)),
        overshoot=Overshoot("swing", 0.40, 0.52),
    ),
    Waypoint("dump", (Move("bucket", 0.20, 0.03), Move("stick", 0.30, 0.02, start_s=0.2))),
    Waypoint(
        "return",
        (
            Move("swing", 0.0, 0.02),
            Move("stick", 0.20, 0.02, start_s=0.1),
            Move("boom", 0.70, 0.015, start_s=0.8),
        ),
        overshoot=Overshoot("boom", 0.44, 0.49),
    ),
)


def quarry_operator(
    actuators: Sequence[ActuatorConfig], seed: int, *, overshoot_probability: float = 0.2
) -> Operator:
    """Return an operator who works `CYCLE` on the machine of the demo site.

    Args:
        actuators: those of the demo site: `ACTUATORS`, in this order.
        seed: of his day.
        overshoot_probability: of a slip, per cycle.

    Raises:
        ValueError: the machine has other actuators.
    """
    names = tuple(a.name for a in actuators)
    if names != ACTUATORS:
        raise ValueError(f"the quarry needs a machine with {ACTUATORS}, not {names}")
    return Operator(
        actuators,
        CYCLE,
        seed,
        Habits(
            vigour=(0.9, 1.0), foresight=(0.9, 1.1), overshoot_probability=overshoot_probability
        ),
    )
