"""What daemons say: standard logging, and each kind of warning at most once a second."""

from __future__ import annotations

import logging
import time
from typing import Final, TypeAlias

from rampe_guard.runtime.log_lines import FIELDS, configure

__all__ = ["Field", "Sayer", "configure"]

Field: TypeAlias = str | float | bool | None
_PERIOD_S: Final = 1.0
_KINDS: Final = 256
"""Kinds whose last time is remembered; more cannot be there but by a mistake."""
_ANY: Final = "any other"


class Sayer:
    """Says things once a second per kind, and how many it held back meanwhile.

    Fields beside the text are for machines: ``--log-format json`` prints them.
    """

    def __init__(self, name: str) -> None:
        self._log = logging.getLogger(name)
        self._kinds: dict[str, tuple[float, int]] = {}

    def info(self, text: str, **fields: Field) -> None:
        """Say it."""
        self._log.info("%s", text, extra={FIELDS: fields})

    def warn(self, kind: str, text: str, **fields: Field) -> None:
        """Say it unless a warning of this kind was said within the last second."""
        now_s = time.monotonic()
        if kind not in self._kinds and not self._room(now_s):
            kind = _ANY
        said_s, held = self._kinds.get(kind, (float("-inf"), 0))
        if now_s - said_s < _PERIOD_S:
            self._kinds[kind] = said_s, held + 1
            return
        self._kinds[kind] = now_s, 0
        more = f" (and {held} more like it)" if held else ""
        beside = {"kind": kind, **fields, **({"held_back": held} if held else {})}
        self._log.warning("%s%s", text, more, extra={FIELDS: beside})

    def _room(self, now_s: float) -> bool:
        """Whether one more kind may be remembered; forgets those that say nothing any more."""
        if len(self._kinds) >= _KINDS:
            still = {k: v for k, v in self._kinds.items() if now_s - v[0] < _PERIOD_S}
            self._kinds = still
        return len(self._kinds) < _KINDS
