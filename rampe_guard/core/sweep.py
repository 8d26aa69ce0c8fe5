"""The certified sweep: every zone gets its own proof, contact or honest "unknown".

::

    path ─► poses and motion bounds on a grid ─► coarse bounds of all pairs (search_kernel)
         ─► walks of the pairs in doubt, nearest first (walk_kernel, which states the theorem)
         ─► any monotone way: boxes in actuator space (box_kernel)

All zones share one budget of distance queries. This module is the front: it checks what is
asked, runs the kernels, and puts their numbers into words.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from rampe_guard.core.arm_motion import PROBE_MOTION_M, valid_end
from rampe_guard.core.bounding_tree import NONE
from rampe_guard.core.kernel_data import FAR, Ask, Task
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.core.search_kernel import search
from rampe_guard.core.sweep_box import AnyWay
from rampe_guard.core.sweep_limit import sweep_limit
from rampe_guard.core.sweep_problem import Zone
from rampe_guard.core.types import AnyPath, Certificate, SweepResult, ZoneSweep

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.kernel_data import Records
    from rampe_guard.core.sweep_problem import SelfZone, SweepProblem
    from rampe_guard.core.types import FloatArray, Placement

Group: TypeAlias = tuple[Any, ...]
"""One GROUP record as a tuple."""
AGAIN_M = 0.1
"""A sweep that begins nearer than this to where the last one did tries its directions [m]."""
TOUCH_SHARE = 0.1
"""Share of the contact tolerance that counts as contact until a look ahead refutes it."""


class Sweep:
    """Sweeps of one problem. Not for several threads at once: the kernels' room is shared."""

    def __init__(self, problem: SweepProblem, config: SweepConfig) -> None:
        self.problem, self.config = problem, config
        self._last = np.full(problem.arm.lower.shape, 1e9)
        self._every = list(range(len(problem.zones)))
        self._solid = frozenset(problem.solid)
        self._other = [i for i in self._every if i not in self._solid]
        self._group = {index: number for number, index in enumerate(problem.solid)}
        self._keyed = [
            i for i, zone in enumerate(problem.zones) if isinstance(zone, Zone) and zone.placed
        ]
        self._any_way = AnyWay(problem, config, TOUCH_SHARE * config.tolerance_m)

    def run(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        clearance: bool = True,
        any_path: bool = False,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
        worst: bool = False,
    ) -> SweepResult:
        """Sweep every link against every zone along start + s·displacement, 0 <= s <= 1.

        Args:
            start: actuator values (n,).
            displacement: their change (n,).
            clearance: also find each free zone's least clearance on the way; else the bound that
                certified it is given, which may be far less.
            any_path: also ask whether any monotone way to the end could touch.
            wider_m: certificates are about margins of solid zones wider by so much [m];
                clearances still count from the margins themselves.
            only: names of the zones that are asked about; None asks about all.
            placed: where the zones that move are; None for one that nobody knows.
            worst: only the worst of all solid zones is wanted: later contacts are not looked for.

        Returns:
            One entry per zone asked about, or the worst solid zone and the actuator limits. A
            path that leaves the range in which the drives are proven, or that is not finite, is
            unknown from there on.

        Raises:
            ValueError: if a shape is wrong.
        """
        problem = self.problem
        start = np.array(start, dtype=float)
        displacement = np.array(displacement, dtype=float)
        shape = problem.arm.lower.shape
        if start.shape != shape or displacement.shape != shape:
            raise ValueError(
                f"start has shape {start.shape} and displacement {displacement.shape}; "
                f"this arm has {shape[0]} actuators"
            )
        asked = self._every if only is None else self._named(only)
        end = valid_end(problem.arm, start, displacement)
        if end is None:
            return SweepResult(
                zones=tuple(self._unfit(i, start, displacement) for i in asked),
                any_path=AnyPath.UNKNOWN if any_path else None,
            )
        zones, lost = self._place(placed or {}, asked, wider_m)
        told: list[Group] = []
        queries = 0
        if any(i in self._solid for i in asked):
            groups = self._search(zones, start, displacement, end, clearance=clearance, worst=worst)
            told = groups.view(np.ndarray).tolist()
            queries = int(problem.scratch.spent[0])
        moving = bool(displacement.any())
        entries = []
        if worst:
            together, asked = self._together(asked, lost)
            if together:
                entries.append(_from_margin(self._worst(told[0], end, moving=moving), wider_m))
        for index in asked:
            zone = problem.zones[index]
            if isinstance(zone, ActuatorLimit):
                entries.append(sweep_limit(zone, start, displacement))
            elif index in lost:
                entries.append(uncomputed(zone.name))
            else:
                found = told[self._group[index]]
                entries.append(_from_margin(self._entry(zone, found, end, moving=moving), wider_m))
        result = SweepResult(zones=tuple(entries), queries=queries)
        if not any_path:
            return result
        answer, witness = self._any_way.answer(zones, result, start, displacement)
        told_at = None if witness is None else tuple(witness.tolist())
        return replace(
            result,
            any_path=answer,
            witness=told_at,
            queries=result.queries + int(problem.scratch.spent[0]),
        )

    def _together(self, asked: list[int], lost: set[int]) -> tuple[bool, list[int]]:
        """Whether any zone is in the worst of all, and those that have an entry of their own."""
        if asked is self._every and not lost:
            return bool(self._solid), self._other
        own = [i for i in asked if i not in self._solid or i in lost]
        return len(own) < len(asked), own

    def _named(self, names: frozenset[str]) -> list[int]:
        return [i for i, zone in enumerate(self.problem.zones) if zone.name in names]

    def _search(
        self,
        zones: Records,
        start: FloatArray,
        displacement: FloatArray,
        end: float,
        *,
        clearance: bool,
        worst: bool,
    ) -> Records:
        problem, config = self.problem, self.config
        found = problem.found[worst]
        path = problem.path
        path.way[0], path.way[1], path.end[0] = start, displacement, end
        if end == 0.0:  # the start is all that is known
            path.way[1], path.end[0] = 0.0, 1.0
        arm = problem.arm
        fastest = float((np.abs(displacement)[arm.actuator] @ arm.coefficients).max(initial=0.0))
        task = Task(
            problem.tables,
            problem.shapes,
            problem.pairs,
            zones,
            path,
            problem.scratch,
            problem.doubt,
            found,
            Ask(
                tolerance=config.tolerance_m,
                touch=TOUCH_SHARE * config.tolerance_m,
                slack=config.clearance_tolerance_m if clearance else 10.0 * FAR,
                probe=min(1.0, PROBE_MOTION_M / fastest) if fastest > 0.0 else 0.0,
                limit=config.max_queries,
                together=int(worst),
                sharp=int(clearance),
                again=self._near_last(start),
            ),
        )
        search(task)
        return found

    def _near_last(self, start: FloatArray) -> int:
        """Whether the last sweep began so near that its directions are worth a try."""
        arm = self.problem.arm
        moved = np.abs(start - self._last)[arm.actuator] @ arm.coefficients
        self._last = start
        return int(moved.max(initial=0.0) < AGAIN_M)

    def _place(
        self, placed: Mapping[str, Placement | None], asked: list[int], wider_m: float
    ) -> tuple[Records, set[int]]:
        """The zones as they are now, and those of which nobody knows where they are."""
        problem = self.problem
        lost = {i for i in self._keyed if placed.get(problem.zones[i].name) is None}
        lost.intersection_update(asked)
        if not placed and not lost and asked is self._every and wider_m == 0.0:
            return problem.fixed, lost
        zones = problem.fixed.copy()
        zones.margin += wider_m
        wanted = set(asked) - lost
        for number, index in enumerate(problem.solid):
            zones.active[number] = index in wanted
            where = placed.get(problem.zones[index].name)
            if where is not None:
                zones.pose[number] = where.pose[:3]
                zones.margin[number] += where.grown_m
        return zones, lost

    def _unfit(self, index: int, start: FloatArray, displacement: FloatArray) -> ZoneSweep:
        """Actuator limits still have an answer if the numbers are finite; solid zones have none."""
        zone = self.problem.zones[index]
        finite = bool(np.isfinite(start).all() and np.isfinite(displacement).all())
        if finite and isinstance(zone, ActuatorLimit):
            return sweep_limit(zone, start, displacement)
        return uncomputed(zone.name)

    def _worst(self, found: Group, end: float, *, moving: bool) -> ZoneSweep:
        """The entry of all zones together."""
        problem = self.problem
        stop, *_, hit, nearest, _ = found
        pair = int(hit[0]) if stop < np.inf else nearest
        number = problem.pair_zone[pair] if pair != NONE else 0
        zone = problem.zones[problem.solid[number]]
        return self._entry(cast("Zone | SelfZone", zone), found, end, moving=moving)

    def _entry(self, zone: Zone | SelfZone, found: Group, end: float, *, moving: bool) -> ZoneSweep:
        stop, _, bound, unproven, now, _, confirmed, point, hit, nearest, closing = found
        touched = stop < np.inf
        if bound >= FAR and not touched and unproven == np.inf:
            return untouchable(zone.name)
        pair = int(hit[0]) if touched else nearest
        link = None
        if pair != NONE:
            link = self.problem.link_names[self.problem.pair_link[pair]]
        unknown = min(unproven, end if end < 1.0 else np.inf)
        free = not touched and unknown == np.inf
        fraction = None if free else min(stop, unknown)
        least = 0.0 if touched else max(bound, 0.0) if free else None
        known_now = now < FAR and (touched or unproven > 0.0)
        x, y, z = point.tolist()
        return ZoneSweep(
            zone=zone.name,
            certificate=Certificate.CONTACT
            if touched
            else Certificate.FREE
            if free
            else Certificate.UNKNOWN,
            contact_fraction=fraction,
            link=link,
            contact_point_m=(x, y, z) if touched else None,
            clearance_m=least,
            clearance_now_m=now if known_now else None,
            closing=bool(closing) and moving,
            margin_m=zone.margin_m,
            confirmed_fraction=_confirmed(stop, confirmed),
        )


