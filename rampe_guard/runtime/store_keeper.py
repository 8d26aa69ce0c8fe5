"""The memory of a running guard: what was learned before, and that it is kept from now on.

Nothing here ever stops a guard. A model that cannot be used is set aside and said so; a disk
that cannot be written is said on the log and in every heartbeat, and the guard learns on.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

import msgspec
import numpy as np
import numpy.typing as npt

from rampe_guard import wire
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import Category, FloatArray
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_path
from rampe_guard.runtime.store_format import Header, decode, encode, header_of, misfit
from rampe_guard.runtime.store_saver import Save, Saver
from rampe_guard.runtime.store_situations import SituationKeeper
from rampe_guard.settings import Site

_END_S = 1.2
"""Longest wait for the last save: the daemon has 2 s to end."""
_RUBBISH = (ValueError, TypeError, LookupError, ArithmeticError)


class Row(Protocol):
    """What is known of one category; see `core.rampe.CategoryRow`."""

    @property
    def occurrences(self) -> int:
        """How often it was learned."""

    @property
    def mean_displacement(self) -> FloatArray:
        """Mean displacement (n,) [unit]."""


class Learner(Protocol):
    """The estimator as its memory sees it; see `core.rampe.Rampe`."""

    @property
    def categories(self) -> Mapping[Category, int]:
        """Occurrences by category."""

    @property
    def refused(self) -> Mapping[str, int]:
        """Primitives not learned, by reason."""

    def snapshot(self) -> Mapping[str, npt.NDArray[Any]]:
        """All that was learned."""

    def restore(self, snapshot: Mapping[str, npt.NDArray[Any]], /) -> None:
        """Go on from a snapshot; ValueError says what does not fit."""

    def table(self) -> Sequence[Row]:
        """A row a category."""


def recall(content: bytes, needed: Header, learner: Learner) -> Header:
    """Restore what is in a file; returns its header.

    Raises:
        ModelFileError: it cannot be used; the learner is as it was.
    """
    header, arrays = decode(content)
    if reason := misfit(header, needed):
        raise ModelFileError(reason)
    before = {name: array.copy() for name, array in learner.snapshot().items()}
    try:
        learner.restore(arrays)
        _check(header, learner)
    except _RUBBISH as error:
        learner.restore(before)
        raise ModelFileError(f"its numbers cannot be: {error}") from None
    return header


def counted(header: Header, learner: Learner) -> Header:
    """The header with the learner's counts and the present time."""
    counts = learner.categories
    return msgspec.structs.replace(
        header,
        saved_unix_s=time.time(),
        categories=len(counts),
        occurrences=int(sum(counts.values())),
        refused={str(reason): int(count) for reason, count in learner.refused.items()},
    )


def _check(header: Header, learner: Learner) -> None:
    counts = learner.categories
    has = (len(counts), int(sum(counts.values())))
    if has != (header.categories, header.occurrences):
        raise ValueError(
            f"{has[1]} occurrences of {has[0]} categories where the header says"
            f" {header.occurrences} of {header.categories}"
        )
    for row in learner.table():
        if row.occurrences and not np.isfinite(row.mean_displacement).all():
            raise ValueError(f"a mean displacement is {row.mean_displacement}")


