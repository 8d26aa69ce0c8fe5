"""The pages of the documentation, and the commands in them.

Commands stand in fences ``console``, on lines that begin with ``$ ``; one goes on over lines that
end with a backslash, and to the end of its here-document. Comments before a fence say how:

``<!-- not run: REASON -->``   needs what a test has not
``<!-- nightly: REASON -->``   takes long; what follows in the page must not need it
``<!-- exit code: N -->``      of each of its commands
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.support.processes import ROOT

DOCS = ROOT / "deploy" / "docs"
README = ROOT / "README.md"
_FENCE = re.compile(r"^(\s*)(`{3,})(\S*)\s*$")
_NOTE = re.compile(r"^\s*<!-- (not run|nightly|exit code): (.+) -->\s*$")
_HERE = re.compile(r"<<-?\s*'?\"?(\w+)")


@dataclass(frozen=True, slots=True)
class Fence:
    """One block of code.

    Attributes:
        page: where it stands.
        line: of its first line.
        language: as it says.
        text: what is in it, without the indentation of the fence.
        notes: what the comments before it say, by their first words.
    """

    page: Path
    line: int
    language: str
    text: tuple[str, ...]
    notes: dict[str, str]

    @property
    def commands(self) -> list[str]:
        """Commands of a console."""
        lines = iter(self.text)
        return ["\n".join(_whole(line[2:], lines)) for line in lines if line.startswith("$ ")]


def pages() -> list[Path]:
    """All pages of the site that are written by hand, and the README."""
    return [README, *sorted(p for p in DOCS.rglob("*.md") if not p.parent.name.startswith("_"))]


def fences(page: Path) -> list[Fence]:
    """Its blocks of code in their order."""
    lines = page.read_text("utf-8").splitlines()
    found: list[Fence] = []
    notes: dict[str, str] = {}
    at = 0
    while at < len(lines):
        opening = _FENCE.match(lines[at])
        if opening is None:
            note = _NOTE.match(lines[at])
            notes = {**notes, note[1]: note[2]} if note else {}
            at += 1
            continue
        indent, ticks, language = opening.groups()
        end = next(i for i in range(at + 1, len(lines)) if lines[i].strip() == ticks)
        text = tuple(line.removeprefix(indent) for line in lines[at + 1 : end])
        found.append(Fence(page, at + 2, language, text, notes))
        notes, at = {}, end + 1
    return found


def consoles(page: Path) -> list[Fence]:
    """Those that hold commands."""
    return [fence for fence in fences(page) if fence.language == "console"]


def _whole(first: str, lines: Iterator[str]) -> Iterator[str]:
    """A command with the lines that belong to it."""
    yield first
    last = first
    while last.endswith("\\"):
        last = next(lines).removeprefix("> ")
        yield last
    if here := _HERE.search(first):
        for line in lines:
            yield line
            if line == here[1]:
                return
        raise AssertionError(f"a here-document without its end: {first}")
