"""When the canary is asked, what it said last, and whether a failure was told for long enough."""

from __future__ import annotations

from typing import Protocol

from rampe_guard import wire

PERIOD_S = 2.0
"""Between two trials: each costs a millisecond or two."""
TELL_S = 1.5
"""How long a guard whose canary failed goes on to say so before it ends [s]."""


class Trial(Protocol):
    """What is asked; see `collision.canary.Canary`."""

    def check(self) -> str | None:
        """None if all answers are right, else what is wrong."""
        ...


class CanaryWatch:
    """Asks the canary from the worker loop, and remembers a failure for good.

    Args:
        canary: what is asked.
    """

    def __init__(self, canary: Trial) -> None:
        self._canary = canary
        self._asked_s: float | None = None
        self._failed_s: float | None = None

    def look(self, now_s: float) -> str | None:
        """What is wrong, when that is found; asks only if it is time to, and not once it failed."""
        due = self._asked_s is None or now_s - self._asked_s >= PERIOD_S
        if self._failed_s is not None or not due:
            return None
        self._asked_s = now_s
        fault = self._canary.check()
        if fault is not None:
            self._failed_s = now_s
        return fault

    def told(self, now_s: float) -> bool:
        """It failed, and that was said for long enough."""
        return self._failed_s is not None and now_s - self._failed_s >= TELL_S

    def trial(self, now_s: float) -> wire.CanaryTrial | None:
        """For the heartbeat; None before the first trial."""
        if self._asked_s is None:
            return None
        age_s = max(now_s - self._asked_s, 0.0)
        return wire.CanaryTrial(
            result="failed" if self._failed_s is not None else "ok", age_s=age_s
        )
