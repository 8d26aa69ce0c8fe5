"""When was something measured, on our own clock? Told from the stamps of the senders.

All senders stamp with one clock, whose distance from ours nobody knows. The machine's positions
show it: the freshest of them is not older than it looks. A message whose stamp lags behind
that clock is as old as its stamp says, however late it came; one that does not lag is as old as
its arrival says. A sender whose freshest message is stamped well ahead of that clock has another
one: how long any message of it was under way, nobody can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

LOSS = 1e-3
"""How much a sender's clock may lose on ours [s/s]: real ones run apart by far less, and one
position that came without delay is not held against the later ones for ever."""
_SPREAD_S = 0.3
"""What comes on a shorter way than the machine's positions looks that much ahead of them: ways that
differ by more are not to be told from clocks that differ [s]."""


@dataclass(frozen=True, slots=True)
class SenderClock:
    """How far a sender's clock is ahead of ours, as its freshest message shows it.

    Attributes:
        ahead_s: by so much [s]; None before the first message.
        at_s: arrival of the newest message [s].
    """

    ahead_s: float | None = None
    at_s: float = 0.0

    def followed(
        self, stamp_s: float, arrival_s: float, *, stamped: bool = True, loss: float = LOSS
    ) -> SenderClock:
        """The same after an accepted message; without a stamp of its own that tells nothing.

        Args:
            stamp_s: its stamp [s].
            arrival_s: when it came [s].
            stamped: it has one.
            loss: how much the sender's clock may lose on ours [s/s].
        """
        if not stamped:
            return self
        ahead_s = stamp_s - arrival_s
        if self.ahead_s is not None:
            ahead_s = max(ahead_s, self.ahead_s - loss * (arrival_s - self.at_s))
        return SenderClock(ahead_s, arrival_s)

    def measured_s(self, stamp_s: float, arrival_s: float) -> float:
        """Time of a measurement on our clock [s], never after its arrival."""
        if self.ahead_s is None:
            return arrival_s
        return min(arrival_s, stamp_s - self.ahead_s)

    def early_s(self, other: SenderClock) -> float | None:
        """How far another sender's clock is ahead [s], if further than one and the same can be.

        A message that was delayed does not hide it: the freshest one counts.
        """
        if self.ahead_s is None or other.ahead_s is None:
            return None
        early_s = other.ahead_s - self.ahead_s
        # while the machine is silent its clock runs on, and may run away from ours
        allowed_s = _SPREAD_S + LOSS * max(other.at_s - self.at_s, 0.0)
        return early_s if early_s > allowed_s else None
