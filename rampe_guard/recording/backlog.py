"""Messages between the thread that receives them and the one that writes them: bounded, counted."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from itertools import islice

from rampe_guard.recording.writer import Entry

MAX_BYTES = 128 * 1024 * 1024
"""Some ten minutes of a busy machine: so long may a disk be full without a loss."""
_MAX_BATCH = 4096
_OVERHEAD_BYTES = 300
"""Of an entry beside its payload."""


class Backlog:
    """What waits to be written, oldest first. When full, what comes is dropped, and counted.

    What waits is kept and what comes is not, since what waits continues the last file: the
    recording then has one gap, from a moment on that is told.

    Args:
        max_bytes: that may wait.
    """

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._waiting: deque[Entry] = deque()
        self._bytes = 0
        self._dropped = 0

    @property
    def dropped(self) -> int:
        """Messages lost so far, since there was no room."""
        return self._dropped

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, entries: Sequence[Entry]) -> None:
        """Have entries written some time."""
        with self._lock:
            for entry in entries:
                size = len(entry.payload) + _OVERHEAD_BYTES
                if self._bytes + size > self._max_bytes:
                    self._dropped += 1
                    continue
                self._bytes += size
                self._waiting.append(entry)

    def first(self) -> list[Entry]:
        """The oldest; they stay until `written`. What arrived at once is not torn apart."""
        with self._lock:
            batch = list(islice(self._waiting, _MAX_BATCH))
            for entry in islice(self._waiting, len(batch), None):
                if entry.at_ns != batch[-1].at_ns:
                    break
                batch.append(entry)
        return batch

    def written(self, count: int) -> None:
        """So many of the oldest are safe."""
        with self._lock:
            for _ in range(count):
                self._bytes -= len(self._waiting.popleft().payload) + _OVERHEAD_BYTES

    def give_up(self) -> None:
        """Nothing that waits will ever be written."""
        with self._lock:
            self._dropped += len(self._waiting)
            self._waiting.clear()
            self._bytes = 0
