"""The gate: which samples may move the guard, and why the others may not.

A refused sample changes nothing but a counter; the input then grows old, and an old input is
"not monitoring", never "clear". A sender that truly restarted (its stamps or the position
jumped, and go on from there) is refused for as long as its time-out, so that the break is
seen, and then taken up anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from rampe_guard.core.config import ActuatorConfig, InputConfig
from rampe_guard.core.sender_clock import LOSS, SenderClock
from rampe_guard.core.types import ActuatorSample, FloatArray, InputName, JoystickSample


class Stamped(Protocol):
    """A sample with the time of its measurement and that of its arrival [s].

    ``stamped``: the sender says when; else its arrival stands for it.
    """

    @property
    def stamp_s(self) -> float:
        """On the sender's clock."""
        ...

    @property
    def arrival_s(self) -> float:
        """On ours."""
        ...

    @property
    def stamped(self) -> bool:
        """The sender says when it was measured."""
        ...


S = TypeVar("S", bound=Stamped)

AXIS_SLACK = 0.05
"""Joysticks overshoot a little at their ends; more is another unit or another column."""
_MIN_STEP_S = 0.05
"""Two samples closer than this still may differ by the encoder's last digits and jitter."""
_BURST_S = 0.2
_CLOCK_SET = 3
"""So many samples in a row that go back together have another clock; fewer are out of order."""
_LONG_SLACK = 1.5
"""Over a longer gap than a burst no actuator keeps up several times its top speed."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """A sample that was refused: which input, a word for the counter, values for the log."""

    input: InputName
    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with a sample: a word for the counter, values for the log."""

    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class Accepted(Generic[S]):
    """A sample fit for use.

    Attributes:
        sample: itself.
        restarted: it does not continue the one before it.
        late_s: how long it was under way, at least, as the sender's promptest sample shows [s].
    """

    sample: S
    restarted: bool = False
    late_s: float = 0.0


class Continuity(Generic[S]):
    """Does a sample continue the last good one, or has the sender started anew? How late is it?

    A network that stood still hands on at once what it kept. The first of that continues what
    was before, but is old; the last of it is far ahead of the first, but no further than the
    sender's clock has gone meanwhile.

    Args:
        patience_s: how long a sender that started anew is refused [s].
        max_stamp_jump_s: largest step of a stamp beyond the time that really passed [s].
        speed_slack: how many times its top speed an actuator may seem to have.
        clock_loss: how much the sender's clock may lose on ours [s/s].
    """

    def __init__(
        self,
        patience_s: float,
        max_stamp_jump_s: float,
        speed_slack: float = 1.0,
        clock_loss: float = LOSS,
    ) -> None:
        self._patience_s = patience_s
        self._max_stamp_jump_s = max_stamp_jump_s
        self._speed_slack = speed_slack
        self._clock_loss = clock_loss
        self._good: S | None = None
        self._suspect: S | None = None
        self._suspect_since_s = 0.0
        self._suspects = 0
        self._clock, self._suspect_clock = SenderClock(), SenderClock()

    def check(self, sample: S, speed: FloatArray | None = None) -> Accepted[S] | Fault:
        """Whether it does; ``speed`` are top speeds (n,) by which positions are judged too."""
        if self._good is None:
            return self._accept(sample, self._clock)
        broken = self._break(self._good, sample, speed, self._clock)
        if broken is None:
            return self._accept(sample, self._clock_now(sample, speed))
        if self._suspect is None or self._break(self._suspect, sample, speed, self._suspect_clock):
            self._suspect_since_s, self._suspects = sample.arrival_s, 0
            self._suspect_clock = SenderClock()
        self._suspect, self._suspects = sample, self._suspects + 1
        self._suspect_clock = self._followed(self._suspect_clock, sample)
        if sample.arrival_s - self._suspect_since_s >= self._patience_s:
            return replace(self._accept(sample, self._suspect_clock), restarted=True)
        return broken

    def _clock_now(self, sample: S, speed: FloatArray | None) -> SenderClock:
        """A sender whose clock was set back a little was waited for, and goes by its new clock."""
        if self._suspect is None or self._suspects < _CLOCK_SET:
            return self._clock
        other = self._break(self._suspect, sample, speed, self._suspect_clock)
        return self._suspect_clock if other is None else self._clock

    def _accept(self, sample: S, clock: SenderClock) -> Accepted[S]:
        self._good, self._suspect, self._suspects = sample, None, 0
        self._clock = self._followed(clock, sample)
        if not sample.stamped:
            return Accepted(sample)
        measured_s = self._clock.measured_s(sample.stamp_s, sample.arrival_s)
        return Accepted(sample, late_s=sample.arrival_s - measured_s)

    def _break(self, old: S, new: S, speed: FloatArray | None, clock: SenderClock) -> Fault | None:
        step = new.stamp_s - old.stamp_s
        if step <= 0.0:
            return Fault("stamp_back", f"stamp {new.stamp_s:.6g} after {old.stamp_s:.6g}")
        passed = new.arrival_s - old.arrival_s
        if old.stamped and clock.ahead_s is not None:  # the old one may have been late
            passed = max(passed, new.arrival_s + clock.ahead_s - old.stamp_s)
        if step - passed > self._max_stamp_jump_s:
            return Fault("stamp_jump", f"stamp went {step:.3g} s ahead while {passed:.3g} s passed")
        if speed is None or not (
            isinstance(old, ActuatorSample) and isinstance(new, ActuatorSample)
        ):
            return None
        moved = np.abs(new.position - old.position)
        burst = min(max(step, _MIN_STEP_S), _BURST_S)
        rest = max(step - _BURST_S, 0.0)
        reach = speed * (self._speed_slack * burst + _LONG_SLACK * rest)
        if (moved > reach).any():
            j = int(np.argmax(moved - reach))
            return Fault("position_jump", f"actuator {j} moved {moved[j]:.4g} in {step:.3g} s")
        return None

    def _followed(self, clock: SenderClock, sample: S) -> SenderClock:
        return clock.followed(
            sample.stamp_s, sample.arrival_s, stamped=sample.stamped, loss=self._clock_loss
        )


