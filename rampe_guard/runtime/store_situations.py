"""The memory of situations on the disk, in a file beside the operator's model.

It is large, so it is handled differently from the model: the worker loop only takes note of
which chunks there are, since what is in them never changes, and the saver's thread makes the
file of them, chunk by chunk. It is written once a minute at most, and less often when it is so
large that a flash card would feel it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt

from rampe_guard.core.situation_memory import VERSION, SituationMemory
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, situations_file
from rampe_guard.runtime.store_format import (
    SITUATIONS,
    Arrays,
    Header,
    decode,
    encode,
    misfit,
    situations_header,
)
from rampe_guard.runtime.store_saver import Save, Saver
from rampe_guard.settings import Site

SAVE_S: Final = 60.0
"""Shortest time between two saves [s]."""
_BYTES_PER_S: Final = 100_000.0
"""It is not written faster than this on the average: 2.9 GB in a day of eight hours."""
_PARTS: Final = ("next_clock", "next_position", "next_point")
_VERSION: Final = "next_version"
_Pieces: TypeAlias = Sequence[tuple[FloatArray, FloatArray, FloatArray]]


def encode_situations(header: Header, pieces: _Pieces) -> bytes:
    """The bytes of the file; an array for each chunk, so that none holds up other threads."""
    arrays: Arrays = {_VERSION: np.array(VERSION)}
    for number, (clock, position, points) in enumerate(pieces):
        values: list[npt.NDArray[Any]] = [clock, position, points.astype(np.float32)]
        for name, part in zip(_PARTS, values, strict=True):
            arrays[f"{name}.{number}"] = part
    count = sum(len(clock) for clock, _, _ in pieces)
    return encode(msgspec.structs.replace(header, occurrences=count), arrays)


def decode_situations(content: bytes) -> tuple[Header, Arrays]:
    """Header and snapshot of a file (`SituationMemory.restore`).

    Raises:
        ModelFileError: anything at all is wrong with it.
    """
    header, arrays = decode(content, SITUATIONS)
    chunks = (len(arrays) - 1) // len(_PARTS)
    try:
        snapshot = {_VERSION: arrays[_VERSION]}
        for name in _PARTS:
            snapshot[name] = np.concatenate([arrays[f"{name}.{k}"] for k in range(chunks)])
    except (LookupError, ValueError) as error:
        raise ModelFileError(f"its arrays are not those of situations: {error}") from None
    if len(arrays) != 1 + chunks * len(_PARTS) or len(snapshot[_PARTS[0]]) != header.occurrences:
        raise ModelFileError(f"it does not have the {header.occurrences} situations of its header")
    return header, snapshot


def recall_situations(content: bytes, needed: Header, memory: SituationMemory) -> Header:
    """Restore what is in a file; returns its header.

    Raises:
        ModelFileError: it cannot be used; the memory is as it was.
    """
    header, snapshot = decode_situations(content)
    if reason := misfit(header, needed):
        raise ModelFileError(reason)
    try:
        memory.restore(snapshot)
    except (ValueError, TypeError, LookupError, ArithmeticError) as error:
        raise ModelFileError(f"its numbers cannot be: {error}") from None
    return header


class SituationKeeper:
    """Keeps the situations of one guard; `Keeper` asks it.

    Args:
        site: with its operator.
        limits: of the actuators (n, 2) [unit].
        say: log.
    """

    def __init__(self, site: Site, limits: FloatArray, say: Sayer) -> None:
        self._say = say
        self._who = f"operator {site.operator!r}"
        self._header = situations_header(site, limits)
        self._file: ModelFile | None = None
        self._memory: SituationMemory | None = None
        self._saver: Saver[float] | None = None
        self._stuck: str | None = None
        self._due_s = 0.0

    @property
    def problem(self) -> str | None:
        """Why situations are not kept, None if they are."""
        return self._stuck or (None if self._saver is None else self._saver.problem)

    @property
    def failures(self) -> int:
        """Saves that failed so far."""
        return 0 if self._saver is None else self._saver.failures

    def begin(self, model: Path, memory: SituationMemory, now_s: float) -> None:
        """Recall what is beside the file of a model, and keep ``memory`` from now on."""
        file = self._file = situations_file(model)
        try:
            file.lock()
        except ModelFileError as error:
            self._stuck = str(error)
        try:
            content = file.read()
            header = None if content is None else recall_situations(content, self._header, memory)
        except ModelFileError as error:
            self._refuse(file, error)
        else:
            if header is not None:
                self._say.info(
                    f"{self._who}: {header.occurrences} situations of {memory.hours:.1f} h of work"
                    f" known from {file.path}"
                )
        if file.locked and self._stuck is None:
            self._memory = memory
            self._saver = Saver(file, _newest_s(memory.pieces()))
            self._due_s = now_s + SAVE_S

    def keep(self, now_s: float) -> None:
        """Have saved what is new, if it is time; never waits."""
        if self._memory is not None and now_s >= self._due_s:
            self._due_s = now_s + max(SAVE_S, self.save() / _BYTES_PER_S)

    def hurry(self) -> None:
        """Have everything saved at the next turn."""
        self._due_s = float("-inf")

    def save(self) -> int:
        """Have saved what is new, as soon as the disk is free; returns how much [bytes]."""
        memory, saver = self._memory, self._saver
        if memory is None or saver is None:
            return 0
        pieces = memory.pieces()
        newest_s = _newest_s(pieces)
        if newest_s == saver.taken:
            return 0
        header = msgspec.structs.replace(self._header, saved_unix_s=time.time())
        saver.give(Save(partial(encode_situations, header, pieces), newest_s))
        return sum(part.nbytes for piece in pieces for part in piece)

    def close(self, within_s: float) -> None:
        """Let the last save end, and give the file back."""
        file, saver = self._file, self._saver
        self._memory = self._saver = None
        if saver is not None and file is not None:
            if not saver.finish(within_s):
                text = f"{file.path}: the disk did not take the last situations in time"
                self._say.warn("situations", text)
                return  # the file stays locked: it may still be written
            if saver.problem is not None:
                self._say.warn("end", f"the last situations are not kept: {saver.problem}")
        if file is not None:
            file.release()

    def _refuse(self, file: ModelFile, error: ModelFileError) -> None:
        """A file that cannot be used is never overwritten: it is moved, or we do not write."""
        if not file.locked:
            self._say.warn("refused", f"{file.path} is not used: {error}")
            return
        try:
            aside = file.set_aside()
        except ModelFileError as stuck:
            self._stuck = f"{file.path} cannot be used ({error}), nor moved aside ({stuck})"
            return
        self._say.warn(
            "refused",
            f"{file.path} is not used: {error}. It is now {aside.name}, and no situation is"
            f" remembered yet; mend the cause and rename it back, or delete it",
        )


def _newest_s(pieces: _Pieces) -> float:
    """Time of work of the newest situation [s], -1 without any: what a file is told by."""
    clock = pieces[-1][0]
    return float(clock[-1]) if len(clock) else -1.0
