"""Operator and machine together, as a generator of what a site would send."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.machine import Machine, MachineState, at_rest, measure, step
from rampe_guard.simulate.operator import Operator


class Tick(NamedTuple):
    """One instant: time since the start [s], joystick axes (m,), measured position and velocity."""

    time_s: float
    axes: FloatArray
    position: FloatArray
    velocity: FloatArray


def simulate(
    actuators: Sequence[ActuatorConfig],
    operator: Operator,
    machine: Machine,
    start: FloatArray,
    *,
    rate_hz: float = 50.0,
    duration_s: float | None = None,
    cycles: int | None = None,
    seed: int = 0,
    shape: Callable[[FloatArray], FloatArray] | None = None,
) -> Iterator[Tick]:
    """Let ``operator`` work ``machine`` from rest at ``start`` (n,); no clock, as fast as asked.

    Args:
        actuators: say which axis moves which actuator, and with which sign.
        operator: advanced by the run; the same seed and start give the same run.
        machine: what is driven.
        start: first position (n,) [unit].
        rate_hz: of both signals [Hz].
        duration_s: ends the run after this time [s].
        cycles: ends the run after this many whole cycles; whichever comes first. Neither: never.
        seed: of the sensor noise.
        shape: what the machine makes of a command (n,), along its actuators; None: obeys it.

    Yields:
        One `Tick` per period, the first at time 0.

    Raises:
        ValueError: ``rate_hz`` is not positive, or ``start`` has the wrong shape.
    """
    if rate_hz <= 0.0:
        raise ValueError(f"rate_hz={rate_hz} must be above 0")
    if np.shape(start) != machine.lower.shape:
        raise ValueError(f"start.shape={np.shape(start)} but the machine has {machine.lower.size}")
    axis = [a.axis for a in actuators]
    sign = np.array([a.sign for a in actuators], dtype=np.float64)
    rng = np.random.default_rng(seed)
    state: MachineState = at_rest(machine, start)
    k = 0
    while not _over(k / rate_hz, duration_s, operator.cycles, cycles):
        axes = operator.step(k / rate_hz, state.position, state.velocity)
        yield Tick(k / rate_hz, axes, *measure(machine, state, rng))
        command = sign * axes[axis]
        state = step(machine, state, command if shape is None else shape(command), 1.0 / rate_hz)
        k += 1


def _over(time_s: float, duration_s: float | None, done: int, cycles: int | None) -> bool:
    return (duration_s is not None and time_s >= duration_s) or (
        cycles is not None and done >= cycles
    )
