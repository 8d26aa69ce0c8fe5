"""Forecasts of the next displacement: RAMPE, and the plain rules it has to beat.

Each forecaster is asked at the start of a primitive and told its end, and knows nothing else.
A forecaster that gives None counts as having said "no motion".
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.intention import Intention
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_estimates import N_INIT, TOL
from rampe_guard.evaluate.predictive import moments
from rampe_guard.evaluate.running_mean import MeanByCategory
from rampe_guard.evaluate.segments import Segment, Start


class Forecaster(Protocol):
    """Predicts first, then learns."""

    def predict(self, start: Start) -> FloatArray | None:
        """Displacement x̂ (n,) [unit] of the primitive that starts, None for no forecast."""
        ...

    def observe(self, segment: Segment) -> None:
        """Learn a primitive that has ended."""
        ...


class Zero:
    """The arm stays where it is."""

    def predict(self, start: Start) -> FloatArray:
        """Zeros (n,)."""
        return np.zeros_like(start.q)

    def observe(self, segment: Segment) -> None:
        """Nothing to learn."""


class LastValue:
    """What the category did the last time."""

    def __init__(self) -> None:
        self._last: dict[Category, FloatArray] = {}

    def predict(self, start: Start) -> FloatArray | None:
        """The last displacement of the category (n,) [unit]."""
        return self._last.get(start.category)

    def observe(self, segment: Segment) -> None:
        """Keep it."""
        self._last[segment.start.category] = segment.displacement


class RunningMean:
    """The mean of what the category did."""

    def __init__(self) -> None:
        self._means = MeanByCategory()

    def predict(self, start: Start) -> FloatArray | None:
        """Mean displacement of the category (n,) [unit]."""
        return self._means.of(start.category)

    def observe(self, segment: Segment) -> None:
        """Move the mean."""
        self._means.learn(segment.start.category, segment.displacement)


class ConstantVelocity:
    """The velocity at detection, held for the mean duration of all primitives so far."""

    def __init__(self) -> None:
        self._count = 0
        self._total_s = 0.0

    def predict(self, start: Start) -> FloatArray | None:
        """Velocity times mean duration (n,) [unit]."""
        return start.velocity * (self._total_s / self._count) if self._count else None

    def observe(self, segment: Segment) -> None:
        """Count its duration."""
        self._count += 1
        self._total_s += segment.duration_s


class FaithfulRampe:
    """RAMPE to the letter of the paper: no prior, no estimate before three occurrences.

    Args:
        actuators: n.
    """

    def __init__(self, actuators: int) -> None:
        self._model = Rampe(actuators, mode="faithful", n_init=N_INIT, tol=TOL)

    def predict(self, start: Start) -> FloatArray | None:
        """Equation (2)."""
        known = self._model.predict(start.category, start.q)
        return None if known is None else known.mean

    def observe(self, segment: Segment) -> None:
        """Equations (3) and (4)."""
        self._model.observe(segment.start.category, segment.start.q, segment.displacement)


class SiteRampe:
    """RAMPE as the guard of a site builds and runs it.

    Args:
        config: the guard's settings.
        limits: actuator limits (n, 2) [unit].
    """

    def __init__(self, config: GuardConfig, limits: FloatArray) -> None:
        self._model = Intention(config, limits).rampe
        self._top_speed = np.array([a.max_velocity for a in config.actuators])
        self._said: tuple[Start, DisplacementForecast | None] | None = None

    @property
    def model(self) -> Rampe:
        """What was learned."""
        return self._model

    def distribution(self, start: Start) -> DisplacementForecast | None:
        """The whole predictive distribution."""
        if self._said is None or self._said[0] is not start:  # it is asked more than once
            known = self._model.predict(start.category, start.q, start.xi)
            self._said = start, known
        return self._said[1]

    def predict(self, start: Start) -> FloatArray | None:
        """Its location (n,) [unit]."""
        known = self.distribution(start)
        return None if known is None else known.mean

    def observe(self, segment: Segment) -> None:
        """Learn its displacement, and what lever and speed said of it on the way."""
        start, x = segment.start, segment.displacement
        forecast = self.distribution(start)
        self._said = None
        refusal = self._model.observe(start.category, start.q, x, start.xi)
        if refusal is None and forecast is not None:
            self._model.learn_passing(forecast, moments(segment, self._top_speed), x)
