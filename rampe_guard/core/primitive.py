"""Motion primitives: flow-chart blocks 1 (change), 3 (length) and 4 (move the start on).

A primitive is a stretch during which the category Ω is constant. Its start point q[k] is
where the arm was when Ω first appeared, its displacement x = q(end) - q[k]. Static
stretches (Ω = 0) separate primitives and are none themselves.

::

    state      | category change to Ω ≠ 0        | change to 0     | interrupt
    -----------+---------------------------------+-----------------+--------------------------
    resting    | start                           | -               | -
    moving     | end (block 3), start (block 4)  | end (block 3)   | current one is not learned

An interrupted primitive (inputs were missing or refused meanwhile) still ends, but says so:
its length is not what the operator meant.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.joystick import CategoryChange
from rampe_guard.core.types import Category, FloatArray

_HISTORY_S = 2.0
"""How far back a change can be dated [s]: far longer than any debounce."""


@dataclass(frozen=True, slots=True)
class Primitive:
    """A primitive under way: Ω, start point q[k] (n,), start time [s]."""

    category: Category
    start: FloatArray
    start_s: float


@dataclass(frozen=True, slots=True)
class FinishedPrimitive:
    """A primitive that ended with displacement x (n,) at ``end_s`` [s].

    ``complete`` is False when inputs were missing meanwhile: not to be learned from.
    """

    primitive: Primitive
    displacement: FloatArray
    end_s: float
    complete: bool


class PrimitiveTracker:
    """Turns positions and category changes into primitives.

    Attributes:
        current: the primitive under way, or None.
    """

    def __init__(self) -> None:
        self.current: Primitive | None = None
        self._complete = True
        self._history: deque[tuple[float, FloatArray]] = deque()

    def position(self, stamp_s: float, q: FloatArray) -> None:
        """Take the actuator position q (n,) at ``stamp_s`` (increasing)."""
        self._history.append((stamp_s, q))
        while self._history[0][0] < stamp_s - _HISTORY_S and len(self._history) > 1:
            self._history.popleft()

    def change(self, change: CategoryChange) -> FinishedPrimitive | None:
        """Take a category change; returns the primitive that it ended, if any."""
        at = self.position_at(change.since_s)
        finished = None
        if self.current is not None and at is not None:
            x = at - self.current.start  # block 3
            finished = FinishedPrimitive(self.current, x, change.since_s, self._complete)
        self.current = None
        self._complete = True
        if at is not None and any(change.category):
            self.current = Primitive(change.category, at, change.since_s)  # block 4
        return finished

    def interrupt(self) -> None:
        """Mark the primitive under way as not fit to learn from."""
        self._complete = False

    def reset(self) -> None:
        """Forget everything (the clock or the position jumped)."""
        self.current = None
        self._history.clear()

    def position_at(self, stamp_s: float) -> FloatArray | None:
        """Position at ``stamp_s``, linear between samples; None without any sample."""
        if not self._history:
            return None
        times = np.array([t for t, _ in self._history])
        after = int(np.searchsorted(times, stamp_s))
        if after == 0:
            return self._history[0][1]
        if after == len(times):
            return self._history[-1][1]
        (t0, q0), (t1, q1) = self._history[after - 1], self._history[after]
        return q0 + (q1 - q0) * ((stamp_s - t0) / (t1 - t0))
