"""Logs of work, whatever they are kept in: MCAP, ROS bags, or CSV as the site file maps it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, JoystickSample
from rampe_guard.errors import LogError
from rampe_guard.recording.bag import BagReading, is_bag
from rampe_guard.recording.mcap_log import McapLog
from rampe_guard.recording.reader import MAGIC, McapReading
from rampe_guard.runtime.csv_log import read_csv_log
from rampe_guard.settings import Site


class Log(Protocol):
    """What happened, on the clock of the log [s]."""

    @property
    def path(self) -> str:
        """Where it came from."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is wrong with it, a sentence each."""
        ...

    @property
    def left_out(self) -> tuple[str, ...]:
        """What of that could not be read."""
        ...

    @property
    def first_s(self) -> float:
        """When a guard of it starts [s]."""
        ...

    @property
    def epoch_s(self) -> float:
        """What is added to a time of the log to give what messages say [s]."""
        ...

    @property
    def objects(self) -> frozenset[str]:
        """Names of the objects whose poses are in it."""
        ...

    @property
    def time_s(self) -> FloatArray:
        """Times of the rows (k,) [s]: good positions for which a lever is known."""
        ...

    @property
    def axes(self) -> FloatArray:
        """The last lever before each (k, m) [-]."""
        ...

    @property
    def position(self) -> FloatArray:
        """The positions (k, n) [unit]."""
        ...

    def steps(self) -> Iterator[tuple[float, Inputs]]:
        """Time [s] of every step of a guard, and what arrived for it, if anything."""
        ...

    def positions(self) -> Iterator[tuple[float, FloatArray]]:
        """Where the arm was: time [s], later each time, and position (n,)."""
        ...

    def samples(self) -> Iterator[tuple[JoystickSample, ActuatorSample]]:
        """One pair for each row; both arrive when they are stamped."""
        ...


def open_log(site: Site, path: str | Path, limits: FloatArray) -> Log:
    """Open a log for a site; MCAP, ROS bags and CSV are told apart by what is in the file.

    Args:
        site: whose guard is to see it.
        path: of the log.
        limits: actuator limits (n, 2) [unit].

    Raises:
        LogError: it cannot be read, or cannot be what the site file says.
    """
    if is_bag(path):
        return McapLog(site, BagReading(site, path), limits)
    if is_mcap(path):
        return McapLog(site, McapReading(path), limits)
    return read_csv_log(site, path, limits)


def is_mcap(path: str | Path) -> bool:
    """Whether a file begins as MCAP files do.

    Raises:
        LogError: it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from None
