"""Which zones the arm can get into at all: proven never, seen now and then, or always.

Never is proven by the sweep itself: no monotone way through the whole range of the actuators
touches. The rest is told by postures at random, evenly over that range.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from rampe_guard.assembly import Machine
from rampe_guard.collision import FclSweeper
from rampe_guard.core.drive import DirectDrive
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.core.types import AnyPath, Certificate, FloatArray

POSTURES = 200
_PROVEN_MOST = 200
"""So many zones are asked about one by one; each may take the whole budget of a sweep."""
_MOSTLY = 0.95
_SEED = 1


@dataclass(slots=True)
class Reach:
    """What is known of one zone.

    Attributes:
        name: of it.
        unreachable: it is proven that no posture gets there.
        inside: postures in which the arm is within its margin, of `POSTURES`.
        unknown: postures for which that could not be computed.
        links: which link was nearest then, and how often.
        frozen: it moves, so nothing is known of it without its poses.
    """

    name: str
    unreachable: bool = False
    inside: int = 0
    unknown: int = 0
    links: Counter[str] = field(default_factory=Counter)
    frozen: bool = False

    @property
    def always(self) -> bool:
        """Nearly every posture is inside."""
        return self.inside >= _MOSTLY * POSTURES

    @property
    def words(self) -> str:
        """For a table."""
        if self.frozen:
            return "-"
        if self.unreachable:
            return "never (proven)"
        told = f"in {self.inside} of {POSTURES}" if self.inside else f"in none of {POSTURES}"
        return f"{told}, {self.unknown} unknown" if self.unknown else told


def span(machine: Machine) -> tuple[FloatArray, FloatArray]:
    """The range of all actuators (n,), (n,); of an endless one, one turn about its zero."""
    low, high = machine.arm.limits[:, 0].copy(), machine.arm.limits[:, 1].copy()
    for j in range(len(low)):
        if np.isfinite(high[j] - low[j]):
            continue
        drive = machine.site.arm.joints[j].drive
        scale = abs(drive.scale) if isinstance(drive, DirectDrive) else 1.0
        if not np.isfinite(low[j]) and not np.isfinite(high[j]):
            low[j], high[j] = -np.pi / scale, np.pi / scale
        elif np.isfinite(low[j]):
            high[j] = low[j] + 2.0 * np.pi / scale
        else:
            low[j] = high[j] - 2.0 * np.pi / scale
    return low, high


def reaches(machine: Machine) -> dict[str, Reach]:
    """What can be reached, by the name of the zone."""
    low, high = span(machine)
    moving = {item.name for item in machine.site.scene.moving}
    found = {name: Reach(name, frozen=name in moving) for name in machine.sweeper.zones}
    for posture in _postures(low, high):
        still = machine.sweeper.sweep(posture, np.zeros_like(posture), clearance=False)
        for entry in still.zones:
            one = found[entry.zone]
            if entry.certificate is Certificate.CONTACT:
                one.inside += 1
                one.links[entry.link or "its actuator"] += 1
            elif entry.certificate is Certificate.UNKNOWN:
                one.unknown += 1
    _prove(machine, low, high, found)
    return found


def _postures(low: FloatArray, high: FloatArray) -> Iterator[FloatArray]:
    rng = np.random.default_rng(_SEED)
    for share in rng.random((POSTURES, len(low))):
        yield low + share * (high - low)


def _prove(machine: Machine, low: FloatArray, high: FloatArray, found: dict[str, Reach]) -> None:
    """Note which zones no posture at all can touch."""
    limits = [item for item in machine.site.scene.objects if isinstance(item, ActuatorLimit)]
    for limit in limits:
        above = limit.above is None or high[limit.actuator] < limit.above
        below = limit.below is None or low[limit.actuator] > limit.below
        endless = not np.isfinite(machine.arm.limits[limit.actuator]).all()
        found[limit.name].unreachable = above and below and not endless
    sweeper = _without(machine, limits)
    names = {limit.name for limit in limits}
    asked = [
        name
        for name, one in found.items()
        if name not in names and not one.inside and not one.unknown and not one.frozen
    ]
    for name in asked[:_PROVEN_MOST]:
        told = sweeper.sweep(
            low, high - low, any_path=True, clearance=False, only=frozenset({name})
        )
        found[name].unreachable = told.any_path is AnyPath.FREE


def _without(machine: Machine, limits: list[ActuatorLimit]) -> FclSweeper:
    """The same arm among solid zones alone: a limit that is met would answer for all of them."""
    if not limits:
        return machine.sweeper
    scene = machine.site.scene
    solid = tuple(item for item in scene.objects if not isinstance(item, ActuatorLimit))
    return machine.sweeper.in_scene(replace(scene, objects=solid))
