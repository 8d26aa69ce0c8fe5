"""An operator who looks again: when he has come to rest far from the target, he corrects.

The quarry's operator lives with where he stops. The one of the paper's engineering test has
targets to meet, so after each move and his reaction time he compares and, where he is too far
off for his taste, pushes once more, gently, with the actuators concerned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.operator import Operator
from rampe_guard.simulate.work import Habits, Phase, PlannedMove, Waypoint

CORRECTION = "correct"
"""Name of the phase in which he corrects."""


@dataclass(frozen=True, slots=True)
class Care:
    """What the operator still accepts, and how he corrects.

    Attributes:
        tolerance: of each actuator (n,) [unit]; further off than this he corrects.
        push: lever of a correction, (least, most) of a uniform draw [-].
        foresight: how much of the coming stop he allows for, likewise [-].
        tries: corrections of one move at most.
    """

    tolerance: FloatArray
    push: tuple[float, float] = (0.35, 0.5)
    foresight: tuple[float, float] = (0.8, 1.2)
    tries: int = 2


class CarefulOperator(Operator):
    """Drives the cycle for ever and corrects what came out too far from its waypoint.

    Args:
        actuators: of the machine, in order.
        waypoints: the work, in order, each with a name of its own.
        seed: of everything he does.
        habits: how he drives.
        care: when and how he corrects.

    Attributes:
        corrections: moves that he made a second or third time.

    Raises:
        ValueError: as `Operator`; or the tolerance is not one positive value per actuator; or
            two waypoints have one name.
    """

    def __init__(
        self,
        actuators: Sequence[ActuatorConfig],
        waypoints: Sequence[Waypoint],
        seed: int,
        habits: Habits,
        care: Care,
    ) -> None:
        super().__init__(actuators, waypoints, seed, habits)
        if care.tolerance.shape != (len(actuators),) or not np.all(care.tolerance > 0.0):
            raise ValueError(f"tolerance={care.tolerance} must be {len(actuators)} values above 0")
        names = [w.name for w in waypoints]
        if len({*names, CORRECTION}) <= len(names):
            raise ValueError(f"waypoints {names} need names of their own, not {CORRECTION!r}")
        self._care = care
        # his second looks must not change what he plans
        self._second = np.random.default_rng([seed, 1])
        self._goal = {
            w.name: {self._names.index(m.actuator): m.target for m in w.moves} for w in waypoints
        }
        self._tries = 0
        self._meant: dict[int, float] = {}
        self.corrections = 0

    def step(self, time_s: float, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the joystick axes (m,) in [-1, 1] at ``time_s``; see `Operator.step`."""
        if self._rested(time_s):
            self._look(position)
        return super().step(time_s, position, velocity)

    def _rested(self, time_s: float) -> bool:
        idle_s = self._idle_from_s
        return idle_s is not None and time_s >= idle_s + self._todo[0].pause_s

    def _look(self, position: FloatArray) -> None:
        """Put a correction after the phase that has just ended, where one is needed."""
        phase = self._todo[0]
        if phase.name in self._goal:
            self._meant, self._tries = self._goal[phase.name], 0
        if phase.too_far:  # he is about to come back
            return
        off = {
            i: target
            for i, target in self._meant.items()
            if abs(target - position[i]) > self._care.tolerance[i]
        }
        if not off or self._tries >= self._care.tries:
            return
        self._tries += 1
        self.corrections += 1
        moves = tuple(
            PlannedMove(
                actuator=i,
                target=target,
                start_s=float(self._second.uniform(*self._habits.stagger_s)),
                push=float(self._second.uniform(*self._care.push)),
                foresight=float(self._second.uniform(*self._care.foresight)),
            )
            for i, target in off.items()
        )
        pause_s = float(self._second.uniform(*self._habits.reaction_s))
        self._todo.insert(1, Phase(CORRECTION, moves, pause_s))
