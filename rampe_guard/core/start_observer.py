"""ξ: what is observed beside q at the start of a primitive (the paper's optional part of y).

===============  =======  =====================================================================
``time``         1        time since the guard began [s]
``command_sum``  n        integral of each command since the previous primitive began [s]
``command``      n        filtered command when the category was recognised [-]
``speed``        n        speed then [share of the top speed]
===============  =======  =====================================================================
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.core.types import FloatArray


class StartObserver:
    """Follows lever and motion, and says ξ when a primitive starts.

    Args:
        actuators: n.
        names: what is to be observed; "q" is always there and no part of ξ.
    """

    def __init__(self, actuators: int, names: Sequence[str]) -> None:
        self._n = actuators
        self._names = tuple(name for name in names if name != "q")
        self.size = sum(1 if name == "time" else actuators for name in self._names)
        self._stamp_s: float | None = None
        self._last_s = 0.0
        self._sum: FloatArray = np.zeros(actuators)
        self._command: FloatArray = np.zeros(actuators)
        self._speed: FloatArray = np.zeros(actuators)

    def update(self, stamp_s: float, command: FloatArray, speed: FloatArray) -> None:
        """Take command (n,) [-] and speed (n,) [share of the top speed] at ``stamp_s``."""
        if self._stamp_s is not None:
            step = max(stamp_s - self._stamp_s, 0.0)
            self._last_s += step
            self._sum = self._sum + step * command
        self._stamp_s = stamp_s
        self._command, self._speed = command, speed

    def pause(self) -> None:
        """A sender's clock started anew: no time passes at this step."""
        self._stamp_s = None

    def start(self) -> FloatArray:
        """ξ for a primitive that starts now, in the order of the names."""
        values = {
            "time": np.array([self._last_s]),
            "command_sum": self._sum,
            "command": self._command,
            "speed": self._speed,
        }
        self._sum = np.zeros(self._n)
        return np.concatenate([np.zeros(0), *(values[name] for name in self._names)])
