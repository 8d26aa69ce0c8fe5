"""A log as the baselines see it: the state of arm and lever at each accepted position.

The same gate, velocity, stopping forecast and primitives as in the guard, so that a baseline
knows what the guard knows at that moment, and differs only in what it makes of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from rampe_guard.core.arrays import Arrays
from rampe_guard.core.config import GuardConfig
from rampe_guard.core.events import PredictionEvent
from rampe_guard.core.forecast import Forecaster, IntentForecast
from rampe_guard.core.inputs import Accepted, InputGate, Rejection
from rampe_guard.core.intention import Intention
from rampe_guard.core.monitor import InputMonitor, Status
from rampe_guard.core.types import ActuatorSample, FloatArray, InputName, Inputs, JoystickSample
from rampe_guard.core.velocity import VelocityEstimator
from rampe_guard.evaluate.running_mean import MeanByCategory

S = TypeVar("S", JoystickSample, ActuatorSample)


@dataclass(frozen=True, slots=True)
class Moment:
    """What is known at one evaluation of n actuators.

    Attributes:
        time_s: of the evaluation [s].
        q: position (n,) [unit].
        velocity: (n,) [unit/s].
        stopping: displacement to where the arm stops if the lever is let go now (n,) [unit].
        intent: forecast of the primitive under way by RAMPE, None without one.
        mean: displacement to the mean end of the primitive's category (n,) [unit], zero
            without one.
    """

    time_s: float
    q: FloatArray
    velocity: FloatArray
    stopping: FloatArray
    intent: IntentForecast | None
    mean: FloatArray


@dataclass(slots=True)
class Knowledge:
    """What the baselines learn of an operator: RAMPE's models, and means by category."""

    rampe: Arrays | None = None
    means: MeanByCategory | None = None


class Walker:
    """Follows one log.

    Args:
        config: the guard's settings.
        limits: actuator limits (n, 2) [unit].
        start_s: time at which the log begins [s].
        knowledge: what earlier logs taught.
        learn: whether this log teaches, too.
    """

    def __init__(
        self,
        config: GuardConfig,
        limits: FloatArray,
        start_s: float,
        knowledge: Knowledge,
        *,
        learn: bool,
    ) -> None:
        alerts = config.alerts
        tail = max(alerts.caution_probability - alerts.deadband_probability, 0.02)
        self._gate = InputGate(config.actuators, limits, config.inputs, config.axes)
        self._monitor = InputMonitor(config.inputs, start_s)
        self._velocity = VelocityEstimator(np.array([a.max_velocity for a in config.actuators]))
        self._forecaster = Forecaster(config.actuators, limits, config.stopping.reaction_s, tail)
        self._intention = Intention(config, limits)
        if knowledge.rampe is not None:
            self._intention.rampe.restore(knowledge.rampe)
        self._means = knowledge.means or MeanByCategory()
        self._learn = learn

    @property
    def knowledge(self) -> Knowledge:
        """What is known now."""
        return Knowledge(self._intention.rampe.snapshot(), self._means)

    def follow(self, steps: Iterable[tuple[float, Inputs]]) -> list[Moment]:
        """The moment of every step that brought a position while both inputs were fresh."""
        moments = []
        for now_s, inputs in steps:
            for name, reason in inputs.rejected:
                self._monitor.reject(name, reason, now_s)
                self._intention.interrupt()
            newest = None
            samples: list[JoystickSample | ActuatorSample] = [*inputs.joystick, *inputs.actuators]
            for sample in sorted(samples, key=lambda s: s.stamp_s):  # the joystick first at a tie
                newest = self._take(sample, now_s) or newest
            if self._monitor.health(now_s).status is Status.NOT_MONITORING:
                self._intention.interrupt()
            elif newest is not None:
                moments.append(self._moment(newest.position, now_s))
        return moments

    def _take(self, sample: JoystickSample | ActuatorSample, now_s: float) -> ActuatorSample | None:
        learn = self._learn and self._monitor.plausible(now_s)
        if isinstance(sample, JoystickSample):
            lever = self._accept("joystick", self._gate.joystick(sample), now_s)
            if lever is not None:
                self._taught(self._intention.joystick(lever, now_s, learn=learn))
            return None
        moved = self._accept("actuators", self._gate.actuators(sample), now_s)
        if moved is not None:
            self._velocity.update(moved)
            v = self._velocity.velocity
            self._taught(self._intention.actuators(moved, v, now_s, learn=learn))
        return moved

    def _accept(self, name: InputName, verdict: Accepted[S] | Rejection, now_s: float) -> S | None:
        if isinstance(verdict, Rejection):
            self._monitor.reject(name, verdict.reason, now_s)
            self._intention.interrupt()
            return None
        self._monitor.accept(name, verdict.sample.arrival_s)
        if verdict.restarted:
            self._velocity.reset()
            self._intention.reset()
        return verdict.sample

    def _taught(self, events: list[PredictionEvent]) -> None:
        for event in events:
            if event.event == "ended" and event.learned:
                self._means.learn(event.prediction.category, event.prediction.progress)

    def _moment(self, q: FloatArray, now_s: float) -> Moment:
        v, u = self._velocity.velocity, self._intention.command
        current, known = self._intention.current, self._intention.forecast
        intent, mean = None, np.zeros_like(q)
        if current is not None and known is not None:
            under_way = self._intention.under_way()
            intent = self._forecaster.intent(q, v, u, current, known, under_way)
        if current is not None and (usual := self._means.of(current.category)) is not None:
            sign = np.array(current.category, dtype=np.float64)
            mean = sign * np.maximum(sign * (current.start + usual - q), 0.0)
        stopping = self._forecaster.stopping(q, v, u).displacement
        return Moment(now_s, q, v, stopping, intent, mean)
