"""What a level looks like: colour, and beside it always a shape and a word.

========  =======  ==============  ===================================
tone      shape    colour          pulse while nobody has acknowledged
========  =======  ==============  ===================================
calm      ·        grey            none
caution   ◇        yellow          none
warning   △        yellow          once a second
imminent  ■        red             four times a second
lost      ✕        magenta/white   once a second (the banner's shape)
off       ○        grey            none
========  =======  ==============  ===================================

It is the table "Colours and sounds" of the documentation.

Nothing is green. What nobody watches over has no colour at all but the banner's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from rampe_guard.core.alarm import Level

Rgb: TypeAlias = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Look:
    """How a tone is shown.

    Attributes:
        name: of its style class.
        shape: one character.
        word: one or two words.
        lit: colour in the scene, day and night.
        dim: the other colour of a pulse.
        pulse_hz: pulses per second while unacknowledged [1/s]; 0 = steady.
    """

    name: str
    shape: str
    word: str
    lit: Rgb
    dim: Rgb
    pulse_hz: float = 0.0


class Tone(Enum):
    """Everything that a thing on the page can be."""

    CALM = Look("calm", "·", "clear", (139, 145, 153), (139, 145, 153))
    CAUTION = Look("caution", "◇", "CAUTION", (240, 196, 0), (240, 196, 0))
    WARNING = Look("warning", "△", "WARNING", (255, 186, 0), (168, 118, 0), 1.0)
    IMMINENT = Look("imminent", "■", "IMMINENT", (226, 18, 24), (112, 0, 6), 4.0)
    LOST = Look("lost", "✕", "NOT MONITORING", (84, 86, 90), (84, 86, 90), 1.0)
    OFF = Look("off", "○", "MACHINE OFF", (84, 86, 90), (84, 86, 90))

    @property
    def look(self) -> Look:
        """How it is shown."""
        return self.value

    def lit(self, now_s: float, *, attention: bool) -> bool:
        """Whether the bright half of a pulse is shown now; always, if it does not pulse."""
        return not attention or self.look.pulse_hz == 0.0 or now_s * self.look.pulse_hz % 1.0 < 0.5  # noqa: PLR2004 - half of it

    def colour(self, *, lit: bool) -> Rgb:
        """Of things in the scene."""
        return self.look.lit if lit else self.look.dim


BY_LEVEL = {
    Level.CLEAR: Tone.CALM,
    Level.CAUTION: Tone.CAUTION,
    Level.WARNING: Tone.WARNING,
    Level.IMMINENT: Tone.IMMINENT,
}
