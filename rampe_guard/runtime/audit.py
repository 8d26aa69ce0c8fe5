"""Who wanted what of a guard, when, and what came of it: one line of the log each.

The name is what the sender says. That only those with a certificate for it can say anything at
all is the router's to hold; see the access list.

Wishes that are granted are always written. Those that are refused are too, up to `_MOST` in a
second: whoever sends more floods the log, and is written down as a number, by command. All are
counted in the heartbeat.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

from rampe_guard import wire
from rampe_guard.runtime.say import Sayer

_MOST: Final = 20
_PERIOD_S: Final = 1.0
_SHORT: Final = 200
_NOBODY: Final = "nobody who can be read"


class Audit:
    """Writes the lines; fields of the log hold the same for machines."""

    def __init__(self, say: Sayer) -> None:
        self._say = say
        self._granted: Counter[str] = Counter()
        self._refused: Counter[str] = Counter()
        self._since_s = float("-inf")
        self._written = 0
        self._held: Counter[str] = Counter()

    @property
    def counts(self) -> wire.Commands:
        """Since the boot, by command."""
        return wire.Commands(granted=dict(self._granted), refused=dict(self._refused))

    def grant(self, command: str, who: str, what: str) -> None:
        """It was done."""
        self._granted[command] += 1
        text = f"{command} by {who}: {what}"
        self._say.info(text, command=command, who=who, outcome="granted", detail=what)

    def refuse(self, command: str, who: str | None, why: str, now_s: float) -> None:
        """It was not done; ``who`` is None when that could not be read."""
        self._refused[command] += 1
        self.turn(now_s)
        if self._written >= _MOST:
            self._held[command] += 1
            return
        self._written += 1
        why = why if len(why) <= _SHORT else f"{why[:_SHORT]}…"
        text = f"{command} by {who or _NOBODY}: refused: {why}"
        self._say.info(text, command=command, who=who, outcome="refused", detail=why)

    def turn(self, now_s: float) -> None:
        """Say what was held back, once a second."""
        if now_s - self._since_s < _PERIOD_S:
            return
        self._since_s, self._written = now_s, 0
        if self._held:
            held = ", ".join(f"{count} {command}" for command, count in self._held.items())
            self._say.info(f"refused within a second, and not written down: {held}")
            self._held.clear()
