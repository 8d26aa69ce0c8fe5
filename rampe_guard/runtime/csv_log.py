"""CSV logs through the mapping of the site file: rows to samples, or a reason why not.

A log is checked as a whole before a single row is used: a column whose values cannot be an
axis, or a position, in more than a few rows is the wrong column or the wrong scale, and
learning from it would be worse than no log.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rampe_guard.core.inputs import AXIS_SLACK, InputGate, Rejection
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, JoystickSample
from rampe_guard.errors import LogError
from rampe_guard.runtime.csv_rows import numbered_rows, time_problems
from rampe_guard.runtime.replay import idle_times
from rampe_guard.settings import ColumnMap, Site

_WRONG_SHARE = 0.02
"""More impossible rows than this in one column is no glitch."""
_AXIS_LIMIT = 1.0 + AXIS_SLACK
_CLEAR_COMMAND = 0.4
_AGAINST_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class CsvLog:
    """A log as arrays: k rows, m axes, n actuators.

    Attributes:
        path: where it came from.
        time_s: (k,) as logged [s].
        axes: (k, m) [-].
        position: (k, n) [unit].
        left_out: one sentence per row that was left out, naming its line.
        refused: one per reason for which a guard refuses some, naming the line of the first.
        sound: (k,) whether a guard takes the position for one of the arm; None: all of them.
    """

    path: str
    time_s: FloatArray
    axes: FloatArray
    position: FloatArray
    left_out: tuple[str, ...]
    refused: tuple[str, ...] = ()
    sound: npt.NDArray[np.bool_] | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """All that is wrong with it."""
        return (*self.left_out, *self.refused)

    def samples(self) -> Iterator[tuple[JoystickSample, ActuatorSample]]:
        """One pair of samples a row; they arrive when they were stamped."""
        for t, u, q in zip(self.time_s.tolist(), self.axes, self.position, strict=True):
            yield JoystickSample(t, u, t), ActuatorSample(t, q, None, t)

    @property
    def first_s(self) -> float:
        """Time of the first row [s]."""
        return float(self.time_s[0])

    @property
    def epoch_s(self) -> float:
        """What is added to a time of the log to give what messages say [s]: nothing."""
        return 0.0

    @property
    def objects(self) -> frozenset[str]:
        """Names of the objects whose poses are in it: a CSV log has none."""
        return frozenset()

    def steps(self) -> Iterator[tuple[float, Inputs]]:
        """Time [s] of every step of a guard and what arrived: a row, or nothing in a gap."""
        last_s: float | None = None
        for joystick, actuators in self.samples():
            now_s = joystick.arrival_s
            if last_s is not None:
                yield from ((idle_s, Inputs()) for idle_s in idle_times(last_s, now_s))
            last_s = now_s
            yield now_s, Inputs((joystick,), (actuators,))

    def positions(self) -> Iterator[tuple[float, FloatArray]]:
        """Where the arm was: time [s] and position (n,) of every row that a guard accepts."""
        some = slice(None) if self.sound is None else self.sound
        yield from zip(self.time_s[some].tolist(), self.position[some], strict=True)


def read_csv_log(site: Site, path: str | Path, limits: FloatArray) -> CsvLog:
    """Read a CSV log and check that it can be what the site file says it is.

    Args:
        site: with a `log` mapping.
        path: the CSV file, with a header.
        limits: actuator limits (n, 2) [unit].

    Raises:
        LogError: no mapping, unreadable, a column is missing, or its values are impossible.
    """
    mapping = site.log
    if mapping is None:
        raise LogError(f"{site.path}: no 'log' mapping; name the CSV columns under 'log:'")
    names = site.actuator_names
    columns = [mapping.time]
    columns += [mapping.joystick[n] for n in names] + [mapping.actuators[n] for n in names]
    rows, lines, warnings = numbered_rows(Path(path), columns)
    n = len(names)
    axes = np.zeros((len(rows), site.guard.axes))
    for j, actuator in enumerate(site.guard.actuators):
        axes[:, actuator.axis] = rows[:, 1 + j]
    log = CsvLog(str(path), rows[:, 0], axes, rows[:, 1 + n :], tuple(warnings))
    _check(site, log, limits)
    sound, refused = _gated(site, log, limits, lines)
    return replace(log, sound=sound, refused=tuple(refused))


def _gated(
    site: Site, log: CsvLog, limits: FloatArray, lines: list[int]
) -> tuple[npt.NDArray[np.bool_], list[str]]:
    """Which positions a guard accepts (k,), and a warning for each reason why not."""
    config = site.guard
    gate = InputGate(config.actuators, limits, config.inputs, config.axes)
    sound = np.ones(len(lines), dtype=np.bool_)
    found: dict[str, list[tuple[int, str]]] = {}
    for k, (joystick, actuators) in enumerate(log.samples()):
        for verdict in (gate.joystick(joystick), gate.actuators(actuators)):
            if isinstance(verdict, Rejection):
                sound[k] &= verdict.input != "actuators"
                key = f"{verdict.input}: {verdict.reason}"
                found.setdefault(key, []).append((lines[k], verdict.detail))
    return sound, [
        f"{log.path}:{where[0][0]}: a guard refuses this row ({key}: {where[0][1]})"
        + (f", and {len(where) - 1} more for this reason" if len(where) > 1 else "")
        for key, where in found.items()
    ]


def _check(site: Site, log: CsvLog, limits: FloatArray) -> None:
    mapping = site.log
    if mapping is None:
        return
    problems = time_problems(mapping.time, log.time_s)
    slack = site.guard.inputs.position_slack
    for j, actuator in enumerate(site.guard.actuators):
        name = actuator.name
        u, q = log.axes[:, actuator.axis], log.position[:, j]
        problems += _outside(mapping.joystick[name], u, -_AXIS_LIMIT, _AXIS_LIMIT, "an axis -1…1")
        low, high = limits[j]
        width = (high - low) * slack if np.isfinite(high - low) else 0.0
        problems += _outside(
            mapping.actuators[name], q, low - width, high + width, f"the limits of {name!r}"
        )
        problems += _against(mapping.joystick[name], name, u * actuator.sign, q)
    if problems:
        raise LogError(
            f"{log.path}: this cannot be what the site file's 'log' says:",
            *(f"  {problem}" for problem in problems),
            "  Are columns swapped, or is a scale wrong? Nothing was learned from it.",
        )


def _outside(
    column: ColumnMap, values: FloatArray, low: float, high: float, what: str
) -> list[str]:
    outside = (values < low) | (values > high)
    share = float(outside.mean())
    if share <= _WRONG_SHARE:
        return []
    worst = values[np.argmax(np.maximum(low - values, values - high))]
    raw = (worst - column.offset) / column.scale
    return [
        (
            f"column {column.column!r}: {share:.0%} of the rows are outside {what}"
            f" (worst {worst:.3g}, logged as {raw:.4g})"
        )
    ]


def _against(column: ColumnMap, name: str, u: FloatArray, q: FloatArray) -> list[str]:
    """A lever that mostly moves its actuator the other way has the wrong sign or column."""
    lag = 3  # rows: the actuator answers late, whatever the rate of the log
    if len(u) <= 2 * lag:
        return []
    moved = q[2 * lag :] - q[lag:-lag]
    commanded = u[lag:-lag]
    clear = (np.abs(commanded) > _CLEAR_COMMAND) & (moved != 0.0)
    if clear.sum() < len(u) * 0.01:
        return []
    against = float((commanded[clear] * moved[clear] < 0).mean())
    if against < _AGAINST_SHARE:
        return []
    return [
        (
            f"column {column.column!r}: {name!r} moves against its command in {against:.0%}"
            " of the rows: wrong sign or wrong column"
        )
    ]
