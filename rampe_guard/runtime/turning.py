"""That the worker loop turns, told by the guard to its supervisor over a pipe.

A guard that hangs neither dies nor ends, so its supervisor would wait for ever. Its loop therefore
writes a byte every second. Nothing is expected before the first byte (loading and compiling take
as long as they take), nor after the word that the loop has ended.
"""

from __future__ import annotations

import contextlib
import os
import select
from collections.abc import Mapping, MutableMapping

PIPE = "RAMPE_GUARD_TURNING"
"""Environment: the file descriptor that the guard writes to."""
PERIOD_S = 1.0
HANG_LOOKS = 10
"""So many looks of `PERIOD_S` in a row without a byte are a hang. Looks are counted, not time: who
was stopped together with the guard must not find it hanging when both go on."""
_TURN, _END = b".", b"e"


class Turning:
    """The guard's end. No method ever waits or raises."""

    def __init__(self, environment: MutableMapping[str, str] | None = None) -> None:
        told = os.environ if environment is None else environment
        word = told.pop(PIPE, None)  # a process that this one starts is not the guard
        self._descriptor = None if word is None else int(word)
        self._told_s = float("-inf")
        if self._descriptor is not None:
            os.set_blocking(self._descriptor, False)
            os.set_inheritable(self._descriptor, False)  # noqa: FBT003 - the same

    def feed(self, now_s: float) -> None:
        """The loop turns; called at each turn.

        Args:
            now_s: monotonic time [s].
        """
        if now_s - self._told_s >= PERIOD_S:
            self._told_s = now_s
            self._write(_TURN)

    def end(self) -> None:
        """The loop has ended: saving and closing may take their time."""
        self._write(_END)

    def _write(self, word: bytes) -> None:
        if self._descriptor is not None:
            with contextlib.suppress(OSError):  # full, or nobody listens
                os.write(self._descriptor, word)


class Listener:
    """The supervisor's end, for one life of a guard.

    Attributes:
        turning: its loop has turned at least once.
    """

    def __init__(self, period_s: float = PERIOD_S, looks: int = HANG_LOOKS) -> None:
        self._period_s, self._looks = period_s, looks
        self._near, self.far = os.pipe()
        self.turning = self._over = False
        self._missed = 0

    def environment(self, base: Mapping[str, str]) -> dict[str, str]:
        """What the guard needs to know beside ``base``."""
        return {**base, PIPE: str(self.far)}

    def started(self) -> None:
        """The guard has its end: let go of ours, so that its death is heard."""
        os.close(self.far)
        self.far = -1

    def hangs(self) -> bool | None:
        """Listen for a while: whether the guard hangs; None when its end of the pipe is closed."""
        if not select.select([self._near], [], [], self._period_s)[0]:
            watched = self.turning and not self._over
            self._missed = self._missed + 1 if watched else 0
            return self._missed >= self._looks
        words = os.read(self._near, 4096)
        if not words:
            return None
        self._missed = 0
        self.turning = True
        self._over = self._over or _END in words
        return False

    def close(self) -> None:
        """This life is over."""
        os.close(self._near)
        if self.far >= 0:
            os.close(self.far)