class Keeper:
    """Keeps one guard's models; a context manager: leaving it saves.

    Args:
        site: with its operator.
        limits: of the actuators (n, 2) [unit].
        say: log.
    """

    def __init__(self, site: Site, limits: FloatArray, say: Sayer) -> None:
        self._site, self._say = site, say
        self._header = header_of(site, limits)
        self._file: ModelFile | None = None
        self._learner: Learner | None = None
        self._saver: Saver[Mapping[Category, int]] | None = None
        self._situations = SituationKeeper(site, limits, say)
        self._due_s = 0.0
        self._unkept: str | None = None
        self._said: str | None = None

    def begin(
        self, learner: Learner, now_s: float, situations: SituationMemory | None = None
    ) -> None:
        """Recall what was learned before, and keep ``learner`` and ``situations`` from now on."""
        who = f"operator {self._site.operator!r}"
        if not self._site.memory.enabled:
            self._say.info(f"memory is off: {who} is learned anew, and nothing is kept")
            return
        try:
            file = self._file = ModelFile(model_path(self._site))
        except ModelFileError as error:
            self._unkept = str(error)
            return
        try:
            file.lock()
        except ModelFileError as error:
            self._unkept = str(error)
        try:
            content = file.read()
            header = None if content is None else recall(content, self._header, learner)
        except ModelFileError as error:
            self._refuse(file, error)
        else:
            self._greet(who, file, header)
        if file.locked and self._unkept is None:
            self._learner = learner
            self._saver = Saver(file, dict(learner.categories))
            self._due_s = now_s + self._site.memory.save_every_s
        if situations is not None:
            self._situations.begin(file.path, situations, now_s)

    @property
    def failures(self) -> int:
        """Saves that failed so far."""
        return self._situations.failures + (0 if self._saver is None else self._saver.failures)

    def keep(self, now_s: float) -> None:
        """Have saved what was learned since the last save, if it is time; never waits."""
        if self._saver is not None and now_s >= self._due_s:
            self._due_s = now_s + self._site.memory.save_every_s
            self._save(self._saver)
        self._situations.keep(now_s)

    def hurry(self) -> None:
        """Have everything saved at the next turn: what was forgotten must not come back."""
        self._due_s = float("-inf")
        self._situations.hurry()

    def reasons(self) -> tuple[wire.Reason, ...]:
        """Why what is learned is not kept, for the heartbeat; a change is said on the log."""
        problem = self._unkept
        if problem is None and self._saver is not None:
            problem = self._saver.problem
        if problem is None:
            problem = self._situations.problem
        text = None if problem is None else f"what is learned is not kept: {problem}"
        if text != self._said:
            self._said = text
            if text is None:
                self._say.info("what is learned is kept again")
            else:
                self._say.warn("memory", text)
        return () if text is None else (wire.Reason(code="model_not_kept", text=text, key=None),)

    def close(self) -> None:
        """Save what was learned since the last save; at most `_END_S`."""
        end_s = time.monotonic() + _END_S
        self._situations.save()  # meanwhile it writes
        self._close_models()
        self._situations.close(max(end_s - time.monotonic(), 0.0))

    def _close_models(self) -> None:
        file, saver = self._file, self._saver
        self._saver = None
        if saver is not None and file is not None:
            self._save(saver)
            if not saver.finish(_END_S):
                self._say.warn(
                    "memory", f"{file.path}: the disk did not take the last save in time"
                )
                return  # the file stays locked: it may still be written
            if saver.problem is not None:
                self._say.warn("end", f"what was learned last is not kept: {saver.problem}")
        if file is not None:
            file.release()

    def _save(self, saver: Saver[Mapping[Category, int]]) -> None:
        if self._learner is not None and (counts := dict(self._learner.categories)) != saver.taken:
            header = counted(self._header, self._learner)
            # copies: the learner goes on while they are written
            arrays = {name: a.copy() for name, a in self._learner.snapshot().items()}
            saver.give(Save(partial(encode, header, arrays), counts))

    def _refuse(self, file: ModelFile, error: ModelFileError) -> None:
        """A file that cannot be used is never overwritten: it is moved, or we do not write."""
        if not file.locked:
            self._say.warn("refused", f"{file.path} is not used: {error}; nothing is learned yet")
            return
        try:
            aside = file.set_aside()
        except ModelFileError as stuck:
            self._unkept = f"{file.path} cannot be used ({error}), nor moved aside ({stuck})"
            return
        self._say.warn(
            "refused",
            f"{file.path} is not used: {error}. It is now {aside.name}, and the guard starts with"
            f" nothing learned; mend the cause and rename it back, or delete it",
        )

    def _greet(self, who: str, file: ModelFile, header: Header | None) -> None:
        if header is None:
            self._say.info(f"{who}: nothing learned yet, there is no {file.path}")
            return
        when = time.strftime("%Y-%m-%d %H:%M", time.localtime(header.saved_unix_s))
        self._say.info(
            f"{who}: {header.occurrences} primitives of {header.categories} categories known from"
            f" {file.path}, saved {when}"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
