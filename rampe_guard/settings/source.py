"""YAML text → plain values and the line of every one of them.

Built from ruamel's event stream with a stack, so that hostile text can neither exhaust the
recursion limit nor unfold aliases. Scalars follow the YAML 1.2 core schema: ``yes``, ``on``
and ``12:30`` stay text. Anchors, tags and a second document are refused: a site file needs
none of them, and a reader of it should not have to know them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from rampe_guard.errors import SettingsError
from rampe_guard.settings.problems import KeyPath, dotted, show

MAX_BYTES = 1024 * 1024
MAX_LINE = 10_000
"""Longest line in characters: the scanner is quadratic in the length of some tokens."""
MAX_MESH_BYTES = 512 * 1024 * 1024
MAX_VALUES = 50_000
MAX_DEPTH = 24

Container: TypeAlias = "dict[str, Any] | list[Any]"

_WORDS: dict[str, bool | float | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **{
        sign + word: float(sign + "inf")
        for sign in ("", "+", "-")
        for word in (".inf", ".Inf", ".INF")
    },
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_MAX_DIGITS = 300  # beyond any double; int() would refuse 4300 and more with a ValueError


@dataclass(frozen=True, slots=True)
class Document:
    """A file as plain values.

    Attributes:
        file: name for messages, as the user gave it.
        content: the bytes it was read from.
        data: dicts, tuples, str, int, float, bool and None.
        lines: line, from 1, of each key or list item.
    """

    file: str
    content: bytes
    data: Any
    lines: dict[KeyPath, int]

    def line(self, path: KeyPath) -> int:
        """Line of ``path``, or of the nearest parent that stands in the file."""
        for end in range(len(path), -1, -1):
            if path[:end] in self.lines:
                return self.lines[path[:end]]
        return 1


def read_bytes(
    path: str | Path, what: str, hint: str = "check the path", *, limit: int = MAX_BYTES
) -> bytes:
    """Bytes of a regular file of at most ``limit`` bytes.

    Raises:
        SettingsError: it is missing, no file, unreadable or too large.
    """
    try:
        file = Path(path)
        if file.is_dir():
            raise SettingsError(f"{path}: is a directory; give {_a(what)}")
        if file.exists() and not file.is_file():
            raise SettingsError(f"{path}: is not a regular file; give {_a(what)}")
        with file.open("rb") as stream:
            content = stream.read(limit + 1)
    except FileNotFoundError:
        raise SettingsError(f"{path}: there is no such {what}; {hint}") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL or a lone surrogate in the path
        reason = getattr(error, "strerror", None) or error
        raise SettingsError(f"{show(str(path))}: cannot be read ({reason}); {hint}") from None
    if len(content) > limit:
        most = f"{limit // 1024 // 1024} MB"
        raise SettingsError(f"{path}: is larger than {most}; give {_a(what)}")
    return content


def _a(what: str) -> str:
    return f"an {what}" if what[0] in "aeiou" else f"a {what}"


def parse(content: bytes | str, file: str) -> Document:
    """Parse one YAML document.

    Args:
        content: the text, UTF-8 when bytes.
        file: its name for messages.

    Raises:
        SettingsError: with file and line, for anything that is not plain, bounded YAML.
    """
    raw = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
    if len(raw) > MAX_BYTES:
        raise SettingsError(f"{file}: is larger than {MAX_BYTES // 1024 // 1024} MB; shorten it")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise SettingsError(
            f"{file}:{line}: byte 0x{raw[error.start]:02x} is not UTF-8; save the file as UTF-8"
        ) from None
    for number, line_text in enumerate(text.splitlines(), start=1):
        if len(line_text) > MAX_LINE:
            what = f"the line has more than {MAX_LINE} characters"
            raise SettingsError(f"{file}:{number}: {what}; break it into several")
    builder = _Builder(file)
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            builder.take(event)
    except SettingsError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        why = "; ".join(part for part in (error.context, error.problem) if part)
        raise SettingsError(f"{file}:{line}: is not valid YAML: {why}") from None
    except YAMLError as error:
        where = getattr(error, "position", None)
        line = text.count("\n", 0, where) + 1 if isinstance(where, int) else 1
        why = " ".join(str(error).split())[:120]
        raise SettingsError(f"{file}:{line}: is not valid YAML: {why}") from None
    except Exception as error:  # noqa: BLE001 - the parser raises bare errors on some rubbish
        raise SettingsError(
            f"{file}:{builder.last_line}: is not valid YAML ({type(error).__name__}); "
            "check quotes, escapes and indentation here"
        ) from None
    return Document(file, raw, _freeze(builder.root), builder.lines)


@dataclass(slots=True)
class _Builder:
    """Collects events into nested containers; `stack` holds the open ones."""

    file: str
    root: Any = None
    last_line: int = 1
    lines: dict[KeyPath, int] = field(default_factory=dict)
    stack: list[Container] = field(default_factory=list)
    path: list[str | int] = field(default_factory=list)
    key: str | None = None
    documents: int = 0
    values: int = 0

    def take(self, event: Any) -> None:
        self.last_line = event.start_mark.line + 1 if event.start_mark else self.last_line
        if isinstance(event, DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self.refuse("a second document starts here", "keep one document in a file")
        elif isinstance(event, AliasEvent):
            self.refuse(
                f"alias {show(event.anchor)}", "write the value out; aliases are not supported"
            )
        elif isinstance(event, MappingStartEvent | SequenceStartEvent):
            self.check(event)
            self.open({} if isinstance(event, MappingStartEvent) else [])
        elif isinstance(event, MappingEndEvent | SequenceEndEvent):
            self.stack.pop()
            if self.path:
                self.path.pop()
        elif isinstance(event, ScalarEvent):
            self.check(event)
            if self.stack and isinstance(self.stack[-1], dict) and self.key is None:
                self.start_key(str(event.value))
            else:
                plain = event.style is None
                self.put(scalar(event.value) if plain else str(event.value))
                if self.path:
                    self.path.pop()

    def check(self, event: Any) -> None:
        self.values += 1
        if self.values > MAX_VALUES:
            self.refuse(f"more than {MAX_VALUES} values", "shorten the file")
        if getattr(event, "anchor", None):
            self.refuse(f"anchor {show(event.anchor)}", "remove it; anchors are not supported")
        if getattr(event, "tag", None):
            self.refuse(f"tag {show(str(event.tag))}", "remove it; tags are not supported")

    def start_key(self, key: str) -> None:
        where = (*self.path, key)
        if where in self.lines:
            self.refuse(
                f"{dotted(where)} is given twice (first in line {self.lines[where]})",
                "remove one of the two",
            )
        self.lines[where] = self.last_line
        self.key = key

    def open(self, container: Container) -> None:
        if len(self.stack) >= MAX_DEPTH:
            self.refuse(f"nested deeper than {MAX_DEPTH} levels", "check the brackets here")
        self.put(container)
        self.stack.append(container)

    def put(self, value: Any) -> None:
        """Attach ``value`` to the open container and enter its path."""
        if not self.stack:
            self.root = value
            return
        parent = self.stack[-1]
        if isinstance(parent, list):
            self.path.append(len(parent))
            self.lines[tuple(self.path)] = self.last_line
            parent.append(value)
        elif self.key is None:
            self.refuse("a list or mapping as a key", "use a plain word as the key")
        else:
            self.path.append(self.key)
            parent[self.key] = value
            self.key = None

    def refuse(self, what: str, remedy: str) -> None:
        raise SettingsError(f"{self.file}:{self.last_line}: {what}; {remedy}")


def scalar(text: str) -> str | int | float | bool | None:
    """Value of a plain scalar by the YAML 1.2 core schema."""
    if text in _WORDS:
        return _WORDS[text]
    if len(text) <= _MAX_DIGITS and _INT.fullmatch(text):
        return int(text, 0 if text[:2] in {"0o", "0x"} else 10)
    return float(text) if _FLOAT.fullmatch(text) else text


def _freeze(value: Any) -> Any:
    """Lists as tuples, so that strict models take them; depth is bounded by `MAX_DEPTH`."""
    if isinstance(value, dict):
        return {key: _freeze(item) for key, item in value.items()}
    return tuple(_freeze(item) for item in value) if isinstance(value, list) else value
