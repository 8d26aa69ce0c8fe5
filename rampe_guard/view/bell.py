"""When the terminal's bell rings: a pure schedule (documentation, Colours and sounds).

A terminal has one tone, so levels differ by rhythm: `imminent` rings four times a second,
`warning` twice every two seconds, `caution` never. Where nobody is protected it rings like a
warning; since nobody can acknowledge for a guard that is gone, that turns after half a minute
into one reminder every half minute.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from rampe_guard.core.alarm import Level

_SLOT_S = 0.25
_WARNING_SLOTS = 8
_REMIND_AFTER_S = 30.0
"""No silence lasts longer, by design."""


@dataclass(frozen=True, slots=True)
class Bell:
    """What rings, and since when.

    Attributes:
        level: that rings; CLEAR: none.
        lost: nobody is protected somewhere.
        since_s: when this rhythm began [s].
        slot: the last quarter of a second in which it was asked.
    """

    level: Level = Level.CLEAR
    lost: bool = False
    since_s: float = 0.0
    slot: int = -1

    def ring(self, levels: Iterable[Level], now_s: float, *, lost: bool) -> tuple[Bell, bool]:
        """The next bell, and whether to ring it now.

        Args:
            levels: of the alerts that nobody has seen and nobody has silenced.
            now_s: now [s].
            lost: nobody is protected somewhere, and it was not acknowledged.
        """
        level = max(levels, default=Level.CLEAR)
        bell = self
        if (level, lost) != (self.level, self.lost):
            bell = Bell(level, lost, now_s)
        slot = math.floor((now_s - bell.since_s) / _SLOT_S)
        if slot == bell.slot:
            return bell, False
        return replace(bell, slot=slot), bell.sounds(slot)

    def sounds(self, slot: int) -> bool:
        """Whether this quarter of a second has a stroke."""
        if self.level is Level.IMMINENT:
            return True
        stroke = slot % _WARNING_SLOTS in {0, 1}
        if self.level is Level.WARNING:
            return stroke
        if not self.lost:
            return False
        remind = int(_REMIND_AFTER_S / _SLOT_S)
        return stroke if slot < remind else slot % remind == 0
