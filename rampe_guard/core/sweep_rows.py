"""Proven distance bounds of one path against one zone, and the queries that sharpen them.

Rows are pairs of convex pieces (of a link, of the zone), columns the cells of the path. Each
entry holds a proven lower bound of the pair's distance anywhere in the cell. Bounds start
coarse; each query gives a separating direction, and the support gap along that direction at all
samples sharpens the whole row at once: between two samples a link point strays from its chord by
no more than the path's stray bound, and the support of a set is convex in its points, so

    gap(cell) >= min(gap(a), gap(b)) - stray,    gap(cell) >= (gap(a) + gap(b))/2 - motion/2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.convex import gaps, lower_support
from rampe_guard.core.sweep_problem import Nearest

if TYPE_CHECKING:
    from rampe_guard.core.sweep_path import SweptPath
    from rampe_guard.core.sweep_problem import ClearanceOracle, SweepProblem
    from rampe_guard.core.types import FloatArray


class BudgetSpentError(Exception):
    """The sweep's queries are used up; what is not proven by now stays unknown."""


@dataclass(slots=True)
class Budget:
    """Counts clearance queries, so that the same call always ends at the same point."""

    limit: int
    spent: int = 0

    def spend(self) -> None:
        """Take one query.

        Raises:
            BudgetSpentError: if none is left.
        """
        if self.spent >= self.limit:
            raise BudgetSpentError
        self.spent += 1


class Rows:
    """Bounds of one zone's rows.

    Attributes:
        bound: proven distance per row and cell (P, K) [m].
        doubt: the same, but infinite where the cell has been cleared by walking through it.
        start: proven distance per row at the start of the path (P,) [m].
        probe: per row the gap at the start and after the small first step (P, 2) [m], or NaN.
        tried: samples of each row that have been queried (P, K + 1).
        link: link of each row (P,).
        excess: how far the pieces of each row bulge beyond their surfaces, about (P,) [m].
    """

    def __init__(
        self,
        problem: SweepProblem,
        zone: int,
        path: SweptPath,
        oracle: ClearanceOracle,
        budget: Budget,
        coarse: tuple[FloatArray, FloatArray],
    ) -> None:
        """``coarse``: bounds per row and cell (P, K), and per row at the start (P,) [m]."""
        self.path = path
        self._problem, self._zone, self._oracle, self._budget = problem, zone, oracle, budget
        self._piece, self._obstacle = problem.rows[zone]
        self.link = problem.piece_link[self._piece]
        self.excess = problem.piece_excess[self._piece] + problem.obstacle_excess[self._obstacle]
        self.bound = np.maximum(coarse[0], 0.0)
        self.doubt = self.bound.copy()
        self.start = np.maximum(coarse[1], 0.0)
        self.tried = np.zeros((len(self.link), path.cells + 1), dtype=bool)
        self.probe = np.full((len(self.link), 2), np.nan)
        self._exact: dict[tuple[int, float], Nearest] = {}

    def __len__(self) -> int:
        return len(self.link)

    def query(self, row: int, sample: int) -> float:
        """Sharpen a row with a direction found at one sample; its gap there [m], or -inf."""
        self.tried[row, sample] = True
        path, link = self.path, self.link[row]
        best = -np.inf
        for swapped in (False, True):
            n, low, vertices = self._direction(
                row, path.poses(float(path.fractions[sample]))[link], swapped=swapped
            )
            if n is None:
                break
            g = gaps(vertices, path.rotations[:, link], path.translations[:, link], n, low)
            a, b = g[:-2], g[1:-1]
            cell = np.minimum(a, b) - path.stray[:, link]
            np.maximum(cell, 0.5 * (a + b - path.motion[:, link]), out=cell)
            np.maximum(self.bound[row], cell, out=self.bound[row])
            np.maximum(self.doubt[row], cell, out=self.doubt[row])
            self.start[row] = max(self.start[row], g[0])
            if sample == 0 and g[0] > best:
                self.probe[row] = g[0], g[-1]
            best = max(best, float(g[sample]))
            if best > 0.0:
                break
        return best

    def distance(self, link: int, fraction: float) -> Nearest:
        """Exact distance of a link, remembered; at the start it tells inside from outside too."""
        known = self._exact.get((link, fraction))
        if known is None:
            self._budget.spend()
            pose = self.path.poses(fraction)[link]
            known = self._oracle.distance(link, self._zone, pose)
            if fraction == 0.0 and known.distance_m > 0.0:
                inside = self._oracle.contained(link, self._zone, pose)
                known = known if inside is None else Nearest(0.0, inside)
            self._exact[link, fraction] = known
        return known

    def knows_start(self, link: int) -> bool:
        """Whether the exact distance of this link at the start has been asked."""
        return (link, 0.0) in self._exact

    def step(self, row: int, cell: int, s: float, rest: float, target: float) -> float:
        """How far beyond fraction s, at most ``rest``, the row is proven farther than ``target``.

        0 if its pieces are not provably farther than that at s.
        """
        path, link = self.path, int(self.link[row])
        pose = path.poses(s)[link]
        n, low, vertices = self._direction(row, pose, swapped=False)
        if n is None:
            return 0.0
        gap = _gap(vertices, pose, n, low)
        room = gap - target
        if not room > 0.0:
            return 0.0
        linear = ratio(room, float(path.rate[cell, link]))
        if linear >= rest:
            return rest
        curvature, bend = float(path.curvature[cell, link]), float(path.bend[cell, link])
        # the longest h whose stray takes half of the room
        h = ratio(room, bend + float(np.sqrt(bend * bend + 0.25 * curvature * room)))
        h = min(rest, max(h, linear))
        ahead = _gap(vertices, path.poses(s + h)[link], n, low)
        room -= 0.125 * curvature * h * h + bend * h
        if room <= 0.0:
            return linear
        if ahead >= gap - room:
            return h
        return max(linear, h * room / (gap - ahead))

    def _direction(
        self, row: int, pose: FloatArray, *, swapped: bool
    ) -> tuple[FloatArray | None, float, FloatArray]:
        """A direction, the zone's support in it, and the link piece's vertices (3, v)."""
        self._budget.spend()
        piece, obstacle = int(self._piece[row]), int(self._obstacle[row])
        vertices = self._problem.vertices[piece]
        n = self._oracle.direction(piece, obstacle, pose, swapped=swapped)
        if n is None:
            return None, -np.inf, vertices
        return n, lower_support(self._problem.obstacles[obstacle], n), vertices


def ratio(room: float, rate: float) -> float:
    """Room / rate, infinite where nothing moves."""
    return room / rate if rate > 0.0 else np.inf


def _gap(vertices: FloatArray, pose: FloatArray, n: FloatArray, low: float) -> float:
    support = float(((n @ pose[:3, :3]) @ vertices).max())
    return low - support - float(n @ pose[:3, 3])
