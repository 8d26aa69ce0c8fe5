"""Offline replay: a log through `Guard.step`, as fast as it goes, always with the same result.

The live worker steps when something arrives and, in between, often enough to notice silence.
A log gives the same steps on its own clock: one for what arrived together, and in every gap
those that a live guard would have made.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

from rampe_guard.core.types import Inputs

if TYPE_CHECKING:  # a recorder needs no guard, and starts the sooner
    from rampe_guard.core.events import Event
    from rampe_guard.core.guard import Guard

IDLE_STEP_S = 0.05
"""Period of steps while nothing arrives [s], live and in replay."""


class Steps(Protocol):
    """Whatever can be replayed."""

    def steps(self) -> Iterator[tuple[float, Inputs]]:
        """Time [s] of every step of a guard, and what arrived for it."""
        ...


def idle_times(last_s: float, until_s: float) -> Iterator[float]:
    """Times of the steps between two of which something arrived [s]."""
    idle_s = last_s + IDLE_STEP_S
    while idle_s < until_s:
        yield idle_s
        idle_s += IDLE_STEP_S


def replay(guard: Guard, log: Steps) -> Iterator[tuple[float, tuple[Event, ...]]]:
    """Yield (time [s], events) of every step; ``guard`` was started at the log's first time."""
    for now_s, inputs in log.steps():
        yield now_s, guard.step(inputs, now_s)
