"""A guard on a machine of one joint before a wall in closed form, so every fraction is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.core.config import ActuatorConfig, GuardConfig, RampeConfig
from rampe_guard.core.events import AlertEvent, Event, PredictionEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.types import (
    ActuatorSample,
    Certificate,
    EnabledSample,
    FloatArray,
    Inputs,
    JoystickSample,
    Placement,
    SweepResult,
    ZoneSweep,
)

DT = 0.02
ACTUATORS = (ActuatorConfig("swing", 0, 1, 1.0, 2.0, 0.1, 0.1, "rad"),)
CONFIG = GuardConfig(ACTUATORS, axes=1, rampe=RampeConfig(n_init=3))
LIMITS = np.array([[-2.0, 2.0]])


@dataclass
class Wall:
    """Everything beyond ``at`` is solid; the margin is 0.1."""

    at: float = 1.1
    answer: Certificate | None = None
    name: str = "wall"
    moving: bool = False  # objects that move may be there, far away

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        """Closed form."""
        assert not any_path
        assert self.moving or not placed
        del clearance  # always sharp
        if only is not None and self.name not in only:
            return SweepResult(())
        edge = self.at - 0.1
        now, way = edge - float(start[0]), float(displacement[0])
        left = now - wider_m
        fraction = 0.0 if left <= 0 else left / way if way >= left > 0 else None
        kind = Certificate.FREE if fraction is None else Certificate.CONTACT
        near = max(now - max(way, 0.0), 0.0)
        zone = ZoneSweep(self.name, kind, fraction, "arm", None, near, now, way > 0, 0.1)
        if self.answer is not None:
            zone = replace(zone, certificate=self.answer, contact_fraction=None, clearance_m=None)
        return SweepResult((zone,))


class CoreRig:
    """Drives a guard with a machine that follows its lever exactly."""

    def __init__(self, wall: Wall | None = None, config: GuardConfig = CONFIG) -> None:
        self.guard = Guard(config, LIMITS, wall or Wall(), start_s=0.0)
        self.q, self.now = 0.0, 0.0
        self.says: bool | None = None  # what the enable key says at every tick
        self.events: list[Event] = []
        self.trace: list[tuple[float, float]] = []

    def tick(self, lever: float | None, *, arm: bool = True, speed: float | None = None) -> None:
        self.now += DT
        self.q += (speed if speed is not None else (lever or 0.0)) * DT
        sticks: tuple[JoystickSample, ...] = ()
        if lever is not None:
            sticks = (JoystickSample(self.now, np.array([lever]), self.now),)
        arms: tuple[ActuatorSample, ...] = ()
        if arm:
            arms = (ActuatorSample(self.now, np.array([self.q]), None, self.now),)
        words: tuple[EnabledSample, ...] = ()
        if self.says is not None:
            words = (EnabledSample(self.says, self.now, self.now),)
        self.events += self.guard.step(Inputs(sticks, arms, enabled=words), self.now)
        self.trace.append((self.now, self.q))

    def hold(self, lever: float | None, seconds: float, *, arm: bool = True) -> None:
        for _ in range(round(seconds / DT)):
            self.tick(lever, arm=arm)

    def alerts(self, zone: str = "wall", kind: str = "transition") -> list[AlertEvent]:
        return [
            e
            for e in self.events
            if isinstance(e, AlertEvent) and e.zone == zone and e.kind == kind
        ]

    def predictions(self, event: str) -> list[PredictionEvent]:
        return [e for e in self.events if isinstance(e, PredictionEvent) and e.event == event]

    def strokes(self, count: int, length: float = 0.8) -> None:
        """Swing out and back ``count`` times."""
        for _ in range(count):
            self.hold(0.5, length / 0.5)
            self.hold(0.0, 0.3)
            self.hold(-0.5, length / 0.5)
            self.hold(0.0, 0.3)
            self.q = 0.0
