"""SIGINT, SIGTERM and SIGHUP as one flag that loops look at and sleep on.

Long work that never looks at the flag (meshes to load, say) is broken off where it stands.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from types import FrameType
from typing import Self, TypeVar

T = TypeVar("T")


class _BrokenOff(BaseException):
    """Not an `Exception`: no handler of errors on the way may take it for one."""


_SLICE_S = 0.05
"""Longest sleep between two looks at the flag."""


class StopFlag:
    """Set once, never cleared. Calling it tells whether to stop.

    A plain boolean, on purpose: a signal handler runs in the middle of whatever the main
    thread does, and a `threading.Event` that is set there while the same thread waits on it
    waits for its own lock for ever.
    """

    def __init__(self) -> None:
        self._stopped = False
        self._at_once = False

    @classmethod
    def on_signals(cls) -> Self:
        """A flag that SIGINT, SIGTERM and SIGHUP set (main thread only)."""
        flag = cls()

        def stop(_signal: int, _frame: FrameType | None) -> None:
            flag.set()
            if flag._at_once:
                flag._at_once = False
                raise _BrokenOff

        signal.signal(signal.SIGINT, stop)
        signal.signal(signal.SIGTERM, stop)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup wants it ignored
            signal.signal(signal.SIGHUP, stop)  # else a closed terminal leaves our children
        return flag

    def set(self) -> None:
        """Stop."""
        self._stopped = True

    def unless_stopped(self, work: Callable[[], T]) -> T | None:
        """The result of ``work()``; None if a signal came before or meanwhile.

        Only for work that may end anywhere: it holds no lock, file or session. Libraries on the
        way may swallow what breaks it off, or raise an error of their own for it: once the flag
        is set, neither a result nor an error is worth anything.
        """
        try:
            self._at_once = True
            result = None if self() else work()
        except _BrokenOff:
            return None
        except Exception:
            if self():
                return None
            raise
        else:
            return None if self() else result
        finally:
            self._at_once = False

    def wait(self, seconds: float) -> bool:
        """Sleep, but little longer than until the flag is set; returns whether it is."""
        until_s = time.monotonic() + seconds
        while not self._stopped and (left_s := until_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, _SLICE_S))
        return self._stopped

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._stopped
