"""A CSV log of a machine of which nobody has described anything yet: columns → `Heard`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rampe_guard.core.identify_signals import Traces
from rampe_guard.core.inputs import AXIS_SLACK
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import LogError
from rampe_guard.programs.measuring import Heard
from rampe_guard.runtime.csv_rows import header_of, mapped_rows, shown, time_problems
from rampe_guard.settings import ColumnMap

_AXIS_MOST = 1.0 + AXIS_SLACK
_PART = re.compile(r'\s*(?:"(?P<quoted>[^"]+)"|(?P<bare>[^",:]*?))\s*(?P<numbers>(?::[^,:]*)*),')
"""One column of several: its name, in quotes if there is a comma or a colon in it, and numbers."""
_TIME = "t"
_LEVER = "u_"
"""How columns are called in the logs that we write: t, u_NAME and NAME."""


def column_maps(text: str, option: str) -> list[ColumnMap]:
    """``NAME[:SCALE[:OFFSET]],…``: site value = scale·(value in the column) + offset.

    Raises:
        LogError: it is not written so.
    """
    found, at, text = [], 0, f"{text},"
    while at < len(text):
        part = _PART.match(text, at)
        if part is None:
            raise _no_column(text[at:], option)
        found.append(_column(part, option))
        at = part.end()
    return found


def _column(part: re.Match[str], option: str) -> ColumnMap:
    name = part["quoted"] or part["bare"]
    try:
        values = [float(number) for number in part["numbers"].split(":")[1:]]
    except ValueError:
        values = [math.nan]
    if not name or len(values) > 2 or not all(map(math.isfinite, values)):  # noqa: PLR2004
        raise _no_column(part[0], option)
    scale, offset = (*values, *(1.0, 0.0)[len(values) :])
    if scale == 0.0:
        raise LogError(f"{option} {part[0].strip(' ,')!r}: scale 0 makes every value the same")
    return ColumnMap(name, scale, offset)


def _no_column(text: str, option: str) -> LogError:
    return LogError(
        f"{option} {text.strip(' ,')!r} is no column; write NAME, NAME:SCALE or NAME:SCALE:OFFSET,"
        " several with commas, and a name that has a comma or a colon in it in double quotes"
    )


def heard_in_csv(path: str, time: str | None, joystick: str | None, actuators: str | None) -> Heard:
    """Both inputs of a CSV log with a header.

    Columns that are not named are ``t``, ``u_NAME`` and ``NAME``, as in the logs that we write.

    Args:
        path: of the file.
        time: its column of time.
        joystick: columns of the axes, in the order of their numbers.
        actuators: columns of the positions.

    Raises:
        LogError: it cannot be read, or a column is missing or cannot be what it should be.
    """
    header = header_of(Path(path))
    clock = _clock(path, header, time)
    names = [name for name in header if f"{_LEVER}{name}" in header]
    levers, places = (
        [ColumnMap(f"{prefix}{name}") for name in names]
        if told is None
        else column_maps(told, option)
        for told, option, prefix in (
            (joystick, "--joystick", _LEVER),
            (actuators, "--actuators", ""),
        )
    )
    if not (levers and places):
        missing = " and ".join(
            option
            for option, there in (("--joystick", levers), ("--actuators", places))
            if not there
        )
        raise LogError(
            f"{path}:1: no column NAME with a column u_NAME for its lever; name the columns, in"
            f" their order, with {missing}; the header has {shown(header)}"
        )
    rows, left_out = mapped_rows(Path(path), [clock, *levers, *places])
    time_s = rows[:, 0]
    if problems := time_problems(clock, time_s):
        how = f": --time {clock.column}:SCALE" if problems[0].endswith("scale") else ""
        raise LogError(f"{path}: {problems[0]}{how}")
    axes = rows[:, 1 : 1 + len(levers)]
    _check_axes(path, levers, axes)
    traces = Traces(time_s, np.clip(axes, -1.0, 1.0), time_s, rows[:, 1 + len(levers) :], None)
    heard = Heard(
        traces,
        ", ".join(column.column for column in levers),
        ", ".join(column.column for column in places),
        Path(path).name,
        columns={"time": clock, "joystick": levers, "actuators": places},
    )
    if left_out:
        heard.refused[_rows_left_out(Path(path), left_out)] = len(left_out)
    return heard


def _clock(path: str, header: list[str], told: str | None) -> ColumnMap:
    if told is None:
        if _TIME not in header:
            raise LogError(
                f"{path}:1: no column {_TIME!r}; name the column of time with --time COLUMN"
                f" (--time COLUMN:0.001 if it is in milliseconds); the header has {shown(header)}"
            )
        return ColumnMap(_TIME)
    found = column_maps(told, "--time")
    if len(found) > 1:
        raise LogError(f"--time {told!r}: names {len(found)} columns; time is one")
    return found[0]


def _check_axes(path: str, levers: Sequence[ColumnMap], axes: FloatArray) -> None:
    for column, values in zip(levers, axes.T, strict=True):
        most = float(np.quantile(np.abs(values), 0.98))
        if most > _AXIS_MOST:
            raise LogError(
                f"{path}: column {column.column!r} reaches {most:.3g}; an axis is -1 to 1: give"
                f" --joystick '{column.column}:SCALE:OFFSET' with value = raw x SCALE + OFFSET"
            )


def _rows_left_out(path: Path, warnings: Sequence[str]) -> str:
    """What to call them after their number: with the first line, and why."""
    line, _, why = warnings[0].removeprefix(f"{path}:").partition(": row left out: ")
    if len(warnings) == 1:
        return f"row, line {line}: {why}"
    return f"rows, the first in line {line}: {why}"
