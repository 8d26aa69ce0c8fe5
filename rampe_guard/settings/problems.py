"""What is wrong with a file, gathered, then raised as one `SettingsError`.

Every line reads ``file:line: dotted.key: what is wrong; what to do``.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

from rampe_guard.errors import SettingsError

if TYPE_CHECKING:
    from rampe_guard.settings.source import Document

KeyPath: TypeAlias = tuple[str | int, ...]

MAX_REPORTED = 10
_MAX_SHOWN = 48


class Problems:
    """The problems of one file, and of files it names."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._own: list[tuple[int, str]] = []
        self._others: list[str] = []

    def add(self, path: KeyPath, what: str, remedy: str) -> None:
        """Note that the value at ``path`` is wrong."""
        line = self._document.line(path)
        self._own.append((line, f"{self.where(path)}: {what}; {remedy}"))

    def where(self, path: KeyPath) -> str:
        """``file:line: dotted.key``, for what is only found out later."""
        place = f"{self._document.file}:{self._document.line(path)}"
        return f"{place}: {dotted(path)}" if path else place

    def extend(self, error: SettingsError) -> None:
        """Take over the problems of another file."""
        self._others.extend(error.lines)

    def raise_if_any(self) -> None:
        """Raise all of them as one error, the first `MAX_REPORTED` in words.

        Raises:
            SettingsError: there is at least one problem.
        """
        own = [text for _, text in sorted(self._own, key=lambda item: item[0])]
        lines = own + self._others
        if not lines:
            return
        shown = lines[:MAX_REPORTED]
        rest = len(lines) - len(shown)
        if rest:
            shown.append(f"{self._document.file}: and {rest} more")
        raise SettingsError(*shown)


def dotted(path: KeyPath) -> str:
    """``("arm", "actuators", 1)`` → ``arm.actuators[1]``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            name = part if part.isidentifier() or part.replace("-", "_").isidentifier() else None
            text += ("." if text else "") + (name or show(part))
    return text


def show(value: Any) -> str:
    """``value`` as one short printable line."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, tuple | list):
        return f"a list of {len(value)}"
    text = repr(value)
    return text if len(text) <= _MAX_SHOWN else f"{text[: _MAX_SHOWN - 1]}…"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``did you mean 'x'?`` if one is near, else the list of what is known."""
    names = list(known)
    near = difflib.get_close_matches(word[:200], names, n=1, cutoff=0.6)
    if near:
        return f"did you mean {show(near[0])}?"
    if not names:
        return "none is known here"
    listed = ", ".join(show(name) for name in names[:12])
    return f"known here: {listed}{', …' if len(names) > len(names[:12]) else ''}"
