"""A CSV log of a machine of which nobody has described anything yet: columns → `Heard`."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from rampe_guard.core.identify_signals import Traces
from rampe_guard.core.inputs import AXIS_SLACK
from rampe_guard.errors import LogError
from rampe_guard.programs.measuring import Heard
from rampe_guard.runtime.csv_rows import mapped_rows
from rampe_guard.settings import ColumnMap

_AXIS_MOST = 1.0 + AXIS_SLACK


def column_maps(text: str, option: str) -> list[ColumnMap]:
    """``NAME[:SCALE[:OFFSET]],…``: site value = scale·(value in the column) + offset.

    Raises:
        LogError: it is not written so.
    """
    found = []
    for part in text.split(","):
        name, *numbers = part.strip().split(":")
        try:
            values = [float(number) for number in numbers]
        except ValueError:
            values = [math.nan]
        if not name or len(values) > 2 or not all(map(math.isfinite, values)):  # noqa: PLR2004
            raise LogError(
                f"{option} {part.strip()!r} is no column; write NAME, NAME:SCALE or"
                " NAME:SCALE:OFFSET, several with commas"
            )
        scale, offset = (*values, *(1.0, 0.0)[len(values) :])
        if scale == 0.0:
            raise LogError(f"{option} {part.strip()!r}: scale 0 makes every value the same")
        found.append(ColumnMap(name, scale, offset))
    return found


def heard_in_csv(path: str, time: str | None, joystick: str | None, actuators: str | None) -> Heard:
    """Both inputs of a CSV log with a header.

    Without any column named, they are ``t``, ``u_NAME`` and ``NAME``, as in the logs that we write.

    Args:
        path: of the file.
        time: its column of time.
        joystick: columns of the axes, in the order of their numbers.
        actuators: columns of the positions.

    Raises:
        LogError: it cannot be read, or a column is missing or cannot be what it should be.
    """
    if time is None and joystick is None and actuators is None:
        time, joystick, actuators = _usual(path)
    if time is None or joystick is None or actuators is None:
        raise LogError(
            f"{path}: of a CSV log name the columns: --time t --joystick u_swing,u_boom"
            " --actuators swing,boom"
        )
    clock = column_maps(time, "--time")[0]
    levers = column_maps(joystick, "--joystick")
    places = column_maps(actuators, "--actuators")
    rows, left_out = mapped_rows(Path(path), [clock, *levers, *places])
    time_s = rows[:, 0]
    if (np.diff(time_s) <= 0.0).any():
        at = int(np.argmax(np.diff(time_s) <= 0.0))
        raise LogError(
            f"{path}: column {clock.column!r}: time does not go on after {time_s[at]:.6g} s; one"
            " run in a file, and --time NAME:SCALE if it is not in seconds"
        )
    axes = rows[:, 1 : 1 + len(levers)]
    for column, values in zip(levers, axes.T, strict=True):
        most = float(np.quantile(np.abs(values), 0.98))
        if most > _AXIS_MOST:
            raise LogError(
                f"{path}: column {column.column!r} reaches {most:.3g}; an axis is -1 to 1: give"
                f" --joystick '{column.column}:SCALE:OFFSET' with value = raw x SCALE + OFFSET"
            )
    names = tuple(column.column for column in places)
    traces = Traces(time_s, np.clip(axes, -1.0, 1.0), time_s, rows[:, 1 + len(levers) :], None)
    heard = Heard(
        traces,
        ", ".join(column.column for column in levers),
        ", ".join(names),
        Path(path).name,
        columns={"time": clock, "joystick": levers, "actuators": places},
    )
    heard.refused.update({"row": len(left_out)} if left_out else {})
    return heard


def _usual(path: str) -> tuple[str | None, str | None, str | None]:
    """Columns of a log that we wrote; None where it is none."""
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            header = next(csv.reader(file), [])
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise LogError(f"{path}: cannot be read: {error}") from None
    names = [column for column in header if f"u_{column}" in header]
    if "t" not in header or not names or any("," in name or ":" in name for name in names):
        return None, None, None
    return "t", ",".join(f"u_{name}" for name in names), ",".join(names)
