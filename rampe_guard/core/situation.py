"""A situation: where the arm is, how it moves, and what the lever commands, as one point.

The coordinates are all in the same measure, so that their distance says how alike two situations
are. A position counts in seconds of travel at the actuator's top speed, which is the same on a
bench machine as on a crane; speed and lever count as shares of what there can be.

    (q / (2.5 s · v_max),  0.2 · v / v_max,  0.6 · u,  0.6 · min(rest / 4 s, 1))

The last is how long nothing was pushed and nothing moved: who pauses does not always go on as who
stops for a moment. The command carries the category (its signs) and how hard it is meant; the lever
and the speed together carry how far the primitive has come.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from rampe_guard.core.types import FloatArray

TRAVEL_S: Final = 2.5
"""Positions this far apart at top speed are as unlike as situations get [s]."""
_SPEED: Final = 0.2
_LEVER: Final = 0.6
_REST: Final = 0.6
_REST_S: Final = 4.0


class Likeness:
    """Makes points of situations, for n actuators.

    Args:
        top: top speeds (n,) [unit/s].

    Attributes:
        travel: displacements that count as one (n,) [unit].
        size: coordinates of a point, 3n + 1.
    """

    def __init__(self, top: FloatArray) -> None:
        self.travel = TRAVEL_S * top
        self._top = top
        self.size = 3 * len(top) + 1

    def point(
        self,
        position: FloatArray,
        velocity: FloatArray,
        command: FloatArray,
        rest_s: float = 0.0,
    ) -> FloatArray:
        """The situation's point (3n + 1,), from position, velocity, command (n,) and rest [s]."""
        return np.concatenate(
            (
                position / self.travel,
                _SPEED * np.clip(velocity / self._top, -2.0, 2.0),
                _LEVER * np.clip(command, -1.0, 1.0),
                (_REST * min(rest_s / _REST_S, 1.0),),
            )
        )