class InputGate:
    """Accepts or refuses decoded samples.

    Args:
        actuators: in site order.
        limits: (n, 2) [unit], infinite where there are none.
        config: limits of plausibility.
        axes: number of joystick axes that a message must have at least.
    """

    def __init__(
        self,
        actuators: tuple[ActuatorConfig, ...],
        limits: FloatArray,
        config: InputConfig,
        axes: int,
    ) -> None:
        self._names = [a.name for a in actuators]
        self._speed = np.array([a.max_velocity for a in actuators])
        self._axes = axes
        bounded = np.isfinite(limits).all(axis=1)
        width = np.where(bounded, np.where(bounded, limits[:, 1] - limits[:, 0], 0.0), 0.0)
        self._low = limits[:, 0] - config.position_slack * width
        self._high = limits[:, 1] + config.position_slack * width
        jump_s = config.max_stamp_jump_s
        self._joystick = Continuity[JoystickSample](
            config.joystick_timeout_s, jump_s, clock_loss=config.max_clock_loss
        )
        self._actuators = Continuity[ActuatorSample](
            config.actuators_timeout_s, jump_s, config.speed_slack, config.max_clock_loss
        )

    def joystick(self, sample: JoystickSample) -> Accepted[JoystickSample] | Rejection:
        """Check one joystick sample; axes a hair outside [-1, 1] are clipped."""
        axes = sample.axes
        if axes.ndim != 1 or len(axes) < self._axes:
            return Rejection("joystick", "wrong_length", f"{axes.size} axes, need {self._axes}")
        if not (np.isfinite(axes).all() and np.isfinite(sample.stamp_s)):
            return Rejection("joystick", "not_finite", f"axes {axes.tolist()}")
        size = np.abs(axes)
        if (size > 1.0 + AXIS_SLACK).any():
            j = int(np.argmax(size))
            return Rejection("joystick", "axis_out_of_range", f"axis {j} is {axes[j]:.4g}")
        clipped = replace(sample, axes=np.clip(axes, -1.0, 1.0))
        return _named("joystick", self._joystick.check(clipped))

    def actuators(self, sample: ActuatorSample) -> Accepted[ActuatorSample] | Rejection:
        """Check one actuator sample."""
        q, n = sample.position, len(self._names)
        speeds = sample.velocity
        if q.shape != (n,) or (speeds is not None and speeds.shape != (n,)):
            return Rejection("actuators", "wrong_length", f"{q.size} positions, need {n}")
        finite = np.isfinite(q).all() and (speeds is None or np.isfinite(speeds).all())
        if not (finite and np.isfinite(sample.stamp_s)):
            return Rejection("actuators", "not_finite", f"position {q.tolist()}")
        outside = np.maximum(self._low - q, q - self._high)
        if (outside > 0.0).any():
            j = int(np.argmax(outside))
            return Rejection(
                "actuators",
                "position_out_of_range",
                f"{self._names[j]} is {q[j]:.4g}, limits {self._low[j]:.4g} to {self._high[j]:.4g}",
            )
        return _named("actuators", self._actuators.check(sample, self._speed))


def _named(name: InputName, verdict: Accepted[S] | Fault) -> Accepted[S] | Rejection:
    if isinstance(verdict, Fault):
        return Rejection(name, verdict.reason, verdict.detail)
    return verdict
