"""What a level looks like on a terminal: shape, word, colour, pulse (see Colours and sounds).

Grey when all is normal, nothing is ever green, and no meaning hangs on colour alone. Only what
nobody has acknowledged flashes, and only its shape: the words stay readable. The flashing is
done by drawing, since many terminals have no blinking of their own.
"""

from __future__ import annotations

import math

from rich.cells import cell_len, set_cell_size
from rich.text import Text

from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level

SHAPES = {Level.CLEAR: "·", Level.CAUTION: "◇", Level.WARNING: "△", Level.IMMINENT: "■"}
WORDS = {
    Level.CLEAR: "clear",
    Level.CAUTION: "caution",
    Level.WARNING: "WARNING",
    Level.IMMINENT: "IMMINENT",
}
STYLES = {
    Level.CLEAR: "grey62",
    Level.CAUTION: "yellow",
    Level.WARNING: "bold yellow",
    Level.IMMINENT: "bold #ffffff on #b00000",
}
PULSES_HZ = {Level.WARNING: 1.0, Level.IMMINENT: 4.0}
LOST_HZ = 1.0
GREY = "grey62"
DIM = "grey50"
ALARM = "bold #ffffff on #b00000"
LOST = "bold #ffffff on #8b008b"
LOST_TURNED = "bold #8b008b on #ffffff"
LOST_SHAPE = "✕"
HATCH = "╱"  # noqa: RUF001 - drawn, not written

PROTECTION = {
    Protection.MONITORING: ("monitoring", GREY),
    Protection.DEGRADED: ("△ DEGRADED", "bold yellow"),
    Protection.NOT_MONITORING: (f"{LOST_SHAPE} NOT MONITORING", LOST),
    Protection.UNAVAILABLE: (f"{LOST_SHAPE} PROTECTION UNAVAILABLE", LOST),
    Protection.MACHINE_OFF: ("○ machine off", GREY),
}
"""Words and style; what nobody can rely on is never grey."""
ALARMING = frozenset({Protection.NOT_MONITORING, Protection.UNAVAILABLE})
"""Nobody is protected, and somebody should be."""


def lit(rate_hz: float, now_s: float) -> bool:
    """Whether a pulse of this rate is in its bright half at ``now_s`` [s]."""
    return math.floor(2.0 * rate_hz * now_s) % 2 == 0


def level_text(level: Level, *, flashes: bool = False, now_s: float = 0.0) -> Text:
    """Shape and word of a level in its colour; in the dark half of its pulse without the shape."""
    dark = flashes and level in PULSES_HZ and not lit(PULSES_HZ[level], now_s)
    return Text(f" {' ' if dark else SHAPES[level]} {WORDS[level]} ", STYLES[level])


def hatched(words: str, width: int, *, turned: bool = False) -> Text:
    """``words`` in the middle of a hatched bar across ``width`` cells."""
    words = fit(f"  {words}  ", width) if words else ""
    left = (width - cell_len(words)) // 2
    right = width - cell_len(words) - left
    return Text(f"{HATCH * left}{words}{HATCH * right}", LOST_TURNED if turned else LOST)


def fit(text: str, width: int) -> str:
    """``text`` cut to ``width`` cells, with an ellipsis where something is missing."""
    return text if cell_len(text) <= width else f"{set_cell_size(text, max(0, width - 1))}…"


def countdown(seconds: float) -> str:
    """Time to collision, rounded down: no more is promised than there is."""
    tenths = max(0, math.floor(seconds * 10.0 + 1e-6))
    return f"in {tenths / 10.0:.1f} s" if tenths else "now"


def age(seconds: float) -> str:
    """How long ago."""
    minute, hour = 60.0, 3600.0
    if seconds < minute:
        return f"{max(0.0, seconds):.1f} s"
    return f"{seconds / minute:.0f} min" if seconds < hour else f"{seconds / hour:.0f} h"
