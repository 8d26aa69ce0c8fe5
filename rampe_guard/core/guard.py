"""`Guard.step`: samples in, events out. The only composer of the core, and deterministic.

Each step takes every sample that arrived, in stamp order, and lets it update the operator's
intention and the arm's motion. Then, if a new position came, the newest state is swept once
for each forecast, judged zone by zone, and alarmed. Objects that move are swept where they
are now, and at least ten times a second, since they come nearer to an arm that stands too. Any
other step only lets time pass: silence is noticed, active alerts are repeated. While the machine
is switched off, nothing is swept and alerts of zones are suppressed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rampe_guard.core.advice import Instant
from rampe_guard.core.advising import Advising
from rampe_guard.core.alarm import Level
from rampe_guard.core.annunciator import Annunciator, Moment
from rampe_guard.core.assessment import Assessor, State, Surroundings
from rampe_guard.core.config import GuardConfig
from rampe_guard.core.enabled import EnableKey
from rampe_guard.core.events import (
    SYSTEM_ZONE,
    AlertEvent,
    Event,
    Evidence,
    PredictionEvent,
    PredictionSummary,
    RefusalEvent,
    SweepSummary,
)
from rampe_guard.core.inputs import Accepted, Fault, InputGate, Rejection
from rampe_guard.core.intention import Intention
from rampe_guard.core.monitor import Health, InputMonitor, Status, stamp_of
from rampe_guard.core.moving import MovingObjects
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.risk import ZoneRisk
from rampe_guard.core.scene import SolidObject
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import (
    ActuatorSample,
    EnabledSample,
    FloatArray,
    InputName,
    Inputs,
    JoystickSample,
    PathSweeper,
)
from rampe_guard.core.velocity import VelocityEstimator

_LOOK_S = 0.1
"""Longest time between two sweeps while the scene has objects that move [s]."""
_FRESH_S = 0.02
"""Shortest time from a sweep to one that only a new pose of an object asks for [s]: however many
objects tell of themselves, and however often, they cost at most so many sweeps."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The present state of a guard, for heartbeat and late joiners."""

    health: Health
    position: FloatArray | None
    velocity: FloatArray
    command: FloatArray
    alerts: tuple[AlertEvent, ...]
    prediction: PredictionSummary | None
    sweeps: tuple[SweepSummary, ...]
    risks: tuple[ZoneRisk, ...] = ()


