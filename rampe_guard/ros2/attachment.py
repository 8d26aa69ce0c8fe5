"""What rmw_zenoh attaches to every message: a number, a time and who sent it.

Two forms are read, that of today (33 bytes) and that of Jazzy's first releases (77, with the names
of the fields); one is written, today's. Nothing depends on it here but a count of what was lost.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

_NOW: Final = struct.Struct("<qqB16s")
_THEN: Final = struct.Struct("<16sq17sq11sB16s")
_NAMES: Final = (b"\x0fsequence_number", b"\x10source_timestamp", b"\x0asource_gid")
_GID: Final = 16
_MOST_SENDERS: Final = 16
_LONGEST_GAP: Final = 100_000
"""A larger one is another count, not a loss."""


@dataclass(frozen=True, slots=True)
class Attachment:
    """``sequence`` counts from 1; ``source_ns`` is since 1970; ``gid`` are 16 bytes."""

    sequence: int
    source_ns: int
    gid: bytes

    def packed(self) -> bytes:
        """As it travels."""
        return _NOW.pack(self.sequence, self.source_ns, _GID, self.gid)


def unpacked(data: bytes | None) -> Attachment | None:
    """What came with a message; None if nothing did that could be read."""
    if data is None:
        return None
    if len(data) == _NOW.size:
        sequence, source_ns, size, gid = _NOW.unpack(data)
        return Attachment(sequence, source_ns, gid) if size == _GID else None
    if len(data) == _THEN.size:
        first, sequence, second, source_ns, third, size, gid = _THEN.unpack(data)
        if (first, second, third, size) == (*_NAMES, _GID):
            return Attachment(sequence, source_ns, gid)
    return None


class Losses:
    """Counts the messages of a topic that were lost on the way, by the gaps in their numbers."""

    def __init__(self) -> None:
        self._last: dict[bytes, int] = {}
        self.count = 0

    def note(self, data: bytes | None) -> int:
        """Take the attachment of the next message; returns how many were lost before it."""
        found = unpacked(data)
        if found is None:
            return 0
        last = self._last.get(found.gid)
        if last is None and len(self._last) >= _MOST_SENDERS:
            self._last.clear()  # senders that come and go all the time hold no memory
        self._last[found.gid] = found.sequence
        gap = 0 if last is None else found.sequence - last - 1
        lost = gap if 0 < gap <= _LONGEST_GAP else 0
        self.count += lost
        return lost