def _from_margin(entry: ZoneSweep, wider_m: float) -> ZoneSweep:
    """An entry about a wider margin, with clearances from the margin itself."""
    if wider_m == 0.0:
        return entry
    least, now = entry.clearance_m, entry.clearance_now_m
    return replace(
        entry,
        clearance_m=None if least is None else least + wider_m,
        clearance_now_m=None if now is None else now + wider_m,
    )


def _confirmed(stop: float, confirmed: float) -> float | None:
    """A contact at the start needs no look ahead."""
    if stop == 0.0:
        return 0.0
    return confirmed if stop < np.inf and np.isfinite(confirmed) else None


def uncomputed(name: str) -> ZoneSweep:
    """The inputs are unfit: nothing is proven, and motion must be taken to close in."""
    return ZoneSweep(
        zone=name,
        certificate=Certificate.UNKNOWN,
        contact_fraction=0.0,
        link=None,
        contact_point_m=None,
        clearance_m=None,
        clearance_now_m=None,
        closing=True,
    )


def untouchable(name: str) -> ZoneSweep:
    """Every link may touch this zone, or the arm has no geometry that could."""
    return ZoneSweep(
        zone=name,
        certificate=Certificate.FREE,
        contact_fraction=None,
        link=None,
        contact_point_m=None,
        clearance_m=None,
        clearance_now_m=None,
        closing=False,
    )
