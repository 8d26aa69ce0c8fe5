"""The guard itself on recorded work: what it said of each zone, and the alerts it published.

The floor is the stopping forecast, the score the probability of the intent forecast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rampe_guard.assembly import Machine
from rampe_guard.core.alarm import Level
from rampe_guard.core.arrays import Arrays
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.types import Certificate
from rampe_guard.evaluate.trace import Trace
from rampe_guard.runtime.replay import Steps

Knowledge = Arrays
"""What a guard learned of an operator; it can be sent to another process."""


@dataclass(frozen=True, slots=True)
class GuardRun:
    """One log through the guard.

    Attributes:
        trace: what it said at each evaluation.
        transitions: its published alerts: time [s], zone, level; in order.
        knowledge: what it knows in the end.
    """

    trace: Trace
    transitions: tuple[tuple[float, str, Level], ...]
    knowledge: Knowledge


def guard_trace(
    machine: Machine,
    log: Steps,
    first_s: float,
    zones: tuple[str, ...],
    knowledge: Knowledge | None = None,
    *,
    learn: bool = True,
) -> GuardRun:
    """Let a new guard of the machine follow a log.

    Args:
        machine: loaded.
        log: its steps.
        first_s: time at which it begins [s].
        zones: those that are judged.
        knowledge: what earlier logs taught, None for nothing.
        learn: whether this log teaches, too.
    """
    guard = machine.guard(first_s, "evaluate")
    if knowledge is not None:
        guard.rampe.restore(knowledge)
    if not learn:
        _freeze(guard)
    column = {zone: z for z, zone in enumerate(zones)}
    times: list[float] = []
    scores, floors = [], []
    transitions: list[tuple[float, str, Level]] = []
    last: tuple[object, ...] | None = None
    for now_s, inputs in log.steps():
        events = guard.step(inputs, now_s)
        transitions += [
            (now_s, event.zone, event.level)
            for event in events
            if isinstance(event, AlertEvent) and event.zone != SYSTEM_ZONE
        ]
        if not inputs.actuators:
            continue
        sweeps = guard.snapshot(now_s).sweeps
        if sweeps is last or not sweeps:
            continue
        last = sweeps
        score, floor = np.zeros(len(zones)), np.zeros(len(zones), dtype=np.bool_)
        for told in sweeps:
            found = told.zone
            z = column.get(found.zone)
            leaving = found.inside and not found.closing
            if z is None or leaving or found.certificate is Certificate.FREE:
                continue
            if told.source == "stopping":
                floor[z] = True
            else:
                score[z] = max(score[z], told.probability)
        times.append(now_s)
        scores.append(score)
        floors.append(floor)
    shape = (len(times), len(zones))
    trace = Trace(
        np.array(times),
        zones,
        np.array(scores).reshape(shape),
        np.array(floors, dtype=np.bool_).reshape(shape),
    )
    return GuardRun(trace, tuple(transitions), guard.rampe.snapshot())


def _freeze(guard: Guard) -> None:
    """Let it learn nothing more."""
    rampe = guard.rampe
    rampe.observe = lambda *_args, **_more: None  # type: ignore[method-assign]
    rampe.learn_passing = lambda *_args, **_more: None  # type: ignore[method-assign]
