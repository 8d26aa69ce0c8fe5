"""The engineering test of the paper (Sect. IV-B): a hydraulic arm driven along A, B, C, D.

Two actuators, swing q1 [deg] and boom cylinder q2 [m]. The targets are those of Table II.
What the paper does not print (speeds, lags, the operator) has values that are ordinary for a
small excavator: nothing here is fitted to an outcome.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.paper_operator import Care, CarefulOperator
from rampe_guard.simulate.run import simulate
from rampe_guard.simulate.work import Habits, Move, Waypoint

RATE_HZ = 50.0
"""Samples of joystick and actuators [Hz]."""

ACTUATORS = (
    ActuatorConfig("swing", 0, 1, 30.0, 60.0, 0.12, 0.08, "deg"),
    ActuatorConfig("boom", 1, 1, 0.15, 0.5, 0.10, 0.08, "m"),
)
LIMITS: FloatArray = np.array([[-90.0, 90.0], [2.3, 3.2]])
"""End stops (2, 2) [deg], [m]."""

SENSOR_NOISE: FloatArray = np.array([0.05, 5e-4])
"""Standard deviation of a measured position (2,) [deg], [m]."""

TARGETS = {"A": (64.4, 2.79), "B": (22.7, 2.95), "C": (0.0, 2.79), "D": (0.0, 2.60)}
"""Table II: (q1 [deg], q2 [m])."""

WAY = ("A", "B", "C", "D", "C", "B", "A")
"""One cycle: it begins and ends at A."""

_AIM: FloatArray = np.array([1.5, 0.008])
"""Scatter of where he aims, standard deviation (2,) [deg], [m]."""

_HABITS = Habits(
    vigour=(0.6, 1.0),
    slow_down_s=0.3,
    foresight=(0.7, 1.3),
    reaction_s=(0.2, 0.5),
    lever_noise=0.05,
    overshoot_probability=0.0,
)
_CARE = Care(tolerance=np.array([3.0, 0.015]))


@dataclass(frozen=True, slots=True)
class Recording:
    """One run as a site would have recorded it, T samples.

    Attributes:
        seed: of the run.
        time_s: (T,) [s].
        axes: joystick (T, 2) in [-1, 1].
        position: measured (T, 2) [deg], [m].
        corrections: moves that the operator made again.
    """

    seed: int
    time_s: FloatArray
    axes: FloatArray
    position: FloatArray
    corrections: int


def paper_waypoints() -> tuple[Waypoint, ...]:
    """The six moves of a cycle; an actuator that has nothing to do is left alone."""
    moves = []
    for here, there in pairwise(WAY):
        needed = tuple(
            Move(actuator.name, TARGETS[there][i], float(_AIM[i]))
            for i, actuator in enumerate(ACTUATORS)
            if TARGETS[there][i] != TARGETS[here][i]
        )
        moves.append(Waypoint(f"{here} to {there}", needed))
    return tuple(moves)


def paper_run(seed: int, cycles: int) -> Recording:
    """Let the operator work ``cycles`` cycles from A; one seed gives one run.

    Raises:
        ValueError: ``cycles`` is below 1.
    """
    if cycles < 1:
        raise ValueError(f"cycles={cycles} must be 1 or more")
    operator = CarefulOperator(ACTUATORS, paper_waypoints(), seed, _HABITS, _CARE)
    # one number cannot be the noise of degrees and of metres: it is added below
    machine = replace(build_machine(ACTUATORS, LIMITS), position_noise=0.0)
    ticks = list(
        simulate(
            *(ACTUATORS, operator, machine, np.array(TARGETS["A"])),
            rate_hz=RATE_HZ,
            cycles=cycles,
        )
    )
    return Recording(
        seed=seed,
        time_s=np.array([t.time_s for t in ticks]),
        axes=np.array([t.axes for t in ticks]),
        position=_measured(np.array([t.position for t in ticks]), seed),
        corrections=operator.corrections,
    )


def _measured(position: FloatArray, seed: int) -> FloatArray:
    rng = np.random.default_rng([seed, 2])
    return position + rng.normal(0.0, SENSOR_NOISE, position.shape)
