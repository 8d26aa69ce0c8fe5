"""Joystick to category: flow-chart blocks 1 (has the category changed?) and 2 (filter).

Three steps, each curing one kind of false motion:

1. a first-order low-pass takes out jitter of the axes;
2. a deadband with hysteresis turns each actuator's command into a sign: it switches on
   above the deadband and off below ``release_ratio`` of it, so noise at the edge is no motion;
3. a debounce: a new sign tuple counts only after it has held for ``debounce_s``. Levers that
   are let go a moment apart then make one change and not two. The change is dated back to
   when the tuple first appeared, so debouncing costs no displacement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.config import ActuatorConfig, JoystickConfig
from rampe_guard.core.types import Category, FloatArray


@dataclass(frozen=True, slots=True)
class CategoryChange:
    """The operator changed to ``category``; it first appeared at ``since_s``."""

    category: Category
    since_s: float


class CategoryDetector:
    """Filter, deadband and debounce of one joystick.

    Attributes:
        category: Ω in force, debounced.
        command: filtered command per actuator (n,), + = lengthens / turns positive [-].
    """

    def __init__(self, actuators: tuple[ActuatorConfig, ...], config: JoystickConfig) -> None:
        self._config = config
        self._axis = np.array([a.axis for a in actuators])
        self._sign = np.array([float(a.sign) for a in actuators])
        self._on = np.array([a.deadband for a in actuators])
        self._off = self._on * config.release_ratio
        self.reset()

    def reset(self) -> None:
        """Forget the lever: no command, static category."""
        n = len(self._axis)
        self.command: FloatArray = np.zeros(n)
        self.category: Category = (0,) * n
        self._raw: FloatArray | None = None
        self._signs = np.zeros(n)
        self._candidate = self.category
        self._since_s = math.nan
        self._stamp_s = math.nan

    def update(self, stamp_s: float, axes: FloatArray) -> CategoryChange | None:
        """Take a joystick sample: ``axes`` (m,) at ``stamp_s``."""
        self._raw = axes[self._axis] * self._sign
        return self.advance(stamp_s)

    def advance(self, stamp_s: float) -> CategoryChange | None:
        """Let time pass with the lever held where it is (on-change joysticks need this)."""
        if self._raw is None:
            return None
        self._filter(stamp_s)
        size = np.abs(self.command)
        held = (self._signs * self.command > 0) & (size > self._off)
        self._signs = np.where((size > self._on) | held, np.sign(self.command), 0.0)
        category = tuple(int(s) for s in self._signs)
        if category == self.category:
            self._candidate = category
            return None
        if category != self._candidate:
            self._candidate, self._since_s = category, stamp_s
        if stamp_s - self._since_s < self._config.debounce_s:
            return None
        self.category = category
        return CategoryChange(category, self._since_s)

    def _filter(self, stamp_s: float) -> None:
        raw = self._raw
        if raw is None:
            return
        dt = stamp_s - self._stamp_s
        tau = self._config.filter_s
        first = math.isnan(dt)
        gain = 1.0 if first or tau <= 0.0 else 1.0 - math.exp(-max(dt, 0.0) / tau)
        self.command = self.command + gain * (raw - self.command)
        self._stamp_s = stamp_s if first else max(stamp_s, self._stamp_s)
