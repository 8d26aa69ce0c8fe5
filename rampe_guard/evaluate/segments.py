"""Logs to primitives: what the guard would have seen of each, and how far it truly went.

The same gate, detector and tracker as in the guard, fed in the same order, so that every
forecaster is asked about the very primitives that the product learns from. A primitive during
which a sample was refused or an input fell silent is not complete: the guard does not learn
it, since its length is not what the operator meant, and so nobody is asked about it here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.inputs import Accepted, InputGate, Rejection
from rampe_guard.core.joystick import CategoryChange, CategoryDetector
from rampe_guard.core.monitor import InputMonitor, Status
from rampe_guard.core.primitive import FinishedPrimitive, PrimitiveTracker
from rampe_guard.core.start_observer import StartObserver
from rampe_guard.core.types import ActuatorSample, Category, FloatArray, InputName, JoystickSample
from rampe_guard.core.velocity import VelocityEstimator
from rampe_guard.recording import Log
from rampe_guard.runtime.replay import IDLE_STEP_S

S = TypeVar("S", JoystickSample, ActuatorSample)


@dataclass(frozen=True, slots=True)
class Start:
    """What is known at the moment at which a forecast of a primitive is due.

    Attributes:
        category: Ω, a sign for each of the n actuators.
        q: position at which Ω first appeared, q[k] (n,) [unit].
        velocity: at detection (n,) [unit/s].
        command: filtered lever at detection (n,) [-].
        xi: ξ, what the site observes beside q (see `core.start_observer`).
        time_s: of detection; the debounce lies between it and the start [s].
    """

    category: Category
    q: FloatArray
    velocity: FloatArray
    command: FloatArray
    xi: FloatArray
    time_s: float


@dataclass(frozen=True, slots=True)
class Segment:
    """A primitive from beginning to end.

    Attributes:
        start: what was known when it was detected.
        start_s: when Ω first appeared [s].
        end_s: when the next category first appeared [s].
        displacement: x (n,) [unit].
        times_s: of the positions seen from its detection to that of its end (k,) [s].
        path: these positions (k, n) [unit].
        velocities: measured at them (k, n) [unit/s].
        commands: filtered lever at them (k, n) [-].
        complete: False when inputs were missing or refused meanwhile.
    """

    start: Start
    start_s: float
    end_s: float
    displacement: FloatArray
    times_s: FloatArray
    path: FloatArray
    velocities: FloatArray
    commands: FloatArray
    complete: bool

    @property
    def duration_s(self) -> float:
        """From the first appearance of Ω to that of the next category [s]."""
        return self.end_s - self.start_s


@dataclass(frozen=True, slots=True)
class Run:
    """A log, cut into primitives.

    Attributes:
        name: of the log, without its folder.
        segments: the complete primitives that ended in it, in order of time.
        incomplete: how many primitives were cut by missing or refused inputs.
        rows: usable rows of the log.
        left_out: rows that could not be read.
        refused: samples that the gate refused.
        duration_s: from the first row to the last [s].
        low: smallest accepted position of each actuator (n,) [unit].
        high: the greatest (n,) [unit].
        silences: how often an input fell silent for longer than its time-out.
    """

    name: str
    segments: tuple[Segment, ...]
    incomplete: int
    rows: int
    left_out: int
    refused: int
    duration_s: float
    low: FloatArray
    high: FloatArray
    silences: int = 0


def cut(config: GuardConfig, limits: FloatArray, log: Log) -> Run:
    """Cut a log into primitives.

    Args:
        config: the guard's settings.
        limits: actuator limits (n, 2) [unit], infinite where there are none.
        log: as `read_csv_log` returns it.
    """
    follower = _Follower(config, limits, float(log.time_s[0]))
    found: list[Segment] = []
    for joystick, actuators in log.samples():
        follower.idle_until(joystick.arrival_s)
        found += follower.take(joystick, actuators)
    complete = tuple(s for s in found if s.complete)
    return Run(
        name=Path(log.path).name,
        segments=complete,
        incomplete=len(found) - len(complete),
        rows=len(log.time_s),
        left_out=len(log.left_out),
        refused=follower.refused,
        duration_s=float(log.time_s[-1] - log.time_s[0]),
        low=follower.low,
        high=follower.high,
        silences=follower.silences,
    )


def position_range(runs: Sequence[Run]) -> FloatArray:
    """Greatest less smallest position of each actuator over all runs (n,) [unit].

    An actuator that never moved has no range; one unit serves as well, since it has no errors.
    """
    low, high = _extremes(runs)
    return np.where(high > low, high - low, 1.0)


def position_middle(runs: Sequence[Run]) -> FloatArray:
    """Middle between the two (n,) [unit]."""
    low, high = _extremes(runs)
    return (low + high) / 2


def _extremes(runs: Sequence[Run]) -> tuple[FloatArray, FloatArray]:
    low: FloatArray = np.min([run.low for run in runs], axis=0)
    high: FloatArray = np.max([run.high for run in runs], axis=0)
    return low, high


class _Follower:
    """One log through gate, detector and tracker, as `Guard` and `Intention` drive them.

    Attributes:
        refused: samples that the gate refused so far.
        silences: how often an input fell silent so far.
        low, high: extremes of the accepted positions (n,) [unit].
    """

    def __init__(self, config: GuardConfig, limits: FloatArray, start_s: float) -> None:
        self._gate = InputGate(config.actuators, limits, config.inputs, config.axes)
        self._monitor = InputMonitor(config.inputs, start_s)
        self._detector = CategoryDetector(config.actuators, config.joystick)
        self._tracker = PrimitiveTracker()
        self._top = np.array([a.max_velocity for a in config.actuators])
        self._velocity = VelocityEstimator(self._top)
        self._observer = StartObserver(len(config.actuators), config.rampe.observations)
        self._shortest_s = config.joystick.debounce_s
        self._start: Start | None = None
        self._way: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
        self._step_s: float | None = None
        self._blind = False
        self.refused = self.silences = 0
        self.low: FloatArray = np.full(len(config.actuators), np.inf)
        self.high: FloatArray = np.full(len(config.actuators), -np.inf)

    def idle_until(self, now_s: float) -> None:
        """The steps that a guard makes while nothing arrives: silence interrupts."""
        if self._step_s is not None:
            idle_s = self._step_s + IDLE_STEP_S
            while idle_s < now_s:
                self._look(idle_s)
                idle_s += IDLE_STEP_S
        self._step_s = now_s

    def take(self, joystick: JoystickSample, actuators: ActuatorSample) -> Iterator[Segment]:
        """One row: the lever first, since the command causes the motion."""
        now_s = joystick.arrival_s
        learn = self._monitor.plausible(now_s)
        lever = self._accept(self._gate.joystick(joystick), "joystick", now_s)
        if lever is not None:
            change = self._detector.update(lever.stamp_s, lever.axes)
            yield from self._changed(change, lever.stamp_s, learn=learn)
        learn = self._monitor.plausible(now_s)
        moved = self._accept(self._gate.actuators(actuators), "actuators", now_s)
        if moved is not None:
            self._velocity.update(moved)
            self._tracker.position(moved.stamp_s, moved.position)
            change = self._detector.advance(moved.stamp_s)
            speed = self._velocity.velocity / self._top
            self._observer.update(moved.stamp_s, self._detector.command, speed)
            yield from self._changed(change, moved.stamp_s, learn=learn)
            seen = moved.position, self._velocity.velocity, self._detector.command
            self._way.append((moved.stamp_s, *seen))
            self.low = np.minimum(self.low, moved.position)
            self.high = np.maximum(self.high, moved.position)
        self._look(now_s)

    def _accept(self, verdict: Accepted[S] | Rejection, name: InputName, now_s: float) -> S | None:
        if isinstance(verdict, Rejection):
            self._monitor.reject(name, verdict.reason, now_s)
            self._tracker.interrupt()
            self.refused += 1
            return None
        self._monitor.accept(name, verdict.sample.arrival_s)
        if verdict.restarted:
            self._velocity.reset()
            self._tracker.reset()
            self._detector.reset()
            self._observer.pause()
        return verdict.sample

    def _look(self, now_s: float) -> None:
        was_blind = self._blind
        self._blind = self._monitor.health(now_s).status is Status.NOT_MONITORING
        self.silences += self._blind and not was_blind
        if self._blind:
            self._tracker.interrupt()

    def _changed(
        self, change: CategoryChange | None, now_s: float, *, learn: bool
    ) -> Iterator[Segment]:
        if change is None:
            return
        finished = self._tracker.change(change)
        if finished is not None and self._start is not None:
            yield self._segment(finished, self._start, learn=learn)
        current = self._tracker.current
        self._way = []
        self._start = None
        if current is not None:
            v, u = self._velocity.velocity, self._detector.command
            xi = self._observer.start()
            self._start = Start(current.category, current.start, v, u, xi, now_s)

    def _segment(self, finished: FinishedPrimitive, start: Start, *, learn: bool) -> Segment:
        start_s, end_s = finished.primitive.start_s, finished.end_s
        long_enough = end_s - start_s >= self._shortest_s
        # position, velocity and lever of every sample on the way (k, 3, n)
        way = np.array([seen for _, *seen in self._way]).reshape(-1, 3, len(start.q))
        return Segment(
            start=start,
            start_s=start_s,
            end_s=end_s,
            displacement=finished.displacement,
            times_s=np.array([t for t, *_ in self._way]),
            path=way[:, 0],
            velocities=way[:, 1],
            commands=way[:, 2],
            complete=learn and finished.complete and long_enough,
        )
