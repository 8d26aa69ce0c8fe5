"""An operator who moves each lever once, gently and fully, both ways: to measure a machine by.

Pure, as all of the simulation: no clock, and the same levers for the same machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.machine import Machine, at_rest, measure, step
from rampe_guard.simulate.run import Tick

_PAUSE_S, _RAMP_S, _LONGEST_S = 1.5, 2.5, 2.0
_TRAVEL = 0.35
"""Share of its range by which an actuator is driven from the middle."""
_LEVER_RATE = 8.0
"""How fast a hand moves a lever [1/s]."""
_ENDLESS = 3.0
"""Range of an actuator without limits [unit]."""


def exercise(
    actuators: Sequence[ActuatorConfig],
    machine: Machine,
    *,
    rate_hz: float = 50.0,
    pushes: int = 3,
    seed: int = 0,
) -> Iterator[Tick]:
    """Move each lever in turn: ``pushes`` full pushes and a slow one each way, with rests between.

    Args:
        actuators: say which axis moves which actuator, and with which sign.
        machine: what is driven; it starts in the middle of its travel.
        rate_hz: of both signals [Hz].
        pushes: full ones, each way.
        seed: of the sensor noise.

    Raises:
        ValueError: ``rate_hz`` is not positive.
    """
    if rate_hz <= 0.0:
        raise ValueError(f"rate_hz={rate_hz} must be above 0")
    rng = np.random.default_rng(seed)
    sign = np.array([a.sign for a in actuators], dtype=np.float64)
    axis = [a.axis for a in actuators]
    state = at_rest(machine, _middle(machine))
    lever = np.zeros(len(actuators))
    for k, wanted in enumerate(_script(machine, rate_hz, pushes)):
        lever = lever + np.clip(wanted - lever, -_LEVER_RATE / rate_hz, _LEVER_RATE / rate_hz)
        axes = np.zeros(max(axis) + 1)
        axes[axis] = sign * lever
        yield Tick(k / rate_hz, axes, *measure(machine, state, rng))
        state = step(machine, state, lever, 1.0 / rate_hz)


def _middle(machine: Machine) -> FloatArray:
    bounded = np.isfinite(machine.lower) & np.isfinite(machine.upper)
    low, high = (np.where(bounded, end, 0.0) for end in (machine.lower, machine.upper))
    return np.asarray(0.5 * (low + high))


def _script(machine: Machine, rate_hz: float, pushes: int) -> Iterator[FloatArray]:
    """Where the levers should be, in the direction of motion."""
    still = np.zeros(len(machine.lower))
    for j, (low, high) in enumerate(zip(machine.lower, machine.upper, strict=True)):
        width = high - low if np.isfinite(high - low) else _ENDLESS
        full_s = min(_LONGEST_S, _TRAVEL * width / machine.max_velocity[j])
        one = np.zeros(len(still))
        one[j] = 1.0
        for size in (*([1.0] * pushes), 0.0):
            for way in (1.0, -1.0):
                yield from _held(still, _PAUSE_S, rate_hz)
                if size:
                    yield from _held(way * one, full_s, rate_hz)
                else:  # slowly further, up to half of the lever
                    ticks = round(min(_RAMP_S, 3.0 * full_s) * rate_hz)
                    yield from (way * 0.5 * one * k / ticks for k in range(ticks))
    yield from _held(still, _PAUSE_S, rate_hz)


def _held(lever: FloatArray, seconds: float, rate_hz: float) -> Iterator[FloatArray]:
    for _ in range(max(1, round(seconds * rate_hz))):
        yield lever
