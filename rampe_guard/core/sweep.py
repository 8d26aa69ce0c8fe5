"""The certified sweep: every zone gets its own proof, contact or honest "unknown".

::

    path ─► poses on a grid ─► coarse bounds of all pairs at once ─► per zone: ZoneSearch
                                                   └─► any monotone path: sweep_box

Zones share one budget of clearance queries, spent on the nearest first.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.sweep_box import any_monotone_path
from rampe_guard.core.sweep_limit import sweep_limit
from rampe_guard.core.sweep_path import SweptPath, swept_path, valid_end
from rampe_guard.core.sweep_problem import Zone
from rampe_guard.core.sweep_rows import Budget, Rows
from rampe_guard.core.sweep_zone import ZoneSearch
from rampe_guard.core.types import AnyPath, Certificate, SweepResult, ZoneSweep

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.sweep_problem import ClearanceOracle, SweepProblem
    from rampe_guard.core.types import FloatArray

COARSE_SAMPLES = 5
STRAY_SHARE = 0.25
"""Share of the clearance tolerance that links may stray from their chords between samples."""


def sweep(
    problem: SweepProblem,
    oracle: ClearanceOracle,
    config: SweepConfig,
    start: FloatArray,
    displacement: FloatArray,
    *,
    clearance: bool = True,
    any_path: bool = False,
    only: frozenset[str] | None = None,
) -> SweepResult:
    """Sweep every link against every zone along start + s·displacement, 0 <= s <= 1.

    Args:
        problem: arm and zones.
        oracle: geometry queries.
        config: tolerances and budget.
        start: actuator values (n,).
        displacement: their change (n,).
        clearance: also find each free zone's least clearance on the way; else the bound that
            certified it is given, which may be far less.
        any_path: also ask whether any monotone way to the end could touch.
        only: names of the zones that are asked about; None asks about all.

    Returns:
        One entry per zone asked about. A path that leaves the range in which the drives are
        proven, or that is not finite, is unknown from there on.

    Raises:
        ValueError: if a shape is wrong.
    """
    start = np.array(start, dtype=float)
    displacement = np.array(displacement, dtype=float)
    shape = problem.arm.lower.shape
    if start.shape != shape or displacement.shape != shape:
        raise ValueError(
            f"start has shape {start.shape} and displacement {displacement.shape}; "
            f"this arm has {shape[0]} actuators"
        )
    end = valid_end(problem.arm, start, displacement)
    asked = [i for i, zone in enumerate(problem.zones) if only is None or zone.name in only]
    if end is None:
        every = _without_geometry(problem, start, displacement)
        zones = tuple(every[i] for i in asked)
        return SweepResult(zones=zones, any_path=AnyPath.UNKNOWN if any_path else None)
    budget = Budget(config.max_queries)
    stray_m = STRAY_SHARE * config.clearance_tolerance_m
    path = swept_path(problem.arm, start, displacement, end, stray_m)
    found: dict[int, ZoneSweep] = {}
    for index, zone, coarse in _by_distance(problem, path, asked):
        least = float(coarse[0].min())
        far = least > zone.margin_m + config.tolerance_m and path.end >= 1.0
        if far and not (clearance or zone.hollow):
            found[index] = _far(problem, index, zone, coarse, closing=bool(displacement.any()))
        else:
            rows = Rows(problem, index, path, oracle, budget, coarse)
            search = ZoneSearch(zone, rows, config, problem.link_names)
            found[index] = search.run(clearance=clearance)
    for index in asked:
        item = problem.zones[index]
        if not isinstance(item, Zone):
            found[index] = sweep_limit(item, start, displacement)
        elif index not in found:
            found[index] = _untouchable(item.name)
    result = SweepResult(zones=tuple(found[i] for i in asked))
    if any_path and result.certificate is Certificate.FREE:
        answer = any_monotone_path(problem, oracle, config, start, displacement, budget)
        result = replace(result, any_path=answer)
    elif any_path:
        touches = result.certificate is Certificate.CONTACT
        result = replace(result, any_path=AnyPath.POSSIBLE if touches else AnyPath.UNKNOWN)
    return replace(result, queries=budget.spent)


def _by_distance(
    problem: SweepProblem, path: SweptPath, asked: Sequence[int]
) -> list[tuple[int, Zone, tuple[FloatArray, FloatArray]]]:
    """Solid zones asked about, nearest first, with bounds per row and cell, and at the start."""
    if problem.coarse is None:
        return []
    K = path.cells
    at = np.unique(np.linspace(0, K, min(COARSE_SAMPLES, K + 1)).round().astype(np.intp))
    coarse = problem.coarse(
        path.rotations[:, :, at].transpose(2, 1, 0, 3), path.translations[:, at].transpose(1, 0, 2)
    )
    moved = np.zeros((len(problem.solid_links), K + 1))
    np.cumsum(path.motion[problem.solid_links], axis=1, out=moved[:, 1:])
    way = np.diff(moved[:, at]).T[:, :, None]
    blocks = np.repeat(0.5 * (coarse[:-1] + coarse[1:] - way), np.diff(at), axis=0)
    blocks = np.moveaxis(blocks, 0, -1)
    zones = []
    for index in asked:
        zone, table = problem.zones[index], problem.rows[index]
        if isinstance(zone, Zone) and len(table.body):
            way_of = blocks[table.body, table.obstacle]
            zones.append((index, zone, (way_of, coarse[0, table.body, table.obstacle])))
    return sorted(zones, key=lambda item: (float(item[2][0].min()), item[0]))


def _far(
    problem: SweepProblem,
    index: int,
    zone: Zone,
    coarse: tuple[FloatArray, FloatArray],
    *,
    closing: bool,
) -> ZoneSweep:
    """A zone that the coarse bounds alone prove free, and no link can be inside of."""
    way, start = coarse
    least = float(way.min())
    row = int(np.argmin(way)) // way.shape[1]
    return ZoneSweep(
        zone=zone.name,
        certificate=Certificate.FREE,
        contact_fraction=None,
        link=problem.link_names[int(problem.rows[index].link[row])],
        contact_point_m=None,
        clearance_m=least - zone.margin_m,
        clearance_now_m=max(float(start.min()), least) - zone.margin_m,
        closing=closing,
        margin_m=zone.margin_m,
    )


def _without_geometry(
    problem: SweepProblem, start: FloatArray, displacement: FloatArray
) -> tuple[ZoneSweep, ...]:
    """Actuator limits still have an answer if the numbers are finite; solid zones have none."""
    finite = bool(np.isfinite(start).all() and np.isfinite(displacement).all())
    return tuple(
        sweep_limit(zone, start, displacement)
        if finite and not isinstance(zone, Zone)
        else uncomputed(zone.name)
        for zone in problem.zones
    )


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


def _untouchable(name: str) -> ZoneSweep:
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
