"""One MCAP file: what was committed is on the disk, whatever happens afterwards.

The library writes into memory; `McapFile.commit` takes that to the disk in one piece and waits
until it is there. If the disk refuses, the file is cut back to the last commit and given up: it
is whole up to there, and its reader needs no more.
"""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final, cast

import msgspec
from mcap.writer import CompressionType, Writer

from rampe_guard import __version__
from rampe_guard.recording.channels import Channel, encodings, schema_text

METADATA: Final = "rampe.recording"
END: Final = "rampe.recording.end"
FILES: Final = "files/"
"""Begins the names of attachments that are files of the site."""
MODEL: Final = "model/"
"""Begins the name of the attachment that is what was learned before."""
SITUATIONS: Final = "situations/"
"""Begins that of the situations that were remembered before."""
_MAX_NS = 2**63 - 1
_PRIVATE = 0o600
"""How a person works is nobody else's business."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A message as it came.

    Attributes:
        at_ns: when it arrived, on a clock that never goes back [ns since 1970].
        channel: for which channel.
        key: that it was really put on.
        payload: as it was on the wire.
        number: counts the messages of the channel, lost ones too.
    """

    at_ns: int
    channel: Channel
    key: str
    payload: bytes
    number: int = 0


@dataclass(frozen=True, slots=True)
class Head:
    """What stands at the beginning of a file, so that it explains itself.

    Attributes:
        metadata: words, by the name of the record and then by their own.
        attachments: content by name.
        at_ns: when it was made [ns since 1970].
    """

    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]
    at_ns: int = 0


@dataclass
class _Sink:
    """What the library writes into; the disk is for `McapFile` alone."""

    waiting: bytearray = field(default_factory=bytearray)
    written: int = 0

    def write(self, data: bytes) -> int:
        self.waiting += data
        return len(data)

    def tell(self) -> int:
        return self.written + len(self.waiting)

    def flush(self) -> None:
        """Nothing: a commit does."""


class McapFile:
    """A new file; `OSError` from any method means that it was given up, and is whole so far.

    Args:
        path: where there is no file yet.
        channels: all that may come, told at the beginning.
        head: what it begins with.
    """

    def __init__(self, path: Path, channels: Sequence[Channel], head: Head) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        self.path = path
        self._sink = _Sink()
        self._ids: dict[tuple[Channel, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._file = os.open(path, flags, _PRIVATE)
        try:
            self._mcap = Writer(cast("IO[Any]", self._sink), compression=CompressionType.ZSTD)
            self._mcap.start(profile="", library=f"rampe-guard {__version__}")
            for name, words in head.metadata.items():
                self._mcap.add_metadata(name, dict(words))
            for name, content in head.attachments.items():
                self._mcap.add_attachment(head.at_ns, head.at_ns, name, _media(name), content)
            for channel in channels:
                self._id(channel, channel.key)
            self.commit()
            _sync_folder(path.parent)
        except BaseException:
            os.close(self._file)
            with contextlib.suppress(OSError):
                path.unlink()  # a beginning that could not be written helps nobody
            raise

    @property
    def size(self) -> int:
        """Bytes on the disk."""
        return self._sink.written

    def add(self, entry: Entry) -> None:
        """Take a message; it is on the disk after the next `commit`."""
        self._mcap.add_message(
            self._id(entry.channel, entry.key),
            entry.at_ns,
            entry.payload,
            _sent_ns(entry),
            entry.number & 0xFFFFFFFF,
        )

    def commit(self) -> None:
        """Bring all that was taken to the disk.

        Raises:
            OSError: the disk does not take it; the file ends with the last commit.
        """
        if os.fstat(self._file).st_nlink == 0:  # it would be written for nobody
            raise FileNotFoundError(
                errno.ENOENT, "was deleted while it was written", str(self.path)
            )
        self._mcap.flush()
        self._to_disk()

    def finish(self, words: Mapping[str, str]) -> None:
        """Commit, write the index that lets readers seek, and close.

        Raises:
            OSError: the disk does not take it; the file can be read without.
        """
        try:
            self.commit()
            self._mcap.add_metadata(END, dict(words))
            self._mcap.finish()
            self._to_disk()
        finally:
            self.close()

    def close(self) -> None:
        """Leave the file as it is."""
        os.close(self._file)

    def _id(self, channel: Channel, key: str) -> int:
        found = self._ids.get((channel, key))
        if found is None:
            name, (schema, form) = channel.schema, encodings(channel)
            if name not in self._schemas:
                text = schema_text(name)
                self._schemas[name] = self._mcap.register_schema(name, schema, text)
            found = self._mcap.register_channel(key, form, self._schemas[name], channel.metadata)
            self._ids[channel, key] = found
        return found

    def _to_disk(self) -> None:
        waiting = memoryview(bytes(self._sink.waiting))
        try:
            while waiting:
                waiting = waiting[os.write(self._file, waiting) :]
            os.fsync(self._file)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._sink.written)
            raise OSError(error.errno, error.strerror, str(self.path)) from None
        self._sink.written += len(self._sink.waiting)
        self._sink.waiting.clear()


class _Times(msgspec.Struct):
    """Whatever a message says of when it was sent [s]."""

    stamp: float | None = None
    published_unix_s: float | None = None


_TIMES = msgspec.json.Decoder(_Times)


def _sent_ns(entry: Entry) -> int:
    """When the sender says that it was sent, on his clock [ns]; else its arrival."""
    try:
        said = _TIMES.decode(entry.payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return entry.at_ns
    sent_s = said.stamp if said.published_unix_s is None else said.published_unix_s
    if sent_s is None or not 0.0 <= sent_s * 1e9 < _MAX_NS:
        return entry.at_ns
    return int(sent_s * 1e9)


def _media(name: str) -> str:
    kinds = {".yaml": "application/yaml", ".yml": "application/yaml", ".urdf": "application/xml"}
    return kinds.get(Path(name).suffix, "application/octet-stream")


def _sync_folder(folder: Path) -> None:
    """A new name is on the disk only when its folder is."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
