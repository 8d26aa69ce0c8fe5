"""Who wanted what of a guard, when, and what came of it: one line of the log each.

The name is what the sender says. That only those with a certificate for it can say anything at
all is the router's to hold; see the access list.
"""

from __future__ import annotations

from typing import Final

from rampe_guard.runtime.say import Sayer

_SHORT: Final = 200


class Audit:
    """Writes the lines; fields of the log hold the same for machines."""

    def __init__(self, say: Sayer) -> None:
        self._say = say
        self.granted = 0
        self.refused = 0

    def grant(self, command: str, who: str, what: str) -> None:
        """It was done."""
        self.granted += 1
        text = f"{command} by {who}: {what}"
        self._say.info(text, command=command, who=who, outcome="granted", detail=what)

    def refuse(self, command: str, who: str | None, why: str) -> None:
        """It was not done; ``who`` is None when that could not be read."""
        self.refused += 1
        why = why if len(why) <= _SHORT else f"{why[:_SHORT]}…"
        text = f"{command} by {who or 'nobody who can be read'}: refused: {why}"
        fields = {"command": command, "who": who, "outcome": "refused", "detail": why}
        self._say.warn(f"refused {command}", text, **fields)
