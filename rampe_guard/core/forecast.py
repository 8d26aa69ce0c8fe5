"""Forecasts: where the arm is going, as one straight actuator path each.

*Stopping*: where the arm comes to rest if the operator lets go after his reaction time:

    while he holds the lever:   v·lag + v'·reaction + v'²/(2a),  v' = the faster of v and the
                                speed that his command will bring
    once he has let go:         v·lag + v²/(2a)

It needs no learning and is the floor under everything.

*Intent*: on to q[k] + x of the primitive under way. x is uncertain, so the path leads to the
displacement that is exceeded with a small probability, and the place of a contact on it gives
the probability that the operator goes that far, given his progress, lever and speed
(`displacement.DisplacementForecast.passing`).

Actuators are taken to overshoot together (one quantile level for all): that keeps the path
straight and overestimates rather than underestimates the reach of the arm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.passing import UnderWay
from rampe_guard.core.primitive import Primitive
from rampe_guard.core.types import FloatArray

_TINY = 1e-12
_CREEP_SHARE = 0.05
"""Slowest speed, as a share of the top speed, with which a time to collision is reckoned."""


@dataclass(frozen=True, slots=True)
class StoppingForecast:
    """The stopping path.

    Attributes:
        displacement: (n,) [unit].
        speed: |v'| (n,) before braking [unit/s].
        coast_s: (n,) time before braking begins [s].
        deceleration: (n,) [unit/s²].
        lag_s: (n,) time in which the machine does not yet obey [s].
    """

    displacement: FloatArray
    speed: FloatArray
    coast_s: FloatArray
    deceleration: FloatArray
    lag_s: FloatArray

    @property
    def stop_s(self) -> float:
        """Time until every actuator rests [s]."""
        moving = self.speed > 0.0
        total = np.where(moving, self.coast_s + self.speed / self.deceleration, 0.0)
        return float(total.max(initial=0.0))

    @property
    def brake_s(self) -> float:
        """Time [s] that the path takes at the speed before braking if he lets go at once.

        What is met sooner is met whatever he does.
        """
        moving = self.speed > 0.0
        total = np.where(moving, self.lag_s + self.speed / self.deceleration / 2.0, 0.0)
        return float(total.max(initial=0.0))

    def time_at(self, fraction: float) -> float:
        """Time [s] at which ``fraction`` of the path is reached if the operator does not let go.

        The busiest actuator counts, at the speed before braking: a warning promises no more
        time than an operator has who does not heed it.
        """
        times = np.abs(self.displacement) / np.maximum(self.speed, _TINY)
        return fraction * float(times.max(initial=0.0))


@dataclass(frozen=True, slots=True)
class IntentForecast:
    """The intent path, from the present position on.

    Attributes:
        displacement: (n,) to the far quantile [unit].
        progress: distance already made along Ω (n,) [unit].
        belief: distribution of the displacement.
        under_way: lever and speed now, or None if they say nothing.
        duration_s: time the path takes [s].
    """

    displacement: FloatArray
    progress: FloatArray
    belief: DisplacementForecast
    under_way: UnderWay | None
    duration_s: float

    def probability_at(self, fraction: float) -> float:
        """P that the operator goes at least ``fraction`` of the path, given what he did so far."""
        active = self.displacement != 0.0
        if not active.any():
            return 0.0
        distance = self.progress + fraction * np.abs(self.displacement)
        passing = self.belief.passing(distance, self.progress, self.under_way)
        return float(np.clip(passing[active].min(), 0.0, 1.0))

    def time_at(self, fraction: float) -> float:
        """Time [s] at which ``fraction`` of the path is reached."""
        return fraction * self.duration_s


Forecast: TypeAlias = StoppingForecast | IntentForecast


class Forecaster:
    """Makes both forecasts from the present state.

    Args:
        actuators: in site order.
        limits: (n, 2) [unit]; no forecast leads past them.
        reaction_s: operator's reaction time [s].
        tail: probability with which the intent path's end is exceeded [-].
    """

    def __init__(
        self,
        actuators: tuple[ActuatorConfig, ...],
        limits: FloatArray,
        reaction_s: float,
        tail: float,
    ) -> None:
        self._max_velocity = np.array([a.max_velocity for a in actuators])
        self._deceleration = np.array([a.max_deceleration for a in actuators])
        self._lag_s = np.array([a.lag_s for a in actuators])
        self._deadband = np.array([a.deadband for a in actuators])
        self._limits = limits
        self._reaction_s = reaction_s
        self._tail = tail

    def stopping(
        self, q: FloatArray, velocity: FloatArray, command: FloatArray
    ) -> StoppingForecast:
        """Stopping path from q (n,) at ``velocity`` (n,) with the lever at ``command`` (n,)."""
        applied = np.abs(command) > self._deadband
        commanded = np.where(applied, command, 0.0) * self._max_velocity
        faster = (commanded * velocity >= 0.0) & (np.abs(commanded) > np.abs(velocity))
        held = applied & (command * velocity >= 0.0)
        top = np.where(faster, commanded, velocity)
        reaction = np.where(held, self._reaction_s, 0.0)
        travel = (
            velocity * self._lag_s + top * reaction + top * np.abs(top) / 2 / self._deceleration
        )
        return StoppingForecast(
            displacement=self._within(q, travel),
            speed=np.abs(top),
            coast_s=self._lag_s + reaction,
            deceleration=self._deceleration,
            lag_s=self._lag_s,
        )

    def intent(
        self,
        q: FloatArray,
        velocity: FloatArray,
        command: FloatArray,
        primitive: Primitive,
        belief: DisplacementForecast,
        under_way: UnderWay | None = None,
    ) -> IntentForecast:
        """Intent path from q (n,) to the far quantile of the primitive under way."""
        sign = np.array(primitive.category, dtype=np.float64)
        progress = np.maximum(sign * (q - primitive.start), 0.0)
        far = belief.reach(self._tail, progress, under_way)
        displacement = self._within(q, sign * (far - progress))
        return IntentForecast(
            displacement=displacement,
            progress=progress,
            belief=belief,
            under_way=under_way,
            duration_s=self._duration(displacement, velocity, command),
        )

    def _duration(
        self, displacement: FloatArray, velocity: FloatArray, command: FloatArray
    ) -> float:
        """Time [s] for the path at the present or commanded speed, by the busiest actuators."""
        sign = np.sign(displacement)
        creep = _CREEP_SHARE * self._max_velocity
        commanded = sign * command * self._max_velocity
        speed = np.maximum(np.maximum(sign * velocity, commanded), creep)
        at_top = np.abs(displacement) / self._max_velocity  # weighs actuators of unlike units
        if not at_top.any():
            return 0.0
        times = np.abs(displacement) / speed + np.where(sign * velocity > creep, 0.0, self._lag_s)
        return float(at_top @ times / at_top.sum())

    def _within(self, q: FloatArray, displacement: FloatArray) -> FloatArray:
        return within_travel(self._limits, q, displacement)


def within_travel(limits: FloatArray, q: FloatArray, displacement: FloatArray) -> FloatArray:
    """The part of a displacement from ``q``, (n,) each, that leads no further past ``limits``."""
    low = np.minimum(limits[:, 0] - q, 0.0)
    high = np.maximum(limits[:, 1] - q, 0.0)
    return np.clip(displacement, low, high)
