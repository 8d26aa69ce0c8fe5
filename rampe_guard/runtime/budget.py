"""How many messages of one input are looked at: so many a second, and always the newest.

Reading a message costs the worker a tenth of a millisecond. A sender that publishes in a tight
loop must not keep it from sweeping, nor one input from hearing the other. So each input has a
budget of its own; what is beyond it is the oldest of what waits, and is counted as lost.
"""

from __future__ import annotations

BURST_S = 0.25
"""Messages of so long may come at once: a network that stood still delivers them together."""
FEW = 8
"""Of a flood no more are looked at in one turn: nothing is learned meanwhile, and a worker that
gets little of a busy computer must not spend it on them."""
FLOOD_S = 1.0
"""After the last loss it is a flood for so long."""
_LEAST = 16


class Budget:
    """Grows by ``rate_hz`` a second, up to a burst; time is passed in.

    Args:
        rate_hz: messages that may be looked at in the long run [1/s].
        now_s: when it begins [s].
    """

    def __init__(self, rate_hz: float, now_s: float) -> None:
        self._rate_hz = rate_hz
        self._most = self._left = max(rate_hz * BURST_S, float(_LEAST))
        self._at_s = now_s
        self._flood_until_s = float("-inf")

    def grant(self, waiting: int, now_s: float) -> int:
        """How many of so many messages may be looked at: the newest ones; one at least."""
        self._left = min(self._left + self._rate_hz * max(now_s - self._at_s, 0.0), self._most)
        self._at_s = now_s
        count = min(waiting, max(int(self._left), 1))
        if count < waiting:
            self._flood_until_s = now_s + FLOOD_S
        if now_s < self._flood_until_s:
            count = min(count, FEW)
        self._left = max(self._left - count, 0.0)
        return count
