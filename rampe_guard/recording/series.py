"""OUT.mcap, OUT-0002.mcap, …: files that follow each other without a gap.

A file is finished when it is large or old enough, and when the disk refused it. The message that
comes next begins another.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rampe_guard.recording.channels import Channel
from rampe_guard.recording.writer import Entry, Head, McapFile

_MB = 1_000_000
_MINUTE_NS = 60 * 10**9


@dataclass(frozen=True, slots=True)
class Rotation:
    """When a file is enough.

    Attributes:
        bytes: of a file; it may grow beyond by what comes within half a second.
        after_ns: from its first message on [ns].
    """

    bytes: int
    after_ns: int

    @classmethod
    def of(cls, megabytes: float, minutes: float) -> Rotation:
        """From options of the command line."""
        return cls(int(megabytes * _MB), int(minutes * _MINUTE_NS))


class Series:
    """Writes batches of messages, each wholly or not at all.

    Args:
        out: the first file; a later one of the same name is never overwritten, but followed.
        channels: all that may come.
        head: makes the beginning of a file; told its number.
        rotation: when a file is enough.

    Attributes:
        begun: paths of all files, in order.
        messages: how many are safely on the disk.
    """

    def __init__(
        self,
        out: Path,
        channels: Sequence[Channel],
        head: Callable[[int], Head],
        rotation: Rotation,
    ) -> None:
        self._out, self._channels, self._head, self._rotation = out, channels, head, rotation
        self._file: McapFile | None = None
        self._closed_bytes = 0
        self._in_file = 0
        self._first_ns: int | None = None
        self.begun: list[Path] = []
        self.messages = 0

    @property
    def current(self) -> Path | None:
        """The file that is open."""
        return None if self._file is None else self._file.path

    @property
    def written_bytes(self) -> int:
        """Size of all files together."""
        return self._closed_bytes + (0 if self._file is None else self._file.size)

    def open(self) -> None:
        """Begin a file, if none is open.

        Raises:
            OSError: that cannot be done; there is no file.
        """
        if self._file is None:
            path = self._free_path()
            self._file = McapFile(path, self._channels, self._head(len(self.begun) + 1))
            self.begun.append(path)
            self._first_ns, self._in_file = None, 0

    def append(self, batch: Sequence[Entry]) -> None:
        """Bring a batch to the disk.

        Raises:
            OSError: it is not there, and no file is open any more; try again.
        """
        if not batch:
            return
        self.open()
        file = self._file
        assert file is not None  # noqa: S101 - just opened
        try:
            for entry in batch:
                file.add(entry)
            file.commit()
        except OSError:
            self._give_up(file)
            raise
        self.messages += len(batch)
        self._in_file += len(batch)
        if self._first_ns is None:
            self._first_ns = batch[0].at_ns
        if (
            file.size >= self._rotation.bytes
            or batch[-1].at_ns - self._first_ns >= self._rotation.after_ns
        ):
            self.finish({"reason": "rotated"})

    def begin_anew(self, words: Mapping[str, str]) -> None:
        """The next message begins a file; one without any message is no file at all.

        Raises:
            OSError: see `finish`.
        """
        file = self._file
        if file is None or self._in_file:
            self.finish(words)
            return
        self._file = None
        self.begun.pop()
        with contextlib.suppress(OSError):
            file.close()
        file.path.unlink(missing_ok=True)

    def finish(self, words: Mapping[str, str]) -> None:
        """Close the open file, if there is one, with its index.

        Raises:
            OSError: the index cannot be written; the file can be read without.
        """
        file, self._file = self._file, None
        if file is not None:
            try:
                file.finish({**words, "messages": str(self._in_file)})
            finally:
                self._closed_bytes += file.size

    def _give_up(self, file: McapFile) -> None:
        self._file = None
        self._closed_bytes += file.size
        with contextlib.suppress(OSError):
            file.close()

    def _free_path(self) -> Path:
        number = len(self.begun) + 1
        while (path := self._numbered(number)).exists():
            number += 1
        return path

    def _numbered(self, number: int) -> Path:
        if number == 1:
            return self._out
        return self._out.with_name(f"{self._out.stem}-{number:04d}{self._out.suffix}")
