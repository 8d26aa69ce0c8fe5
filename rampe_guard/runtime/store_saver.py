"""The thread that brings models to the disk, so that the worker loop never waits for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.store import ModelFile

_Mark = TypeVar("_Mark")


@dataclass(frozen=True, slots=True)
class Save(Generic[_Mark]):
    """One state of what was learned.

    Attributes:
        content: makes the bytes of the file, in the saver's thread.
        mark: what the state is told by.
    """

    content: Callable[[], bytes]
    mark: _Mark


class Saver(Generic[_Mark]):
    """Writes the newest `Save` that it was given; two never at once, older ones never after.

    Attributes:
        taken: mark of the file as it is, or will be once what was given is written.
        problem: why the last save failed; None if it did not.
        failures: saves that failed so far.
    """

    def __init__(self, file: ModelFile, saved: _Mark) -> None:
        self.taken = self._saved = saved
        self.problem: str | None = None
        self.failures = 0
        self._file = file
        self._next: Save[_Mark] | None = None
        self._over = False
        self._changed = threading.Condition()
        # a daemon: a disk that hangs must not keep the process from ending
        self._thread = threading.Thread(target=self._work, name="model-saver", daemon=True)
        self._thread.start()

    def give(self, save: Save[_Mark]) -> None:
        """Have it written as soon as the disk is free, instead of one that still waits."""
        with self._changed:
            self._next = save
            self.taken = save.mark
            self._changed.notify()

    def finish(self, within_s: float) -> bool:
        """Write what still waits and end; False if the disk did not follow in time."""
        with self._changed:
            self._over = True
            self._changed.notify()
        self._thread.join(within_s)
        return not self._thread.is_alive()

    def _work(self) -> None:
        while (save := self._wait()) is not None:
            try:
                self._file.write(save.content())
            except (ModelFileError, ValueError, MemoryError) as error:
                self._failed(str(error) or type(error).__name__)
            except Exception as error:  # noqa: BLE001 - else nothing would be kept, without a word
                self._failed(repr(error))
            else:
                self._saved = save.mark
                self.problem = None

    def _failed(self, problem: str) -> None:
        self.failures += 1
        self.problem = problem
        self.taken = self._saved  # to be given again

    def _wait(self) -> Save[_Mark] | None:
        with self._changed:
            while self._next is None and not self._over:
                self._changed.wait()
            save, self._next = self._next, None
            return save
