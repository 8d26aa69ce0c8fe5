"""The daemon's log: standard logging, and each kind of warning at most once a second."""

from __future__ import annotations

import logging
import time
from collections import Counter

_PERIOD_S = 1.0


class Sayer:
    """Says things once a second per kind, and how many it held back meanwhile."""

    def __init__(self, name: str) -> None:
        self._log = logging.getLogger(name)
        self._said_s: dict[str, float] = {}
        self._held: Counter[str] = Counter()

    def info(self, text: str) -> None:
        """Say it."""
        self._log.info(text)

    def warn(self, kind: str, text: str) -> None:
        """Say it unless a warning of this kind was said within the last second."""
        now_s = time.monotonic()
        if now_s - self._said_s.get(kind, float("-inf")) < _PERIOD_S:
            self._held[kind] += 1
            return
        self._said_s[kind] = now_s
        held = self._held.pop(kind, 0)
        self._log.warning("%s%s", text, f" (and {held} more like it)" if held else "")


def configure(level: int = logging.INFO) -> None:
    """Log to stderr with local time; called by commands, never by the library."""
    logging.basicConfig(level=level, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
