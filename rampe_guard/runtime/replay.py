"""Offline replay: a log through `Guard.step`, as fast as it goes, always with the same result.

The live worker steps when something arrives and, in between, often enough to notice silence.
Replay does the same on the log's own clock: one step a row, and in every gap the steps that
a live guard would have made.
"""

from __future__ import annotations

from collections.abc import Iterator

from rampe_guard.core.events import Event
from rampe_guard.core.guard import Guard
from rampe_guard.core.types import Inputs
from rampe_guard.runtime.csv_log import CsvLog

IDLE_STEP_S = 0.05
"""Period of steps while nothing arrives [s], live and in replay."""


def replay(guard: Guard, log: CsvLog) -> Iterator[tuple[float, tuple[Event, ...]]]:
    """Yield (time [s], events) of every step; ``guard`` was started at the log's first time."""
    last_s: float | None = None
    for joystick, actuators in log.samples():
        if last_s is not None:
            idle_s = last_s + IDLE_STEP_S
            while idle_s < joystick.arrival_s:
                yield idle_s, guard.step(Inputs(), idle_s)
                idle_s += IDLE_STEP_S
        last_s = joystick.arrival_s
        yield last_s, guard.step(Inputs((joystick,), (actuators,)), last_s)
