"""For machine controllers that follow the guard's speed advice.

::

    shaper = CommandShaper(("swing", "boom"))
    shaper.take(payload, now_s)             # whatever comes on {base}/advice
    command = shaper.shape(command, now_s)  # at every turn of the control loop

No clock, no network: time is passed in, on the clock with which the machine stamps its positions:
advice is as old as the position that it is about, however long it was under way. What cannot be
(a stamp from the future, a time that goes back, a command that is no number) frees no lever.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard import wire
from rampe_guard.core.types import FloatArray

LONGEST_S = 2.0
"""No advice is followed for longer [s], whatever it says: no site file allows more."""
_AHEAD_S = 0.1
"""Stamps are the machine's own: none can be further ahead of its clock [s]."""


class CommandShaper:
    """Keeps commands within the newest advice.

    Args:
        actuators: names, in the order of the commands.
        without: largest share of the top speed while there is no fresh advice; 0 stands still.

    Raises:
        ValueError: ``without`` is not from 0 to 1.
    """

    def __init__(self, actuators: Sequence[str], without: float = 0.0) -> None:
        if not 0.0 <= without <= 1.0:
            raise ValueError(f"without={without} must be from 0 to 1")
        self._names, self._without = tuple(actuators), without
        self._most: FloatArray | None = None
        self._until_s = self._now_s = float("-inf")
        self._order: tuple[str, int] = ("", 0)

    def take(self, payload: bytes, now_s: float) -> wire.Advice:
        """Take a message as it came; returns what it says.

        Args:
            payload: JSON.
            now_s: on the clock of the machine's stamps [s].

        Raises:
            MessageError: it is no advice; what was taken before stays in force while it is fresh.
        """
        advice = wire.decode(payload, wire.Advice)
        boot, seq = self._order
        if advice.boot_id == boot and advice.seq <= seq:  # overtaken on its way
            return advice
        self._order = advice.boot_id, advice.seq
        self._most = self._shares(advice)
        about_s = now_s if advice.stamp is None else advice.stamp
        possible = about_s <= now_s + _AHEAD_S  # and a number, both
        holds_s = min(advice.expires_after_s, LONGEST_S)
        self._until_s = min(about_s, now_s) + holds_s if possible else float("-inf")
        self._now_s = now_s
        return advice

    def advised(self, now_s: float) -> bool:
        """Whether there is advice that may be followed."""
        return self._fresh(now_s) is not None

    def shape(self, command: FloatArray, now_s: float) -> FloatArray:
        """The command (n,) in [-1, 1] along the actuators, no larger than advised.

        What is no number in it becomes 0.

        Raises:
            ValueError: it is not one number for each actuator.
        """
        command = np.asarray(command, dtype=float)
        if command.shape != (len(self._names),):
            raise ValueError(f"command {command.shape}: {len(self._names)} actuators advised")
        command = np.nan_to_num(command, nan=0.0)
        most = self._fresh(now_s)
        if most is None:
            return np.clip(command, -self._without, self._without)
        return np.clip(command, -most[:, 0], most[:, 1])

    def _fresh(self, now_s: float) -> FloatArray | None:
        """Shares that hold now; time does not go back, so what was too old stays so."""
        if not now_s >= self._now_s:  # nor when it is no number
            now_s = self._now_s if np.isfinite(now_s) else np.inf
        self._now_s = now_s
        return self._most if now_s <= self._until_s else None

    def _shares(self, advice: wire.Advice) -> FloatArray | None:
        told = advice.actuators
        if told is None or any(name not in told for name in self._names):
            return None
        return np.array(
            [(told[name].negative_share, told[name].positive_share) for name in self._names]
        )
