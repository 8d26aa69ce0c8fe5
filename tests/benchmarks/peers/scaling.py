"""How ours grows: with the number of objects, with the triangles of one mesh, with any path."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.benchmarks.peers.clock import race
from tests.benchmarks.peers.judge import Judge
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.scenes import box_item, build_work, draw_motions, mesh_item
from tests.benchmarks.peers.terrain import terrain
from tests.benchmarks.peers.work import Work

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from tests.benchmarks.peers.work import Item, Machine

TRIANGLES = (1_000, 100_000, 1_000_000)
CHOICE = 4
"""Motions that are drawn for each one that is used on a ground."""
FAR = 1.3
"""From here on [reach], nothing can be touched."""


@dataclass(frozen=True, slots=True)
class Growth:
    """Ours on one scene of a series.

    Attributes:
        series: what grows, and how.
        size: objects or triangles.
        load_s: building the sweeper.
        contacts: of the motions.
        ratio: median by that of the series' first.
    """

    series: str
    size: int
    load_s: float
    contacts: int
    median_ms: float
    p99_ms: float
    ratio: float

    def line(self) -> str:
        """A row of the table."""
        return (
            f"| {self.series} | {self.size:,} | {self.median_ms:.3f} | {self.p99_ms:.3f} |"
            f" {self.ratio:.2f} | {self.contacts} | {self.load_s:.1f} |"
        )


HEAD = (
    "| series | size | median ms | p99 ms | x the first | contacts | load s |\n" + "|---" * 7 + "|"
)


def object_scaling(
    machine: Machine, counts: Sequence[int], segments: int, seed: int, folder: Path
) -> list[Growth]:
    """Twice: ever more of the same clutter, and the same surroundings in an ever larger yard."""
    works = [build_work(machine, count, "mixed", segments, seed, folder) for count in counts]
    grown = _grow(f"{machine.name}: objects, as dense all over", counts, works)
    near, far = works[0], works[-1].items
    away = [item for item in far if _distance(item) > FAR * machine.reach_m]
    yards = []
    for count in counts:
        more = [_renamed(away[k % len(away)], k, machine) for k in range(count - len(near.items))]
        yards.append(Work(machine, (*near.items, *more), near.motions, "mixed"))
    return grown + _grow(f"{machine.name}: objects, the same within reach", counts, yards)


def mesh_scaling(machine: Machine, segments: int, seed: int, folder: Path) -> list[Growth]:
    """One ground of ever more triangles; motions begin above its highest place.

    As many as can be found, at most half of them, end below that place.
    """
    reach = machine.reach_m
    top = machine.floor_m - max(0.01 * reach, 4.0 * machine.tolerance_m)
    pose = np.eye(4)
    pose[2, 3] = top - 0.5 * reach
    slab = box_item("slab", 0, np.array([8.0 * reach, 8.0 * reach, reach]), pose)
    above = Work(machine, (slab,), (), "meshes")
    drawn = draw_motions(above, np.random.default_rng([seed, 1]), CHOICE * segments)
    judge = Judge(above)
    dips = [motion for motion in drawn if judge.clearance(motion, 1.0) <= 0.0]
    others = [motion for motion in drawn if judge.clearance(motion, 1.0) > 0.0]
    half = min(len(dips), segments // 2)
    motions = (*dips[:half], *others[: segments - half])
    works = []
    for count in TRIANGLES:
        ground = terrain(count, 4.0 * reach, 0.1 * reach, top)
        item = mesh_item(f"terrain-{count}", 0, ground, np.eye(4), folder, convex=False)
        works.append(Work(machine, (item,), motions, "meshes"))
    return _grow(f"{machine.name}: triangles of one mesh", TRIANGLES, works)


def any_path(machine: Machine, segments: int, seed: int, folder: Path) -> dict[str, Any]:
    """Every monotone way of three actuators among 100 objects."""
    scene = build_work(machine, 100, "mixed", 1, seed, folder)
    motions = draw_motions(scene, np.random.default_rng([seed, 2]), segments, moving=3)
    peer = _AnyPath(Work(machine, scene.items, motions, "mixed"))
    ((_, times),) = race([peer], len(motions))
    answers = Counter(peer.answers)
    return {
        "arm": machine.name,
        "motions": len(motions),
        "median_ms": float(np.median(times)),
        "p99_ms": float(np.percentile(times, 99)),
        "answers": dict(answers),
    }


class _AnyPath:
    """Ours, asked for every monotone path; a contact fraction of its own it has none."""

    def __init__(self, work: Work) -> None:
        self._sweeper = Ours(work).sweeper
        self._motions = work.motions
        self.answers = [""] * len(work.motions)

    def first_contact(self, number: int) -> float | None:
        """Ask, and keep the answer."""
        start, displacement = self._motions[number].start, self._motions[number].displacement
        result = self._sweeper.sweep(start, displacement, any_path=True, clearance=False)
        self.answers[number] = str(result.any_path)
        return None


def records(grown: Sequence[Growth]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(row) for row in grown]


def _grow(series: str, sizes: Sequence[int], works: Sequence[Work]) -> list[Growth]:
    rows: list[Growth] = []
    peers, loads = [], []
    for work in works:
        begin = perf_counter()
        peers.append(Ours(work))
        loads.append(perf_counter() - begin)
    timed = race(peers, len(works[0].motions))
    for size, load, (answers, times) in zip(sizes, loads, timed, strict=True):
        median = float(np.median(times))
        rows.append(
            Growth(
                series=series,
                size=size,
                load_s=load,
                contacts=sum(answer is not None for answer in answers),
                median_ms=median,
                p99_ms=float(np.percentile(times, 99)),
                ratio=median / rows[0].median_ms if rows else 1.0,
            )
        )
    return rows


def _distance(item: Item) -> float:
    radius = np.linalg.norm(item.surface.vertices, axis=1).max()
    return float(np.linalg.norm(item.pose[:3, 3]) - radius)


def _renamed(item: Item, number: int, machine: Machine) -> Item:
    """A far object once more, farther out, as a box of its size."""
    way = item.pose[:3, 3] / np.linalg.norm(item.pose[:3, 3])
    pose = item.pose.copy()
    pose[:3, 3] += way * machine.reach_m * (number / 500.0)
    size = np.ptp(item.surface.vertices, axis=0)
    return box_item(f"far-{number}", number, size, pose)
