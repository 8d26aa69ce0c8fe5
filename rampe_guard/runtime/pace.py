"""Whether the guard keeps up: how long its steps take, and whether it stood still.

Nothing queues up, since each step takes the newest state; so a guard that is too slow is one
whose alerts come late. That is said when it would be felt, not at every hiccup.
"""

from __future__ import annotations

from collections import deque

from rampe_guard import wire
from rampe_guard.core.monitor import RECENT_S

SLOW_MS = 100.0
"""A step that takes longer costs a person a third of the time in which he can react."""
_SHARE = 0.1
_LEAST = 3
STILL_S = 1.0
"""Without a turn of the loop for so long there was no heartbeat either."""


class Pace:
    """Told of every turn of the worker loop and of every step; time is passed in."""

    def __init__(self) -> None:
        self._steps: deque[tuple[float, float]] = deque(maxlen=10_000)
        self._turned_s: float | None = None
        self._still: tuple[float, float] | None = None

    def turn(self, now_s: float) -> None:
        """The loop begins another turn."""
        if self._turned_s is not None and (gap_s := now_s - self._turned_s) > STILL_S:
            self._still = now_s, gap_s
        self._turned_s = now_s

    def step(self, now_s: float, took_ms: float) -> None:
        """A step that began at ``now_s`` [s] took so long [ms]."""
        self._steps.append((now_s, took_ms))

    def reasons(self, now_s: float) -> list[wire.Reason]:
        """Why alerts come late, or did."""
        found = []
        if self._still is not None and now_s - self._still[0] <= RECENT_S:
            text = f"the guard stood still for {self._still[1]:.1f} s: is its computer overloaded?"
            found.append(wire.Reason(code="stalled", text=text, key=None))
        while self._steps and self._steps[0][0] < now_s - RECENT_S:
            self._steps.popleft()
        slow = sorted(ms for _, ms in self._steps if ms > SLOW_MS)
        if len(slow) >= max(_LEAST, _SHARE * len(self._steps)):
            text = (
                f"{len(slow)} of {len(self._steps)} steps in {RECENT_S:g} s took {slow[0]:.0f} to"
                f" {slow[-1]:.0f} ms: alerts come that much later"
            )
            found.append(wire.Reason(code="slow", text=text, key=None))
        return found
