"""MCAP files, whole or not: whatever is read is what was written, up to where the file is whole.

A recorder that was killed leaves a file without its end. All records are measured and proven by
their checksums when a file is opened; what follows the last good one is left out, with a warning.
"""

from __future__ import annotations

import contextlib
import io
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Final

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    McapRecord,
    Message,
    Metadata,
    Schema,
    Statistics,
)
from mcap.stream_reader import breakup_chunk, get_chunk_data_stream

from rampe_guard.errors import LogError

MAGIC: Final = bytes([137, 77, 67, 65, 80, 48, 13, 10])
MAX_CHUNK: Final = 256 * 2**20
"""Of a chunk as its messages are [bytes]; recorders write some megabytes."""
_RECORD = struct.Struct("<BQ")
_PROVEN: Final = (Opcode.ATTACHMENT, Opcode.CHUNK)
"""Records with a checksum."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message of a file: when it arrived [ns since 1970], on which channel, and its bytes."""

    at_ns: int
    channel: Channel
    payload: bytes


class McapReading:
    """A recording; opening it reads all of it once.

    Args:
        path: of the file.

    Attributes:
        path: as given.
        warnings: what was left out, if anything.
        metadata: records of words by name; the last of each name.
        channels: those that hold messages.
        types: names of the schemas of their messages, by the number in a channel.
        counts: messages by topic.
        first_ns: of the first message [ns since 1970].
        last_ns: of the last.

    Raises:
        LogError: it is no MCAP file, holds no message, or its messages are not in order of time.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = str(path)
        self.metadata: dict[str, dict[str, str]] = {}
        self.channels: dict[int, Channel] = {}
        self.types: dict[int, str] = {}
        self.counts: Counter[str] = Counter()
        try:
            with Path(path).open("rb") as file:
                self._end, problem = _whole(file, self.path)
                told = None if problem else _told_count(file, self._end)
        except OSError as error:
            raise LogError(f"{path}: cannot be read: {error.strerror}") from None
        self.warnings: tuple[str, ...] = (f"{path}: {problem}",) if problem else ()
        try:
            self.first_ns, self.last_ns = self._survey()
        except (McapError, ValueError, struct.error) as error:
            raise LogError(f"{path}: is damaged: {type(error).__name__}: {error}") from None
        if told is not None and told != self.counts.total():
            text = f"is damaged: it holds {self.counts.total()} messages, and says {told}"
            self.warnings = (f"{path}: {text}",)

    def messages(self) -> Iterator[Recorded]:
        """All messages in the order in which they arrived."""
        channels: dict[int, Channel] = {}
        for record in self._data():
            if isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Schema):
                self.types[record.id] = record.name
            elif isinstance(record, Message):
                channel = channels.get(record.channel_id)
                if channel is None:
                    raise LogError(
                        f"{self.path}: a message is of the unknown channel {record.channel_id}"
                    )
                yield Recorded(record.log_time, channel, record.data)

    def contents(self, prefix: str) -> dict[str, bytes]:
        """All attachments whose names begin with ``prefix``, without it."""
        records = self._records(Opcode.ATTACHMENT)
        found = (Attachment.read(_stream(content)) for _, content in records)
        return {a.name.removeprefix(prefix): a.data for a in found if a.name.startswith(prefix)}

    def _survey(self) -> tuple[int, int]:
        """Look at all of it; the times of the first and the last message [ns since 1970]."""
        for _, content in self._records(Opcode.METADATA):
            words = Metadata.read(_stream(content))
            self.metadata[words.name] = words.metadata
        first_ns = last_ns = None
        for message in self.messages():
            self.channels[message.channel.id] = message.channel
            self.counts[message.channel.topic] += 1
            if last_ns is not None and message.at_ns < last_ns:
                raise LogError(
                    f"{self.path}: messages are not in order of time: {message.at_ns} ns follows"
                    f" {last_ns} ns; sort the file first"
                )
            last_ns = message.at_ns
            first_ns = last_ns if first_ns is None else first_ns
        if first_ns is None or last_ns is None:
            raise LogError("; ".join([*self.warnings, f"{self.path}: holds no message"]))
        return first_ns, last_ns

    def _data(self) -> Iterator[McapRecord]:
        """Schemas, channels and messages, in chunks or not."""
        wanted = Opcode.CHUNK, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE
        for opcode, content in self._records(*wanted):
            if opcode == Opcode.CHUNK:
                yield from breakup_chunk(unpacked(Chunk.read(_stream(content))))
            elif opcode == Opcode.SCHEMA:
                yield Schema.read(_stream(content))
            elif opcode == Opcode.CHANNEL:
                yield Channel.read(_stream(content))
            else:
                yield Message.read(_stream(content), len(content))

    def _records(self, *opcodes: Opcode) -> Iterator[tuple[int, bytes]]:
        """Records of some kinds, from the part of the file that is whole."""
        try:
            with Path(self.path).open("rb") as file:
                for opcode, at, length in _frames(file, self._end):
                    if opcode in opcodes:
                        file.seek(at)
                        yield opcode, file.read(length)
        except OSError as error:
            raise LogError(f"{self.path}: cannot be read: {error.strerror}") from None


def _frames(file: IO[bytes], end: int, start: int = len(MAGIC)) -> Iterator[tuple[int, int, int]]:
    """Opcode of each record up to ``end``, and where its content is: offset and length."""
    at = start
    while at < end:
        file.seek(at)
        opcode, length = _RECORD.unpack(file.read(_RECORD.size))
        yield opcode, at + _RECORD.size, length
        at += _RECORD.size + length


def _whole(file: IO[bytes], path: str) -> tuple[int, str]:
    """Where the good part of a file ends, and what is wrong with the rest (empty: nothing)."""
    if file.read(len(MAGIC)) != MAGIC:
        raise LogError(f"{path}: is no MCAP file")
    size = file.seek(0, io.SEEK_END)
    at = len(MAGIC)
    while True:
        file.seek(at)
        head = file.read(_RECORD.size)
        opcode, length = _RECORD.unpack(head) if len(head) == _RECORD.size else (0, 0)
        if opcode == Opcode.DATA_END:
            return at, ""
        if opcode == 0 or at + _RECORD.size + length > size:  # a lost power leaves zeros
            return at, f"was not finished: it is read up to byte {at} of {size}"
        if opcode in _PROVEN and (why := _flaw(opcode, file.read(length))):
            return at, f"is damaged at byte {at} ({why}): what follows is left out"
        at += _RECORD.size + length


def _told_count(file: IO[bytes], end: int) -> int | None:
    """How many messages a file says that it holds, behind its data; None if it does not say."""
    size = file.seek(0, io.SEEK_END)
    with contextlib.suppress(McapError, struct.error):
        for opcode, at, length in _frames(file, size - len(MAGIC), end):
            if opcode == Opcode.STATISTICS:
                file.seek(at)
                return int(Statistics.read(_stream(file.read(length))).message_count)
    return None


def _flaw(opcode: int, content: bytes) -> str:
    """What is wrong with a record, empty if nothing."""
    try:
        if opcode == Opcode.ATTACHMENT:
            (said,) = struct.unpack("<I", content[-4:])
            if said not in {0, zlib.crc32(content[:-4])}:
                return "the checksum of an attachment does not match"
        elif opcode == Opcode.CHUNK:
            get_chunk_data_stream(unpacked(Chunk.read(_stream(content))), validate_crc=True)
    except Exception as error:  # noqa: BLE001 - decompressors raise whatever they like
        return str(error) or type(error).__name__
    return ""


def unpacked(chunk: Chunk) -> Chunk:
    """The same chunk, not compressed: a small one cannot unfold to any size.

    Raises:
        McapError: it is larger than it says, or than `MAX_CHUNK`, or compressed in another way.
    """
    size = chunk.uncompressed_size
    if not chunk.compression:
        return chunk
    if size > MAX_CHUNK:
        raise McapError(f"a chunk of {size} bytes; more than {MAX_CHUNK} are refused")
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as stream:
            data = stream.read(size + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    else:
        raise McapError(f"a chunk is compressed by {chunk.compression[:20]!r}")
    if len(data) != size:
        raise McapError(f"a chunk has not the {size} bytes that it says")
    return replace(chunk, compression="", data=data)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(content))
