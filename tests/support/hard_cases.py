"""Motions constructed to be hard to judge: clutter, thin things, grazes, met only on the way.

A batch is one scene and its motions. Objects are built for one motion each and lie as they lie
for the others; every motion is judged against all of them. A seed gives the same batch again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tests.support.hard_objects import BULKY, THIN, random_object, random_plane, shifted
from tests.support.motion import Motion
from tests.support.obstacles import Obstacle
from tests.support.search import ZoneTruth

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.scene import SolidObject
    from rampe_guard.core.types import FloatArray
    from tests.support.dense import DenseArm

KINDS = ("clutter", "thin", "graze", "middle")
GRAZES_M = (0.0001, 0.0003, 0.001, 0.002)
PER_BATCH = 10
TRIES = 12


@dataclass(frozen=True, slots=True)
class Machine:
    """An arm to be tried.

    Attributes:
        name: for tables.
        dense: its independent reading.
        lower: of the actuators (n,) [unit].
        upper: of the actuators (n,) [unit].
        reach: about how far it reaches [m].
    """

    name: str
    dense: DenseArm
    lower: FloatArray
    upper: FloatArray
    reach: float


@dataclass(frozen=True, slots=True)
class Batch:
    """One scene, and motions as (start (n,), displacement (n,)) in actuator units."""

    items: tuple[SolidObject, ...]
    motions: tuple[tuple[FloatArray, FloatArray], ...]


def make_batch(
    machine: Machine, kind: str, rng: np.random.Generator, folder: Path, motions: int = PER_BATCH
) -> Batch:
    """A batch of one of KINDS; meshes of the scene go to ``folder``."""
    builder = _Builder(machine, rng, folder)
    paths = [builder.motion() for _ in range(motions)]
    measured = [Motion(machine.dense, *path) for path in paths]
    items: list[SolidObject] = []
    if kind == "clutter":
        items = builder.clutter(measured, int(rng.integers(30, 101)))
    else:
        for i, motion in enumerate(measured):
            item = builder.on_the_way(motion, kind, f"{kind}-{i}")
            items += [] if item is None else [item]
        items += builder.clutter(measured, 3)
    return Batch(tuple(items), tuple(paths))


class _Builder:
    def __init__(self, machine: Machine, rng: np.random.Generator, folder: Path) -> None:
        self._machine, self._rng, self._folder = machine, rng, folder
        self._arm = machine.dense

    def motion(self) -> tuple[FloatArray, FloatArray]:
        """Some actuators move by up to 40 % of their range, others rest."""
        rng, lower, upper = self._rng, self._machine.lower, self._machine.upper
        start = rng.uniform(lower, upper)
        share = rng.uniform(-0.4, 0.4, size=len(start))
        share[rng.random(len(start)) < 0.4] = 0.0
        if not share.any():
            share[rng.integers(len(start))] = 0.3
        end = np.clip(start + share * (upper - lower), lower, upper)
        return start, end - start

    def clutter(self, motions: list[Motion], count: int) -> list[SolidObject]:
        """Objects of all kinds near where the arm works, few of them met at the first start."""
        rng = self._rng
        items: list[SolidObject] = []
        margin = 0.0 if rng.random() < 0.5 else float(0.03 * self._machine.reach * rng.random())
        while len(items) < count:
            name = f"clutter-{len(items)}"
            motion = motions[int(rng.integers(len(motions)))]
            if rng.random() < 0.02:
                item: SolidObject = random_plane(rng, name, self._machine.reach)
            else:
                at = self._point_on_arm(motion, float(rng.random()))
                at = at + self._machine.reach * rng.normal(size=3) * rng.uniform(0.05, 0.3)
                item = self._object(rng.choice(BULKY + THIN), name, at)
            item = replace(item, margin_m=margin)
            if not self._touched_at(item, motions[0], (0.0,)) or rng.random() < 0.05:
                items.append(item)
        return items

    def on_the_way(self, motion: Motion, kind: str, name: str) -> SolidObject | None:
        """An object that the motion meets or misses by a hair, if one is found in a few tries."""
        rng = self._rng
        for _ in range(TRIES):
            share = float(rng.uniform(0.3, 0.7))
            shape = rng.choice(THIN if kind == "thin" or rng.random() < 0.5 else BULKY)
            item = self._object(str(shape), name, self._point_on_arm(motion, share))
            if kind == "graze":
                margin = 0.0 if rng.random() < 0.6 else 0.02 * self._machine.reach
                by = float(rng.choice(GRAZES_M) * rng.choice([-1.0, 1.0]))
                found = self._graze(replace(item, margin_m=margin), motion, by)
                if found is not None:
                    return found
            elif kind == "thin" or not self._touched_at(item, motion, (0.0, 1.0)):
                return item
        return None

    def _object(self, kind: str, name: str, at: FloatArray) -> SolidObject:
        return random_object(self._rng, kind, name, at, self._machine.reach, self._folder)

    def _point_on_arm(self, motion: Motion, share: float) -> FloatArray:
        """A vertex of a link there; those that move far are taken more often."""
        ways = np.array([motion.moved(link, 0.0, 1.0) for link in motion.links])
        weight = (ways + 1e-9) / (ways + 1e-9).sum()
        link = motion.links[int(self._rng.choice(len(ways), p=weight))]
        body, pose = self._arm.body(link), motion.pose(link, share)
        return np.asarray(pose[:3, :3] @ self._rng.choice(body.hull) + pose[:3, 3])

    def _touched_at(self, item: SolidObject, motion: Motion, fractions: tuple[float, ...]) -> bool:
        truth = ZoneTruth(self._arm, motion, Obstacle(item))
        return any(
            truth.contained(s)
            or any(truth.below_at(link, s, item.margin_m) for link in truth.links)
            for s in fractions
        )

    def _graze(self, item: SolidObject, motion: Motion, by: float) -> SolidObject | None:
        """The object moved until the least distance on the way is its margin plus ``by``.

        Below 0 there is nothing to measure, so it is brought near first and then pushed in.
        """
        target = item.margin_m + by
        goal = target if target > 0.0 else 0.0005
        for _ in range(8):
            truth = ZoneTruth(self._arm, motion, Obstacle(item))
            least = truth.minimum(0.01 * max(item.margin_m, 0.1))
            if least.distance <= 0.0:  # out of the way first
                item = shifted(item, self._outwards(item, motion, least.fraction, least.link))
                continue
            up = self._gradient(truth, motion, least.fraction, least.link)
            if up is None:
                return None
            error = least.distance - goal
            if abs(error) < 1e-6:
                break
            item = shifted(item, -error * up)
        else:
            return None
        if not 0.02 < least.fraction < 0.98 or self._touched_at(item, motion, (0.0, 1.0)):
            return None
        return item if goal == target else shifted(item, (target - goal) * up)

    def _outwards(self, item: SolidObject, motion: Motion, share: float, link: str) -> FloatArray:
        """A step away from the middle of a link."""
        body, pose = self._arm.body(link), motion.pose(link, share)
        way = Obstacle(item).middle - pose[:3, :3] @ body.middle - pose[:3, 3]
        way += 0.1 * float(np.linalg.norm(way)) * self._rng.normal(size=3)
        return np.asarray(way / np.linalg.norm(way) * self._machine.reach * 0.05)

    def _gradient(
        self, truth: ZoneTruth, motion: Motion, share: float, link: str
    ) -> FloatArray | None:
        """Unit direction in which the object must move to get away fastest."""
        body, pose, step = self._arm.body(link), motion.pose(link, share), 1e-6
        slope = np.zeros(3)
        for i in range(3):
            for sign in (-1.0, 1.0):
                moved = pose.copy()
                moved[i, 3] -= sign * step
                slope[i] += sign * truth.obstacle.distance(body, moved)[0]
        norm = float(np.linalg.norm(slope))
        return None if norm < step else slope / norm
