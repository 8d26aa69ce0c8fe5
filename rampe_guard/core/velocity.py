"""Actuator velocity from positions: least-squares slope over a short window.

A difference of two samples at 19 Hz is mostly encoder noise; the slope over 0.15 s halves it
for about 0.07 s of delay. A measured velocity, where the machine sends one, is used as it is.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from rampe_guard.core.types import ActuatorSample, FloatArray

_WINDOW_S = 0.15
_MOVING_SHARE = 0.03
"""Speeds below this share of the top speed are rest: encoder noise, not motion."""


class VelocityEstimator:
    """Velocity of n actuators; zero until two samples are known."""

    def __init__(self, max_velocity: FloatArray) -> None:
        self._floor = _MOVING_SHARE * max_velocity
        self._samples: deque[tuple[float, FloatArray]] = deque()
        self._velocity: FloatArray = np.zeros(len(max_velocity))

    @property
    def velocity(self) -> FloatArray:
        """Velocity (n,) [unit/s], zero where it is within the noise of rest."""
        return np.where(np.abs(self._velocity) < self._floor, 0.0, self._velocity)

    def update(self, sample: ActuatorSample) -> None:
        """Take a sample; stamps increase."""
        self._samples.append((sample.stamp_s, sample.position))
        # two samples stay whatever their age: a slow logger must still have a velocity
        while len(self._samples) > 2 and self._samples[0][0] < sample.stamp_s - _WINDOW_S:  # noqa: PLR2004
            self._samples.popleft()
        if sample.velocity is not None:
            self._velocity = sample.velocity
        elif len(self._samples) > 1:
            t = np.array([s for s, _ in self._samples])
            q = np.array([p for _, p in self._samples])
            t = t - t.mean()
            self._velocity = t @ q / float(t @ t)

    def reset(self) -> None:
        """Forget everything (the clock or the position jumped)."""
        self._samples.clear()
        self._velocity = np.zeros_like(self._velocity)
