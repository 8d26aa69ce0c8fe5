"""The `next` forecast: what follows, from memory, seconds ahead and several primitives long.

::

    situation ─► memory: the most alike of the past ─► distinct scenarios from here
              ─► certified sweep of every piece, zone by zone ─► when, and how surely, each is met

It looks again every tenth of a second. Meanwhile what it found stands, and comes nearer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from rampe_guard.core.config import GuardConfig
from rampe_guard.core.scenario import Scenario, scenarios
from rampe_guard.core.situation import Likeness
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import Certificate, FloatArray, PathSweeper, Placement, ZoneSweep

LOOK_S: Final = 0.1
"""Time between two looks ahead [s]."""
_SAME: Final = 1e-3
"""A situation that changed by less is the same."""
_CREEP: Final = 0.05
"""Slower than this share of the top speed is rest."""
_REST: Final = 1e-3
"""A piece shorter than this share of the travel is no motion."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """A zone that a scenario meets.

    Attributes:
        time_s: from the look on [s].
        weight: of the scenario.
        count: its analogues.
        share: of the scenario's time at which that is, 0 to 1.
        sweep: of the piece that met it.
        end: where the scenario leads: displacement from where it was looked (n,) [unit].
    """

    time_s: float
    weight: float
    count: int
    share: float
    sweep: ZoneSweep
    end: FloatArray


@dataclass(frozen=True, slots=True)
class Outlook:
    """What memory says of the coming seconds.

    Attributes:
        weight: how much is behind it: the sum of all analogues' weights, 0 where it is new here.
        count: analogues.
        scenarios: distinct ways on, the weightiest first.
        meetings: by zone.
        looked_s: when, on the clock of the inputs' stamps [s].
        position: from where (n,) [unit]; None if it was not looked.
    """

    weight: float = 0.0
    count: int = 0
    scenarios: tuple[Scenario, ...] = ()
    meetings: Mapping[str, tuple[Meeting, ...]] = field(default_factory=dict)
    looked_s: float = 0.0
    position: FloatArray | None = None

    def met_within(self, zone: str, limits_s: Sequence[float], stamp_s: float) -> list[float]:
        """Weights of the scenarios that meet a zone within each limit of a stamp [s]."""
        found = self.meetings.get(zone)
        if not found:
            return [0.0] * len(limits_s)
        past_s = stamp_s - self.looked_s
        return [sum(m.weight for m in found if m.time_s - past_s <= s) for s in limits_s]

    def first(self, zone: str) -> Meeting | None:
        """The weightiest scenario's meeting with a zone, None if there is none."""
        return max(self.meetings.get(zone, ()), key=lambda m: m.weight, default=None)


NOTHING: Final = Outlook()
"""Memory says nothing."""


class Foresight:
    """Remembers situations, and looks ahead from the present one.

    Args:
        config: settings.
        limits: actuator limits (n, 2) [unit]; no scenario leads past them.
    """

    def __init__(self, config: GuardConfig, limits: FloatArray) -> None:
        n = len(config.actuators)
        self._config = config.next
        self._top = np.array([a.max_velocity for a in config.actuators])
        self._deadband = np.array([a.deadband for a in config.actuators])
        self._likeness = Likeness(self._top)
        self._limits = limits
        self.memory = SituationMemory(
            self._likeness, n, config.next.horizon_s, config.next.situations
        )
        self._outlook = NOTHING
        self._situation: FloatArray | None = None
        self._busy_s: float | None = None
        self._looked: FloatArray | None = None

    @property
    def outlook(self) -> Outlook:
        """As it was last looked."""
        return self._outlook

    def interrupt(self) -> None:
        """Something was missing."""
        self.memory.interrupt()
        self._outlook, self._situation, self._looked = NOTHING, None, None
        self._busy_s = None

    def look_anew(self) -> None:
        """What was looked at is no longer there: look again, whenever the last look was."""
        self._outlook, self._looked = NOTHING, None

    def see(
        self,
        stamp_s: float,
        position: FloatArray,
        velocity: FloatArray,
        command: FloatArray,
        *,
        learn: bool,
    ) -> None:
        """Take the present situation, n values each; ``learn`` is False while in doubt."""
        busy = (np.abs(command) > self._deadband) | (np.abs(velocity) > _CREEP * self._top)
        if self._busy_s is None or busy.any():
            self._busy_s = stamp_s
        rest_s = max(stamp_s - self._busy_s, 0.0)
        self._situation = self._likeness.point(position, velocity, command, rest_s)
        if learn:
            self.memory.see(stamp_s, position, self._situation)
        else:
            self.memory.interrupt()

    def look(
        self,
        stamp_s: float,
        position: FloatArray,
        sweeper: PathSweeper,
        placed: Mapping[str, Placement | None],
    ) -> Outlook:
        """The outlook from ``position`` (n,), anew if the last one is old enough."""
        if self._situation is None or not self._config.enabled:
            return NOTHING
        now, last = self._situation, self._looked
        if last is not None:
            if 0.0 <= stamp_s - self._outlook.looked_s < LOOK_S - 1e-6:
                return self._outlook
            if not placed and float(np.abs(now - last).max()) < _SAME:
                # it stands where it stood: the same would be found again
                self._outlook = replace(self._outlook, looked_s=stamp_s)
                return self._outlook
        self._looked = now
        analogues = self.memory.similar(now, self._config.analogues)
        low = np.minimum(self._limits[:, 0], position)
        high = np.maximum(self._limits[:, 1], position)
        ways = scenarios(analogues, (low - position, high - position), self._likeness.travel)
        meetings: dict[str, list[Meeting]] = {}
        for way in ways:
            for zone, meeting in self._met(way, position, sweeper, placed).items():
                meetings.setdefault(zone, []).append(meeting)
        self._outlook = Outlook(
            weight=sum(a.weight for a in analogues),
            count=len(analogues),
            scenarios=tuple(ways),
            meetings={zone: tuple(found) for zone, found in meetings.items()},
            looked_s=stamp_s,
            position=position,
        )
        return self._outlook

    def _met(
        self,
        way: Scenario,
        position: FloatArray,
        sweeper: PathSweeper,
        placed: Mapping[str, Placement | None],
    ) -> dict[str, Meeting]:
        """The zones that a scenario meets; what could not be computed counts as met."""
        met: dict[str, Meeting] = {}
        tiny = _REST * self._likeness.travel
        corners, times = way.corners, way.time_s.tolist()
        for k in range(len(corners) - 1):
            piece = corners[k + 1] - corners[k]
            if (np.abs(piece) <= tiny).all():
                continue
            # a rounding error past a limit would be past all that is proven
            start = np.clip(position + corners[k], *self._limits.T) if k else position
            result = sweeper.sweep(start, piece, clearance=False, placed=placed)
            for found in result.zones:
                if found.certificate is Certificate.FREE or found.zone in met:
                    continue
                if found.inside and not found.closing:
                    continue  # it moves out of it
                share = found.contact_fraction or 0.0
                time_s = times[k] + share * (times[k + 1] - times[k])
                met[found.zone] = Meeting(
                    time_s, way.weight, way.count, time_s / times[-1], found, way.end
                )
        return met
