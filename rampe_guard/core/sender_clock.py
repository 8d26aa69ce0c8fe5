"""When was something measured, on our own clock? Told from the stamps of the senders.

All senders stamp with one clock, whose distance from ours nobody knows. The machine's positions
show it: the freshest of them is not older than it looks. A message whose stamp lags behind
that clock is as old as its stamp says, however late it came; one that does not lag is as old as
its arrival says.
"""

from __future__ import annotations

_DRIFT = 1e-3
"""How much the distance may shrink by [s/s]: clocks run apart by far less, and one position
that came without delay is not held against the later ones for ever."""


class SenderClock:
    """How far the senders' clock is ahead of ours, as the freshest message shows it."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._at_s = 0.0

    def follow(self, stamp_s: float, arrival_s: float) -> None:
        """Take an accepted message of the machine."""
        ahead_s = stamp_s - arrival_s
        if self._ahead_s is not None:
            ahead_s = max(ahead_s, self._ahead_s - _DRIFT * (arrival_s - self._at_s))
        self._ahead_s, self._at_s = ahead_s, arrival_s

    def restart(self) -> None:
        """The machine's clock was set anew."""
        self._ahead_s = None

    def measured_s(self, stamp_s: float, arrival_s: float) -> float:
        """Time of a measurement on our clock [s], never after its arrival."""
        if self._ahead_s is None:
            return arrival_s
        return min(arrival_s, stamp_s - self._ahead_s)
