"""The simulated machine: dead time, first-order drives, limits, end stops.

Pure: state, command and time step in, next state out. Nothing here knows of an operator,
of geometry or of a clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray

_MAX_STEP_S = 0.01
_EPSILON_S = 1e-9


@dataclass(frozen=True, slots=True)
class Machine:
    """What n actuators can do; arrays of shape (n,).

    Attributes:
        max_velocity: at full command [unit/s].
        max_acceleration: largest change of velocity, speeding up and braking [unit/s²].
        lag_s: command to motion [s].
        deadband: command size that moves nothing [-].
        lower: end stop [unit]; may be -inf.
        upper: end stop [unit]; may be inf.
        time_constant_s: of the velocity behind the delayed command [s].
        position_noise: standard deviation of a measured position [unit].
        velocity_noise: standard deviation of a measured velocity [unit/s].
    """

    max_velocity: FloatArray
    max_acceleration: FloatArray
    lag_s: FloatArray
    deadband: FloatArray
    lower: FloatArray
    upper: FloatArray
    time_constant_s: float = 0.06
    position_noise: float = 2e-4
    velocity_noise: float = 2e-3


@dataclass(frozen=True, slots=True)
class MachineState:
    """Where the machine is, and the commands still under way to its drives.

    Attributes:
        time_s: since the start [s].
        position: (n,) [unit].
        velocity: (n,) [unit/s].
        commands: (time given [s], command (n,)), oldest first; as old as the longest lag.
    """

    time_s: float
    position: FloatArray
    velocity: FloatArray
    commands: tuple[tuple[float, FloatArray], ...] = field(default=())


def build_machine(
    actuators: Sequence[ActuatorConfig],
    limits: Sequence[tuple[float | None, float | None]] | FloatArray,
    *,
    time_constant_s: float = 0.06,
) -> Machine:
    """Build the machine that a site file describes.

    Args:
        actuators: n actuators.
        limits: n pairs (lower, upper) [unit]; None or infinite = no end stop on that side.
        time_constant_s: of the drives [s].

    Returns:
        A machine that keeps exactly to the speeds, decelerations and lags of the site file.

    Raises:
        ValueError: the number of limits differs from the number of actuators, or a lower
            limit is not below its upper one.
    """
    if len(limits) != len(actuators):
        raise ValueError(f"{len(limits)} limits for {len(actuators)} actuators; give one pair each")
    lower = np.array([-np.inf if low is None else low for low, _ in limits], dtype=np.float64)
    upper = np.array([np.inf if high is None else high for _, high in limits], dtype=np.float64)
    if not np.all(lower < upper):
        raise ValueError(f"each lower limit must lie below its upper one: {lower=}, {upper=}")
    return Machine(
        max_velocity=np.array([a.max_velocity for a in actuators]),
        max_acceleration=np.array([a.max_deceleration for a in actuators]),
        lag_s=np.array([a.lag_s for a in actuators]),
        deadband=np.array([a.deadband for a in actuators]),
        lower=lower,
        upper=upper,
        time_constant_s=time_constant_s,
    )


def at_rest(machine: Machine, position: FloatArray) -> MachineState:
    """Return the state at rest at ``position`` (n,), moved inside the end stops."""
    inside = np.clip(np.asarray(position, dtype=np.float64), machine.lower, machine.upper)
    return MachineState(0.0, inside, np.zeros_like(inside))


def step(machine: Machine, state: MachineState, command: FloatArray, dt_s: float) -> MachineState:
    """Advance by ``dt_s`` [s] under ``command`` (n,) in [-1, 1], given now and held.

    Long steps are cut into pieces of 10 ms at most, so the result hardly depends on the
    rate of the caller.
    """
    commands = (*state.commands, (state.time_s, np.clip(command, -1.0, 1.0)))
    pieces = max(1, int(np.ceil(dt_s / _MAX_STEP_S - _EPSILON_S)))
    position, velocity = state.position, state.velocity
    for i in range(pieces):
        delayed = _delayed(commands, state.time_s + i * dt_s / pieces - machine.lag_s)
        position, velocity = _move(machine, position, velocity, delayed, dt_s / pieces)
    time_s = state.time_s + dt_s
    return MachineState(time_s, position, velocity, _recent(commands, time_s - machine.lag_s.max()))


def measure(
    machine: Machine, state: MachineState, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return measured position and velocity, each (n,), with sensor noise."""
    n = state.position.shape
    return (
        state.position + rng.normal(0.0, machine.position_noise, n),
        state.velocity + rng.normal(0.0, machine.velocity_noise, n),
    )


def _delayed(commands: tuple[tuple[float, FloatArray], ...], at_s: FloatArray) -> FloatArray:
    """Return for each actuator the command in force at its own time ``at_s`` (n,)."""
    delayed = np.zeros_like(at_s)
    for given_s, command in commands:
        delayed = np.where(given_s <= at_s + _EPSILON_S, command, delayed)
    return delayed


def _recent(
    commands: tuple[tuple[float, FloatArray], ...], since_s: float
) -> tuple[tuple[float, FloatArray], ...]:
    """Drop what no drive can see any more: all but the last command given by ``since_s``."""
    old = sum(given_s <= since_s + _EPSILON_S for given_s, _ in commands)
    return commands[max(0, old - 1) :]


def _move(
    machine: Machine, position: FloatArray, velocity: FloatArray, command: FloatArray, dt_s: float
) -> tuple[FloatArray, FloatArray]:
    live = np.maximum(np.abs(command) - machine.deadband, 0.0) / (1.0 - machine.deadband)
    wanted = machine.max_velocity * np.sign(command) * live
    change = (wanted - velocity) * (1.0 - np.exp(-dt_s / machine.time_constant_s))
    most = machine.max_acceleration * dt_s
    after = velocity + np.clip(change, -most, most)
    free = position + 0.5 * (velocity + after) * dt_s
    stopped = np.clip(free, machine.lower, machine.upper)
    return stopped, np.where(stopped == free, after, 0.0)
