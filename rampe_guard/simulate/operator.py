"""The simulated operator: works a cycle by joystick, notices late when he went too far.

Like a person he varies from cycle to cycle (`work.plan_cycle`), trembles a little, eases off
near his target and foresees only roughly where the machine will stop. One seed gives one
working day.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.work import (
    Habits,
    Phase,
    PlannedMove,
    Waypoint,
    check_waypoints,
    plan_cycle,
)


class Operator:
    """Drives the cycle for ever; `step` is called at the rate of the joystick.

    Args:
        actuators: of the machine, in order.
        waypoints: the work, in order; each move and overshoot names an actuator.
        seed: of everything he does.
        habits: how he does it.

    Attributes:
        cycles: whole cycles done.
        overshoots: times he went too far.

    Raises:
        ValueError: a waypoint names an unknown actuator, or an overshoot one that its
            waypoint does not move; there are no waypoints.
    """

    def __init__(
        self,
        actuators: Sequence[ActuatorConfig],
        waypoints: Sequence[Waypoint],
        seed: int,
        habits: Habits | None = None,
    ) -> None:
        self._names = tuple(a.name for a in actuators)
        check_waypoints(waypoints, self._names)
        self._waypoints = tuple(waypoints)
        self._habits = habits or Habits()
        # Two streams: what he plans must not depend on how often his levers are read.
        self._rng, self._hand = np.random.default_rng(seed).spawn(2)
        n = len(actuators)
        self._speed = np.array([a.max_velocity for a in actuators])
        self._lag_s = np.array([a.lag_s for a in actuators])
        self._braking = np.array([a.max_deceleration for a in actuators])
        self._signs = np.array([a.sign for a in actuators], dtype=np.float64)
        self._axes = [a.axis for a in actuators]
        self._lever = np.zeros(n)
        self._tremor = np.zeros(n)
        self._todo: list[Phase] = []
        self._begun_s: float | None = None
        self._idle_from_s: float | None = None
        self._last_s: float | None = None
        self._directions: dict[PlannedMove, float] = {}
        self.cycles = 0
        self.overshoots = 0

    @property
    def phase(self) -> str:
        """What he is doing now."""
        return self._todo[0].name if self._todo else "idle"

    def step(self, time_s: float, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the joystick axes (m,) in [-1, 1] at ``time_s``, which must not go back.

        Args:
            time_s: now [s].
            position: (n,) [unit], as he sees the machine.
            velocity: (n,) [unit/s].
        """
        dt_s = 0.0 if self._last_s is None else time_s - self._last_s
        self._last_s = time_s
        self._next_phase(time_s)
        phase = self._todo[0]
        if self._begun_s is None:
            self._begin(phase, time_s, position)
        wanted = self._wanted(phase, time_s, position, velocity)
        reach = self._habits.lever_rate * dt_s
        self._lever = self._lever + np.clip(wanted - self._lever, -reach, reach)
        if self._idle_from_s is None and not self._directions and not np.any(self._lever):
            self._idle_from_s = time_s
        return self._axes_of(dt_s)

    def _next_phase(self, time_s: float) -> None:
        rested = self._idle_from_s is not None and (
            time_s >= self._idle_from_s + self._todo[0].pause_s
        )
        if rested:
            self._todo.pop(0)
            self._begun_s = self._idle_from_s = None
            self.cycles += not self._todo
        if not self._todo:
            self._todo = list(plan_cycle(self._waypoints, self._names, self._habits, self._rng))

    def _begin(self, phase: Phase, time_s: float, position: FloatArray) -> None:
        self._begun_s = time_s
        self.overshoots += phase.too_far
        self._directions = {
            move: float(np.sign(move.target - position[move.actuator])) for move in phase.moves
        }

    def _wanted(
        self, phase: Phase, time_s: float, position: FloatArray, velocity: FloatArray
    ) -> FloatArray:
        """Return where each lever should be (n,); lets go of those whose machine part arrives."""
        wanted = np.zeros(len(self._names))
        elapsed_s = time_s - (self._begun_s or 0.0)
        for move in phase.moves:
            i = move.actuator
            direction = self._directions.get(move)
            if direction is None or elapsed_s < move.start_s:
                continue
            coast_s = self._lag_s[i] + 0.5 * abs(velocity[i]) / self._braking[i]
            to_go = direction * (move.target - position[i] - move.foresight * coast_s * velocity[i])
            longest_s = move.start_s + 3.0 + 3.0 * abs(to_go) / self._speed[i]
            if to_go <= 0.0 or elapsed_s > longest_s:
                del self._directions[move]
                continue
            push = to_go / (self._speed[i] * self._habits.slow_down_s)
            wanted[i] = direction * np.clip(push, self._habits.gentle, move.push)
        return wanted

    def _axes_of(self, dt_s: float) -> FloatArray:
        # A hand trembles slowly (0.2 s) and in proportion to the push; a free lever is still.
        keep = float(np.exp(-dt_s / 0.2))
        fresh = self._hand.normal(0.0, self._habits.lever_noise, self._lever.shape)
        self._tremor = keep * self._tremor + np.sqrt(1.0 - keep**2) * fresh
        axes = np.zeros(max(self._axes) + 1)
        axes[self._axes] = self._signs * np.clip(self._lever * (1.0 + self._tremor), -1.0, 1.0)
        return axes
