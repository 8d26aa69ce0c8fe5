"""SIGINT and SIGTERM as one flag that loops look at and sleep on."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Self


class StopFlag:
    """Set once, never cleared. Calling it tells whether to stop."""

    def __init__(self) -> None:
        self._event = threading.Event()

    @classmethod
    def on_signals(cls) -> Self:
        """A flag that SIGINT and SIGTERM set (main thread only)."""
        flag = cls()

        def stop(_signal: int, _frame: FrameType | None) -> None:
            flag.set()

        signal.signal(signal.SIGINT, stop)
        signal.signal(signal.SIGTERM, stop)
        return flag

    def set(self) -> None:
        """Stop."""
        self._event.set()

    def wait(self, seconds: float) -> bool:
        """Sleep, but no longer than until the flag is set; returns whether it is."""
        return self._event.wait(seconds)

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._event.is_set()