class Guard:
    """Early warning for one machine.

    Args:
        config: settings.
        limits: actuator limits (n, 2) [unit], infinite where there are none.
        sweeper: geometry.
        start_s: time at which monitoring begins, on the clock of ``now_s``.
        boot_id: makes alert ids unique across restarts.
        moving: the objects of the scene whose poses come from a key.
    """

    def __init__(
        self,
        config: GuardConfig,
        limits: FloatArray,
        sweeper: PathSweeper,
        start_s: float,
        boot_id: str = "offline",
        moving: Sequence[SolidObject] = (),
    ) -> None:
        self._gate = InputGate(config.actuators, limits, config.inputs, config.axes)
        self._monitor = InputMonitor(config.inputs, start_s)
        self._enable = EnableKey(config.actuators, config.inputs, start_s)
        self._off = False
        self._moving = MovingObjects(moving, config.inputs)
        self._intention = Intention(config, limits)
        self._velocity = VelocityEstimator(np.array([a.max_velocity for a in config.actuators]))
        self._assessor = Assessor(config, limits, sweeper)
        self._advising = Advising(config, limits, sweeper)
        self._annunciator = Annunciator(config.alerts, boot_id)
        self._newest: ActuatorSample | None = None
        self._machine_s = 0.0
        self._sweeps: tuple[SweepSummary, ...] = ()
        self._risks: tuple[ZoneRisk, ...] = ()
        self._swept_s = start_s
        self._poses_came = False
        self._restarted: str | None = None
        self._other_scene = False
        self._blank = _copied(self._intention.rampe.snapshot()), self.situations.snapshot()

    @property
    def rampe(self) -> Rampe:
        """The learned models."""
        return self._intention.rampe

    @property
    def situations(self) -> SituationMemory:
        """What is remembered of how situations went on."""
        return self._assessor.foresight.memory

    @property
    def lessons(self) -> dict[str, int]:
        """Finished primitives: "learned", and the others by the reason why not."""
        return dict(self._intention.lessons)

    def step(self, inputs: Inputs, now_s: float) -> tuple[Event, ...]:
        """Take all that arrived since the last step; returns what is to be published."""
        self._monitor.joystick_alive(inputs.joystick_alive)
        if inputs.canary is not None:
            self._monitor.distrust(inputs.canary)
        self._restarted = inputs.restarted or self._restarted
        for name, reason in inputs.rejected:
            self._refuse(name, reason, now_s)
        events: list[Event] = []
        before = self._newest
        for sample in _in_stamp_order(inputs):
            events += self._taught(self._take(sample, now_s))
        fresh, refused = self._moving.take(inputs, now_s)
        events += refused
        self._poses_came |= fresh
        events += self._switch(inputs.enabled, now_s)
        health = self._health(now_s)
        moment = self._moment(health, now_s)
        events += self._annunciator.lapse(moment)
        events += self._annunciator.system(_system_evidence(health, self._restarted), moment)
        if health.off:
            self._interrupt()
            events += self._annunciator.switch_off(moment)
            events += self._advising.blind(health, moment.stamp_s, now_s)
        elif health.status is Status.NOT_MONITORING:
            self._interrupt()
            events += self._annunciator.freeze(moment)
            events += self._advising.blind(health, moment.stamp_s, now_s)
        elif self._newest is not None and (self._newest is not before or self._must_look(now_s)):
            events += self._evaluate(self._newest, now_s)
        else:
            events += self._annunciator.repeats(moment)
        return tuple(events)

    def change_scene(
        self, sweeper: PathSweeper, zones: Collection[str], moving: Sequence[SolidObject] = ()
    ) -> None:
        """Guard against another scene from the next step on, which evaluates it.

        Args:
            sweeper: geometry: the same arm among other objects.
            zones: names of all its zones.
            moving: the objects whose poses come from a key.
        """
        self._assessor.change_scene(sweeper)
        self._advising.change_scene(sweeper)
        self._annunciator.change_zones(zones)
        self._moving.change(moving)
        self._sweeps, self._risks, self._other_scene = (), (), True

    def forget(self) -> None:
        """Forget all that was learned of the operator, from earlier runs too."""
        models, situations = self._blank
        self._interrupt()
        self._intention.rampe.restore(models)
        self.situations.restore(situations)

    def acknowledge(self, alert_id: str, who: str, now_s: float) -> tuple[AlertEvent, ...]:
        """Someone has seen an alert; empty if no alert of that id waits for it."""
        moment = self._moment(self._health(now_s), now_s)
        events = self._annunciator.acknowledge(alert_id, who, moment)
        if any(event.zone == SYSTEM_ZONE for event in events):
            self._restarted = None
        return tuple(events)

    def shelve(
        self, alert_id: str, who: str, duration_s: float, now_s: float
    ) -> tuple[AlertEvent, ...]:
        """Someone wants an alert to be silent for ``duration_s`` [s]; 0 ends its silence.

        Raises:
            RefusedError: there is no such alert, or it may not be silent (for so long).
        """
        moment = self._moment(self._health(now_s), now_s)
        return tuple(self._annunciator.shelve(alert_id, who, duration_s, moment))

    def snapshot(self, now_s: float) -> Snapshot:
        """The present state."""
        moment = self._moment(health := self._health(now_s), now_s)
        return Snapshot(
            health=health,
            position=None if self._newest is None else self._newest.position,
            velocity=self._velocity.velocity,
            command=self._intention.command,
            alerts=tuple(self._annunciator.active(moment)),
            prediction=moment.prediction,
            sweeps=self._sweeps,
            risks=self._risks,
        )

    def _take(self, sample: JoystickSample | ActuatorSample, now_s: float) -> list[Event]:
        learn = self._monitor.plausible(now_s)
        if isinstance(sample, JoystickSample):
            lever = self._gate.joystick(sample)
            if isinstance(lever, Rejection):
                self._refuse(lever.input, lever.reason, now_s)
                return [RefusalEvent(lever.input, lever.reason, lever.detail)]
            self._monitor.accept("joystick", sample.arrival_s, stamp_of(sample), lever.late_s)
            self._restart(lever)
            return [*self._intention.joystick(lever.sample, now_s, learn=learn)]
        moved = self._gate.actuators(sample)
        if isinstance(moved, Rejection):
            self._refuse(moved.input, moved.reason, now_s)
            return [RefusalEvent(moved.input, moved.reason, moved.detail)]
        self._monitor.accept("actuators", sample.arrival_s, stamp_of(sample), moved.late_s)
        self._moving.follow(sample, restarted=moved.restarted)
        self._enable.moved(sample, restarted=moved.restarted)
        self._restart(moved)
        if self._newest is not None and not moved.restarted:
            self._machine_s += moved.sample.stamp_s - self._newest.stamp_s
        self._newest = moved.sample
        self._velocity.update(moved.sample)
        v = self._velocity.velocity
        events = self._intention.actuators(moved.sample, v, now_s, learn=learn)
        self._assessor.foresight.see(
            moved.sample.stamp_s, moved.sample.position, v, self._intention.command, learn=learn
        )
        return [*events]

    def _switch(self, words: tuple[EnabledSample, ...], now_s: float) -> list[RefusalEvent]:
        """Take what the enable key says, and see whether the machine is off now."""
        refused = []
        for word in words:
            verdict = self._enable.take(word)
            if isinstance(verdict, Fault):
                self._monitor.reject("enabled", verdict.reason, now_s)
                refused.append(RefusalEvent("enabled", verdict.reason, verdict.detail))
            else:
                self._monitor.accept("enabled", word.arrival_s)
        if self._monitor.lever_known(now_s):
            self._enable.pushed(self._intention.command, now_s)
        was_off, self._off = self._off, self._enable.off(now_s)
        if was_off and not self._off:
            self._monitor.switched_on(now_s)
            self._annunciator.switch_on()
        return refused

    def _taught(self, events: list[Event]) -> list[Event]:
        for event in events:
            if isinstance(event, PredictionEvent) and event.event == "ended":
                self._monitor.lesson(event.refusal)
        return [self._foretold(event) for event in events]

    def _foretold(self, event: Event) -> Event:
        """A prediction with the ways on that memory knows."""
        if isinstance(event, PredictionEvent):
            return replace(event, outlook=self._assessor.foresight.outlook)
        return event

    def _refuse(self, name: InputName, reason: str, now_s: float) -> None:
        self._monitor.reject(name, reason, now_s)
        if name == "enabled":
            self._enable.refused()
        else:
            self._interrupt()

    def _interrupt(self) -> None:
        self._intention.interrupt()
        self._assessor.interrupt()

    def _restart(self, accepted: Accepted[JoystickSample] | Accepted[ActuatorSample]) -> None:
        if accepted.restarted:
            self._velocity.reset()
            self._intention.reset()
            self._assessor.interrupt()

    def _evaluate(self, newest: ActuatorSample, now_s: float) -> list[Event]:
        around = Surroundings(
            placed=self._moving.placements(now_s),
            restless=lambda zone: self._moving.restless(zone, now_s),
            shown=self._annunciator.shown,
        )
        self._swept_s, self._poses_came, self._other_scene = now_s, False, False
        state = State(newest.position, self._velocity.velocity, newest.stamp_s)
        found = self._assessor.assess(state, self._intention, around)
        if found.unknown:
            self._monitor.sweep_unknown(now_s)
        self._sweeps, self._risks = found.sweeps, found.risks
        health = self._health(now_s)
        alerts = self._annunciator.update(found.evidence, self._moment(health, now_s))
        velocity, command = self._velocity.velocity, self._intention.command
        now = Instant(newest.position, velocity, command, around.placed, around.restless, now_s)
        advice = self._advising.sighted(now, newest.stamp_s, health)
        news = self._intention.update(newest.position, self._sweeps, now_s)
        return [*alerts, *advice, *(self._foretold(event) for event in news)]

    def _must_look(self, now_s: float) -> bool:
        if self._other_scene:
            return True
        # a hair less than the period, so that it survives the rounding of ticks
        since_s = now_s - self._swept_s + 1e-6
        return bool(self._moving) and since_s >= (_FRESH_S if self._poses_came else _LOOK_S)

    def _health(self, now_s: float) -> Health:
        more = [*self._enable.weaknesses(now_s), *self._moving.weaknesses(now_s)]
        health = self._monitor.health(now_s, more, off=self._off)
        return replace(health, objects=self._moving.health(now_s)) if self._moving else health

    def _moment(self, health: Health, now_s: float) -> Moment:
        newest = self._newest
        return Moment(
            now_s=now_s,
            machine_s=self._machine_s,
            stamp_s=None if newest is None else newest.stamp_s,
            input_age_s=health.ages_s["actuators"],
            prediction=None if newest is None else self._intention.summary(newest.position),
            degraded=health.status is Status.DEGRADED,
        )


def _copied(arrays: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    return {name: array.copy() for name, array in arrays.items()}


def _in_stamp_order(inputs: Inputs) -> list[JoystickSample | ActuatorSample]:
    """All samples by stamp; the joystick first at a tie, since the command causes the motion."""
    tagged: list[JoystickSample | ActuatorSample] = [*inputs.joystick, *inputs.actuators]

    def key(sample: JoystickSample | ActuatorSample) -> float:
        return sample.stamp_s if np.isfinite(sample.stamp_s) else -np.inf

    return sorted(tagged, key=key)  # stable: the joystick stays first


def _system_evidence(health: Health, restarted: str | None) -> Evidence:
    """What there is to say of the guard itself; a restart stays until it is acknowledged."""
    notes = [f"guard restarted after {restarted}"] if restarted else []
    level = Level.CAUTION if notes else Level.CLEAR
    if health.status is Status.NOT_MONITORING and not (health.starting or health.off):
        level, notes = Level.WARNING, [*(r.text for r in health.reasons), *notes]
    return Evidence(level, "system", None, None, None, "; ".join(notes))
