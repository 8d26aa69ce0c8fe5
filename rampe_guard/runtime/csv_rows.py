"""A CSV file as rows of numbers: its header, its whole rows, and a word on each that is left out.

Whoever reads a log reads it here: what is no CSV file, or no clock, is refused by the same words.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.errors import LogError
from rampe_guard.settings import ColumnMap
from rampe_guard.wire.inputs import MAX_VALUE

_ENCODING = "utf-8-sig"
"""With the mark that Excel puts before the first column, or without."""
_SHOWN = 200
"""Letters of a header in an error."""
_OTHERS = {";": "semicolons", "\t": "tabs", "|": "bars"}
_FASTEST_S, _SLOWEST_S = 0.0005, 1.0
_LONGEST_PAUSE_S = 86400.0
"""Nobody works with a pause of a day in one recording: the clock was set."""


def header_of(path: Path) -> list[str]:
    """Names of the columns.

    Raises:
        LogError: it cannot be read, or its first line names no columns.
    """
    with _opened(path) as file:
        return _header(path, next(csv.reader(file), []))


def mapped_rows(path: Path, columns: Sequence[ColumnMap]) -> tuple[FloatArray, list[str]]:
    """Mapped values (k, columns) of every whole row, and a warning for every other.

    Args:
        path: of the file.
        columns: first that of the time, which alone may be beyond what a message may hold.

    Raises:
        LogError: it cannot be read, a column is missing or there twice, or no row is whole.
    """
    rows, _, warnings = numbered_rows(path, columns)
    return rows, warnings


def numbered_rows(
    path: Path, columns: Sequence[ColumnMap]
) -> tuple[FloatArray, list[int], list[str]]:
    """The same, with the line of the file on which each row ends."""
    rows, lines, warnings = [], [], []
    with _opened(path) as file:
        reader = csv.DictReader(file)
        header = _header(path, list(reader.fieldnames or []))
        for column in columns:
            _check_column(path, column.column, header)
        for row in reader:
            values, problem = _mapped(row, columns, len(header))
            if problem:
                warnings.append(f"{path}:{reader.line_num}: row left out: {problem}")
            else:
                rows.append(values)
                lines.append(reader.line_num)
    if not rows:
        raise LogError(f"{path}: no usable row{'; ' + warnings[0] if warnings else ''}")
    return np.array(rows), lines, warnings


def time_problems(column: ColumnMap, time_s: FloatArray) -> list[str]:
    """Why a column cannot be the time of one run, if it cannot."""
    where = f"column {column.column!r}"
    steps = np.diff(time_s)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        at = int(back[0])
        return [
            (
                f"{where}: time does not go on after {time_s[at]:.6g} s"
                f" (row {at + 2} of the usable ones): two runs in one file? Split it"
            )
        ]
    typical = float(np.median(steps)) if steps.size else _SLOWEST_S
    if not _FASTEST_S <= typical <= _SLOWEST_S:
        return [f"{where}: rows are {typical:.3g} s apart: is time in seconds? Give its scale"]
    if steps.size and steps.max() > _LONGEST_PAUSE_S:
        at = int(steps.argmax())
        return [
            (
                f"{where}: time jumps by {steps[at]:.3g} s after {time_s[at]:.6g} s"
                f" (row {at + 2} of the usable ones): was the clock set? Split the file there"
            )
        ]
    return []


def shown(header: Sequence[str]) -> str:
    """Names of columns, for an error."""
    text = ", ".join(header)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"


@contextmanager
def _opened(path: Path) -> Iterator[Iterator[str]]:
    try:
        with path.open(newline="", encoding=_ENCODING) as file:
            yield file
    except UnicodeDecodeError:
        raise LogError(
            f"{path}: cannot be read: it is not UTF-8 text; is it a CSV file? Save it as UTF-8"
        ) from None
    except (OSError, csv.Error) as error:
        raise LogError(f"{path}: cannot be read: {error}") from None


def _header(path: Path, header: list[str]) -> list[str]:
    """The same, if it can be one.

    Raises:
        LogError: the first line names no columns.
    """
    if not any(name.strip() for name in header):
        raise LogError(f"{path}:1: is empty; the first line of a CSV log names its columns")
    if len(header) == 1:
        line = header[0]
        for sign, words in _OTHERS.items():
            if sign in line:
                raise LogError(
                    f"{path}:1: the columns are separated by {words}: {shown(line.split(sign))};"
                    " save it with commas between them, and points in numbers"
                )
        if line.lstrip().startswith("<"):
            raise LogError(f"{path}:1: is no CSV file; it begins with {line[:40]!r}")
    return header


def _check_column(path: Path, name: str, header: list[str]) -> None:
    count = header.count(name)
    if not count:
        raise LogError(f"{path}:1: no column {name!r}; the header has {shown(header)}")
    if count > 1:
        raise LogError(
            f"{path}:1: {count} columns are called {name!r}; which one is meant? Rename the others"
        )


def _mapped(
    row: dict[str | None, str | list[str] | None], columns: Sequence[ColumnMap], count: int
) -> tuple[list[float], str]:
    """Mapped values of one row, and what is wrong with it (empty if nothing)."""
    more = row.get(None) or ()
    if any(map(str.strip, more)):  # a comma at the end of every line is no field
        return [], f"it has {count + len(more)} fields, and the header {count}"
    values: list[float] = []
    for column in columns:
        text = row[column.column]
        if not isinstance(text, str):
            return [], f"cut off before column {column.column!r}"
        try:
            value = float(text) * column.scale + column.offset
        except ValueError:
            what = f"{text[:20]!r} is no number" if text.strip() else "is empty"
            return [], f"column {column.column!r}: {what}"
        if not math.isfinite(value):
            return [], f"column {column.column!r}: {text.strip()[:20]!r} is not finite"
        if values and abs(value) > MAX_VALUE:
            return [], f"column {column.column!r}: {value:g} is beyond {MAX_VALUE:g}"
        values.append(value)
    return values, ""
