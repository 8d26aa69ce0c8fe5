"""What the operator is doing: lever to category to primitive to learned displacement.

Composes blocks 1 to 19 of the flow chart: a category change ends the primitive under way,
whose displacement is learned, and starts the next, whose displacement is forecast.
"""

from __future__ import annotations

from typing import Literal

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.events import PredictionEvent, PredictionSummary, SweepSummary
from rampe_guard.core.joystick import CategoryChange, CategoryDetector
from rampe_guard.core.primitive import FinishedPrimitive, Primitive, PrimitiveTracker
from rampe_guard.core.rampe import DisplacementForecast, Rampe
from rampe_guard.core.types import ActuatorSample, FloatArray, JoystickSample

_UPDATE_S = 0.2
"""Shortest time between two updates of one prediction [s]."""


class Intention:
    """Follows the operator and learns his primitives.

    Attributes:
        rampe: the learned models.
        forecast: x̂ of the primitive under way, or None.
    """

    def __init__(self, config: GuardConfig, limits: FloatArray) -> None:
        self._detector = CategoryDetector(config.actuators, config.joystick)
        self._tracker = PrimitiveTracker()
        self._shortest_s = config.joystick.debounce_s
        self.rampe = Rampe(
            len(config.actuators),
            n_init=config.rampe.n_init,
            tol=config.rampe.tol,
            forgetting=config.rampe.forgetting,
            limits=limits,
            prior=config.rampe.prior,
        )
        self.forecast: DisplacementForecast | None = None
        self._seq = 0
        self._updated_s = float("-inf")
        self._stamp_s = 0.0

    @property
    def current(self) -> Primitive | None:
        """The primitive under way."""
        return self._tracker.current

    @property
    def command(self) -> FloatArray:
        """Filtered command per actuator (n,) [-]."""
        return self._detector.command

    def joystick(
        self, sample: JoystickSample, now_s: float, *, learn: bool
    ) -> list[PredictionEvent]:
        """Take a lever sample; ``learn`` is False while the inputs cannot be trusted."""
        self._stamp_s = sample.stamp_s
        change = self._detector.update(sample.stamp_s, sample.axes)
        return self._changed(change, now_s, learn=learn)

    def actuators(
        self, sample: ActuatorSample, now_s: float, *, learn: bool
    ) -> list[PredictionEvent]:
        """Take a position sample."""
        self._stamp_s = sample.stamp_s
        self._tracker.position(sample.stamp_s, sample.position)
        change = self._detector.advance(sample.stamp_s)
        return self._changed(change, now_s, learn=learn)

    def interrupt(self) -> None:
        """Something was missing: the primitive under way will not be learned."""
        self._tracker.interrupt()

    def reset(self) -> None:
        """A sender started anew: forget the primitive under way, keep what was learned."""
        self._tracker.reset()
        self._detector.reset()
        self.forecast = None

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
            learned = learn and self._learn(finished)
            summary = self._summary(finished.primitive, finished.displacement)
            events.append(self._event("ended", summary, now_s, learned=learned))
        self.forecast = None
        current = self._tracker.current
        if current is not None:
            self.forecast = self.rampe.predict(current.category, current.start)
            events.append(self._event("started", self._summary(current, current.start * 0), now_s))
        return events

    def _learn(self, finished: FinishedPrimitive) -> bool:
        primitive = finished.primitive
        if not finished.complete or finished.end_s - primitive.start_s < self._shortest_s:
            return False
        self.rampe.observe(primitive.category, primitive.start, finished.displacement)
        return True

    def _summary(self, primitive: Primitive, progress: FloatArray) -> PredictionSummary:
        known = self.forecast
        return PredictionSummary(
            category=primitive.category,
            occurrences=self.rampe.categories.get(primitive.category, 0),
            mean=None if known is None else known.mean,
            scale=None if known is None else known.scale,
            dof=None if known is None else known.dof,
            start=primitive.start,
            endpoint=None if known is None else primitive.start + known.mean,
            progress=progress,
        )

    def _event(
        self,
        event: Literal["started", "updated", "ended"],
        summary: PredictionSummary,
        now_s: float,
        sweeps: tuple[SweepSummary, ...] = (),
        *,
        learned: bool = False,
    ) -> PredictionEvent:
        self._seq += 1
        self._updated_s = now_s
        return PredictionEvent(event, self._seq, summary, learned, sweeps, self._stamp_s, now_s)
