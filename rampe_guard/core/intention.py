"""What the operator is doing: lever to category to primitive to learned displacement.

Composes blocks 1 to 19 of the flow chart: a category change ends the primitive under way,
whose displacement is learned, and starts the next, whose displacement is forecast.
"""

from __future__ import annotations

from collections import Counter
from typing import Literal

import numpy as np

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.events import PredictionEvent, PredictionSummary, SweepSummary
from rampe_guard.core.joystick import CategoryChange, CategoryDetector
from rampe_guard.core.moments import MomentKeeper
from rampe_guard.core.passing import UnderWay
from rampe_guard.core.primitive import FinishedPrimitive, Primitive, PrimitiveTracker
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.start_observer import StartObserver
from rampe_guard.core.types import ActuatorSample, FloatArray, JoystickSample

_UPDATE_S = 0.2
"""Shortest time between two updates of one prediction [s]."""


class Intention:
    """Follows the operator and learns his primitives.

    Attributes:
        rampe: the learned models.
        forecast: x̂ of the primitive under way, or None.
        lessons: finished primitives, "learned" or by the reason why not.
    """

    def __init__(self, config: GuardConfig, limits: FloatArray) -> None:
        self._detector = CategoryDetector(config.actuators, config.joystick)
        self._tracker = PrimitiveTracker()
        self._shortest_s = config.joystick.debounce_s
        self._top = np.array([a.max_velocity for a in config.actuators])
        self._observer = StartObserver(len(config.actuators), config.rampe.observations)
        self.rampe = Rampe(
            len(config.actuators),
            limits=limits,
            config=config.rampe,
            observations=self._observer.size,
        )
        self.forecast: DisplacementForecast | None = None
        self.lessons: Counter[str] = Counter()
        self._seq = 0
        self._updated_s = float("-inf")
        self._stamp_s = 0.0
        self._velocity = np.zeros(len(config.actuators))
        self._xi = np.zeros(self._observer.size)
        self._keeper: MomentKeeper | None = None

    @property
    def current(self) -> Primitive | None:
        """The primitive under way."""
        return self._tracker.current

    @property
    def command(self) -> FloatArray:
        """Filtered command per actuator (n,) [-]."""
        return self._detector.command

    def under_way(self) -> UnderWay | None:
        """Lever and speed as they bear on the primitive under way, or None without one."""
        if self._keeper is None:
            return None
        return self._keeper.under_way(self._velocity, self.command)

    def joystick(
        self, sample: JoystickSample, now_s: float, *, learn: bool
    ) -> list[PredictionEvent]:
        """Take a lever sample; ``learn`` is False while the inputs cannot be trusted."""
        self._stamp_s = sample.stamp_s
        change = self._detector.update(sample.stamp_s, sample.axes)
        return self._changed(change, now_s, learn=learn)

    def actuators(
        self, sample: ActuatorSample, velocity: FloatArray, now_s: float, *, learn: bool
    ) -> list[PredictionEvent]:
        """Take a position sample, with the velocity (n,) [unit/s] at it."""
        self._stamp_s = sample.stamp_s
        self._velocity = velocity
        self._tracker.position(sample.stamp_s, sample.position)
        change = self._detector.advance(sample.stamp_s)
        self._observer.update(sample.stamp_s, self.command, velocity / self._top)
        events = self._changed(change, now_s, learn=learn)
        if self._keeper is not None:
            self._keeper.see(sample.stamp_s, sample.position, velocity, self.command)
        return events

    def interrupt(self) -> None:
        """Something was missing: the primitive under way will not be learned."""
        self._tracker.interrupt()

    def reset(self) -> None:
        """A sender started anew: forget the primitive under way, keep what was learned."""
        self._tracker.reset()
        self._detector.reset()
        self._observer.pause()
        self.forecast = self._keeper = None

    def summary(self, q: FloatArray) -> PredictionSummary | None:
        """The primitive under way, seen from position q (n,)."""
        current = self.current
        return None if current is None else self._summary(current, q - current.start)

    def update(
        self, q: FloatArray, sweeps: tuple[SweepSummary, ...], now_s: float
    ) -> list[PredictionEvent]:
        """The forecast as it is now with its sweeps, if the last word on it is old enough."""
        current = self.current
        if current is None or now_s - self._updated_s < _UPDATE_S:
            return []
        return [self._event("updated", self._summary(current, q - current.start), now_s, sweeps)]

    def _changed(
        self, change: CategoryChange | None, now_s: float, *, learn: bool
    ) -> list[PredictionEvent]:
        if change is None:
            return []
        events = []
        finished = self._tracker.change(change)
        if finished is not None:
            refusal = self._learn(finished) if learn else "inputs_refused"
            self.lessons[refusal or "learned"] += 1
            summary = self._summary(finished.primitive, finished.displacement)
            events.append(self._event("ended", summary, now_s, refusal=refusal))
        self.forecast = self._keeper = None
        current = self._tracker.current
        if current is not None:
            self._keeper = MomentKeeper(current.category, current.start, self._top)
            self._xi = self._observer.start()
            self.forecast = self.rampe.predict(current.category, current.start, self._xi)
            events.append(self._event("started", self._summary(current, current.start * 0), now_s))
        return events

    def _learn(self, finished: FinishedPrimitive) -> str | None:
        """Learn a finished primitive; returns why not, if it was not."""
        primitive = finished.primitive
        if not finished.complete:
            return "incomplete"
        if finished.end_s - primitive.start_s < self._shortest_s:
            return "too_short"
        x = finished.displacement
        refusal = self.rampe.observe(primitive.category, primitive.start, x, self._xi)
        if refusal is None and self.forecast is not None and self._keeper is not None:
            self.rampe.learn_passing(self.forecast, self._keeper.moments, x)
        return refusal

    def _summary(self, primitive: Primitive, progress: FloatArray) -> PredictionSummary:
        known = self.forecast
        return PredictionSummary(
            category=primitive.category,
            occurrences=self.rampe.occurrences(primitive.category),
            mean=None if known is None else known.mean,
            scale=None if known is None else known.scale,
            dof=None if known is None else known.dof,
            start=primitive.start,
            endpoint=None if known is None else primitive.start + known.likeliest,
            progress=progress,
            related=() if known is None else known.related,
            endpoints=None
            if known is None or known.modes is None
            else primitive.start + known.modes,
            endpoint_shares=None if known is None or known.modes is None else known.mode_weights,
        )

    def _event(
        self,
        event: Literal["started", "updated", "ended"],
        summary: PredictionSummary,
        now_s: float,
        sweeps: tuple[SweepSummary, ...] = (),
        *,
        refusal: str | None = None,
    ) -> PredictionEvent:
        self._seq += 1
        self._updated_s = now_s
        learned = event == "ended" and refusal is None
        return PredictionEvent(
            event, self._seq, summary, learned, refusal, sweeps, self._stamp_s, now_s
        )
