"""Dense search of one motion against exact shapes; what is skipped is skipped by measure.

Between two configurations no point of a link moves farther than its farthest outermost vertex,
and the distance of two shapes cannot change faster than their points move. So a distance d at
one sample leaves at least d - w at another, a way w off; and so does the gap between the link
and the obstacle along any fixed direction, computed at grid samples. Stretches for which that
does not answer are halved until they are FINE_M or STEP_M of motion long: the answers are
those of sampling every FINE_M or STEP_M, at less cost.

The ways are those of `tests.support.motion`, measured on poses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tests.support.motion import COARSE
from tests.support.obstacles import contained

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.support.dense import DenseArm
    from tests.support.motion import Motion
    from tests.support.obstacles import Obstacle

FINE_M = 2e-5
"""Sampling of stretches that may hold a contact [m of motion]."""
STEP_M = 1e-3
"""Sampling of other stretches [m of motion]."""
EDGE_M = 1e-7
"""How exactly the edge of a contact is found [m of motion]."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
GOLDEN_STEPS = 32
DOUBTS = 8
"""Stretches left in doubt, the lowest first, that are searched by golden section."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A distance [m] of surfaces (without margin) of a link at a fraction of the motion."""

    distance: float
    fraction: float
    link: str


class ZoneTruth:
    """What is true of one motion and one obstacle.

    ``_bounds`` holds per link what its distance surely is not below, in each stretch of the
    grid (k,) [m]; every distance that is measured raises it.
    """

    def __init__(self, arm: DenseArm, motion: Motion, obstacle: Obstacle) -> None:
        self._arm, self._motion, self.obstacle = arm, motion, obstacle
        self.links = [n for n in motion.links if n not in obstacle.item.ignore_links]
        self._known: dict[tuple[str, float], float] = {}
        self._inside: dict[float, bool] = {}
        self._ends: dict[str, tuple[float, float]] = {}
        self._bounds = {link: self._first_bounds(link) for link in self.links}

    def distance(self, link: str, fraction: float) -> float:
        """Distance of surfaces [m], 0 in contact."""
        key = link, fraction
        if key not in self._known:
            pose = self._motion.pose(link, fraction)
            self._known[key], _ = self.obstacle.distance(self._arm.body(link), pose)
        return self._known[key]

    def contained(self, fraction: float) -> bool:
        """Whether a link or the obstacle is inside the other at the start (0) or end (1)."""
        if fraction not in self._inside:
            self._inside[fraction] = any(self._holds(link, fraction) for link in self.links)
        return self._inside[fraction]

    def below_at(self, link: str, fraction: float, level: float) -> bool:
        """Whether a link is below a level at the start (0) or end (1) of the motion."""
        return self._ends[link][round(fraction)] < level and self.distance(link, fraction) < level

    def at(self, fraction: float) -> Sample:
        """The nearest link at a fraction."""
        found = [Sample(self.distance(link, fraction), fraction, link) for link in self.links]
        return min(found, key=_by_distance)

    def first(self, level: float, *, backwards: bool = False) -> Sample | None:
        """The first fraction (the last, if backwards) at which a link is at or below ``level``."""
        best: Sample | None = None
        for link in self.links:
            found = self._first_of(link, level, best, backwards=backwards)
            best = best if found is None else found
        return best

    def least(self, level: float, *, enough: float = -np.inf) -> Sample:
        """The smallest distance found where any below ``level`` is looked for.

        It stops early at one that is ``enough`` or less. What it returns was measured, so it is
        never below the truth; above it only if the truth is above ``level`` too, or by what a
        motion of STEP_M (near contact FINE_M) and a golden section can hide.
        """
        return self._lowest(level, enough, None)

    def minimum(self, within: float) -> Sample:
        """The smallest distance on the way, to ``within`` [m] and then by golden section."""
        best = self._lowest(np.inf, -np.inf, within)
        span = STEP_M / max(self._motion.moved(best.link, 0.0, 1.0), STEP_M)
        a, b = max(best.fraction - span, 0.0), min(best.fraction + span, 1.0)
        return min(best, self._golden(best.link, a, b), key=_by_distance)

    # --- bounds ----------------------------------------------------------------------------

    def _first_bounds(self, link: str) -> FloatArray:
        """From balls round the link."""
        away = self.obstacle.away(self._motion.coarse[link]) - self._arm.body(link).radii
        nearest = away.min(axis=1)
        self._ends[link] = float(nearest[0]), float(nearest[-1])
        moved = np.diff(self._motion.way[link][::COARSE])
        return np.repeat(0.5 * (nearest[:-1] + nearest[1:] - moved), COARSE)

    def _measure(self, link: str, fraction: float) -> Sample:
        """A distance, and all that it says of other fractions."""
        body, pose = self._arm.body(link), self._motion.pose(link, fraction)
        distance, whereto = self.obstacle.distance(body, pose)
        self._known[link, fraction] = distance
        way = self._motion.way[link]
        here = float(np.interp(fraction, self._motion.at, way))
        bounds = distance - np.maximum(np.abs(way[:-1] - here), np.abs(way[1:] - here))
        np.maximum(bounds, self._bounds[link], out=bounds)
        low = np.flatnonzero(bounds < distance)  # the others are no nearer than this one
        if whereto is not None and low.size:
            stretch, ends = slice(low[0], low[-1] + 1), slice(low[0], low[-1] + 2)
            gaps = -self.obstacle.support(-whereto) - self._motion.farthest(link, whereto, ends)
            gaps = 0.5 * (gaps[:-1] + gaps[1:] - np.diff(way[ends]))
            np.maximum(bounds[stretch], gaps, out=bounds[stretch])
        self._bounds[link][:] = bounds
        return Sample(distance, fraction, link)

    def _holds(self, link: str, fraction: float) -> bool:
        body, pose = self._arm.body(link), self._motion.pose(link, fraction)
        around = self.obstacle.inner - pose[:3, :3] @ body.middle - pose[:3, 3]
        near = self._ends[link][round(fraction)] <= 0.0
        near = near or bool((np.linalg.norm(around, axis=1) <= body.extent).any())
        return near and contained(body, pose, self.obstacle)

    # --- searches --------------------------------------------------------------------------

    def _lowest(self, level: float, enough: float, within: float | None) -> Sample:
        margin = self.obstacle.item.margin_m
        best = Sample(np.inf, 0.0, self.links[0])
        done = {link: np.zeros(len(self._bounds[link]), dtype=bool) for link in self.links}
        low = {link: int(np.argmin(self._bounds[link])) for link in self.links}
        doubtful: list[tuple[float, str, float, float]] = []
        while best.distance > enough:
            bound, link = min((self._bounds[n][i], n) for n, i in low.items() if not done[n][i])
            goal = level if within is None else best.distance - within
            if bound >= goal and np.isfinite(best.distance):
                break
            i = low[link]
            a, b = float(self._motion.at[i]), float(self._motion.at[i + 1])
            best = min(best, self._measure(link, 0.5 * (a + b)), key=_by_distance)
            goal = level if within is None else best.distance - within
            if self._bounds[link][i] < goal:
                finest = FINE_M if goal < margin + STEP_M else STEP_M
                found, doubts = self._halve(link, a, b, goal, finest)
                best = min(best, found, key=_by_distance)
                doubtful += doubts
                done[link][i] = True
            low[link] = int(np.argmin(np.where(done[link], np.inf, self._bounds[link])))
            if all(done[n][i] for n, i in low.items()):
                break
        if within is None and best.distance > enough:
            for _, link, a, b in sorted(doubtful)[:DOUBTS]:
                best = min(best, self._golden(link, a, b), key=_by_distance)
        return best

    def _halve(
        self, link: str, a: float, b: float, goal: float, finest: float
    ) -> tuple[Sample, list[tuple[float, str, float, float]]]:
        """The least sample of a stretch, and what of it may still be below the goal."""
        best, doubts, todo = Sample(np.inf, a, link), [], [(a, b)]
        while todo:
            a, b = todo.pop()
            da, db = self.distance(link, a), self.distance(link, b)
            best = min(best, Sample(da, a, link), Sample(db, b, link), key=_by_distance)
            way = self._motion.between(link, a, b)
            bound = 0.5 * (da + db - way)
            if bound < goal and way <= finest:
                doubts.append((bound, link, a, b))
            elif bound < goal:
                todo += [(a, 0.5 * (a + b)), (0.5 * (a + b), b)]
        return best, doubts

    def _first_of(
        self, link: str, level: float, best: Sample | None, *, backwards: bool
    ) -> Sample | None:
        """The first contact of one link, if it is before the best of others."""
        at, bounds, i = self._motion.at, self._bounds[link], 0
        sense = -1.0 if backwards else 1.0
        while True:
            ordered = bounds[::-1] if backwards else bounds
            ahead = np.flatnonzero(ordered[i:] <= level)
            if not ahead.size:
                return None
            i += int(ahead[0])
            k = len(bounds) - 1 - i if backwards else i
            a, b = (at[k + 1], at[k]) if backwards else (at[k], at[k + 1])
            if best is not None and sense * a >= sense * best.fraction:
                return None
            self._measure(link, 0.5 * float(a + b))
            if bounds[k] > level:
                continue
            found = self._first_within(link, float(a), float(b), level)
            if found is not None:
                earlier = best is None or sense * found.fraction < sense * best.fraction
                return found if earlier else None
            i += 1

    def _first_within(self, link: str, a: float, b: float, level: float) -> Sample | None:
        todo = [(a, b)]
        while todo:
            a, b = todo.pop()
            da, db = self.distance(link, a), self.distance(link, b)
            if da <= level:
                return Sample(da, a, link)
            way = self._motion.between(link, a, b)
            if 0.5 * (da + db - way) > level:
                continue
            if way > FINE_M:
                todo += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
            elif db <= level:
                return self._edge(link, a, b, level)
        return None

    def _edge(self, link: str, a: float, b: float, level: float) -> Sample:
        while self._motion.between(link, a, b) > EDGE_M:
            middle = 0.5 * (a + b)
            if self.distance(link, middle) <= level:
                b = middle
            else:
                a = middle
        return Sample(self.distance(link, b), b, link)

    def _golden(self, link: str, a: float, b: float) -> Sample:
        c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
        for _ in range(GOLDEN_STEPS):
            if self.distance(link, c) <= self.distance(link, d):
                b, d = d, c
                c = b - GOLDEN * (b - a)
            else:
                a, c = c, d
                d = a + GOLDEN * (b - a)
        return min((Sample(self.distance(link, s), s, link) for s in (c, d)), key=_by_distance)


def _by_distance(sample: Sample) -> float:
    return sample.distance
