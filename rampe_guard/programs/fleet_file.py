"""The file of ``evaluate --fleet``: which operators, on which machines, with which logs.

::

    sequences:
      - name: anna                  # results go into OUT/anna
        site: sites/north.yaml      # paths are relative to this file
        logs: [logs/anna/*.csv]     # in the order in which they are learned; * in order of name
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from rampe_guard.settings.explain import validate
from rampe_guard.settings.model import Model, Text
from rampe_guard.settings.problems import Problems
from rampe_guard.settings.source import parse, read_bytes


@dataclass(frozen=True, slots=True)
class Sequence:
    """One operator on one machine: absolute paths of the site file and of the logs, in order."""

    name: str
    site: str
    logs: tuple[str, ...]


class _Entry(Model):
    name: Annotated[
        str,
        Field(
            pattern=r"^\w[\w .-]{0,63}$",
            description="A name that can be a folder's: letters, digits, space, '.', '-', '_'.",
        ),
    ]
    site: Annotated[Text, Field(description="The path of the site file.")]
    logs: Annotated[
        tuple[Text, ...],
        Field(
            min_length=1, description="The paths of the logs, in order; * for many.", strict=False
        ),
    ]


class _Fleet(Model):
    sequences: Annotated[
        tuple[_Entry, ...],
        Field(min_length=1, description="The operators and their logs.", strict=False),
    ]


def read_fleet(path: str) -> tuple[Sequence, ...]:
    """Read the file; paths of the entries are absolute, patterns are resolved.

    Raises:
        SettingsError: with line, key and remedy of every problem.
    """
    document = parse(read_bytes(path, "fleet file"), path)
    fleet = validate(_Fleet, document)
    problems = Problems(document)
    folder = Path(path).absolute().parent
    again = Counter(entry.name for entry in fleet.sequences)
    found: list[Sequence] = []
    for index, entry in enumerate(fleet.sequences):
        if again[entry.name] > 1:
            problems.add(
                ("sequences", index, "name"), f"{entry.name!r} is there twice", "name it otherwise"
            )
        logs: list[str] = []
        for place, pattern in enumerate(entry.logs):
            matches = _matches(folder, pattern)
            if not matches:
                problems.add(
                    ("sequences", index, "logs", place),
                    f"no file is {pattern!r}",
                    "give a path relative to this file",
                )
            logs += matches
        found.append(Sequence(entry.name, str(folder / entry.site), tuple(logs)))
    problems.raise_if_any()
    return tuple(found)


def _matches(folder: Path, pattern: str) -> list[str]:
    if "*" not in pattern:
        return [str(folder / pattern)] if (folder / pattern).is_file() else []
    path = folder / pattern
    anchor = Path(path.anchor)
    return sorted(str(p) for p in anchor.glob(str(path.relative_to(anchor))) if p.is_file())
