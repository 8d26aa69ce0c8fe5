"""Proven distance bounds of one path against one zone, and the queries that sharpen them.

Rows are pairs of convex shapes (of a link, of the zone), columns the cells of the path. Each
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
from rampe_guard.core.sweep_problem import Nearest, Zone

if TYPE_CHECKING:
    from rampe_guard.core.convex import IntArray
    from rampe_guard.core.sweep_path import SweptPath
    from rampe_guard.core.sweep_problem import ClearanceOracle, SweepProblem
    from rampe_guard.core.types import FloatArray, Point


SPARE_ROWS = 256
"""Rows that a zone may gain; when they are used up, exact distances must do."""


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

    At first a row is a whole link against one of the zone's coarsest pieces. `replace` puts rows
    of the halves of one of them in its place; rows that are not in use have infinite bounds.

    Attributes:
        bound: proven distance per row and cell (P, K) [m].
        doubt: the same, but infinite where the cell has been cleared by walking through it.
        start: proven distance per row at the start of the path (P,) [m].
        probe: per row the gap at the start and after the small first step (P, 2) [m], or NaN.
        tried: samples of each row that have been queried (P, K + 1).
        link: link of each row (P,).
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
        """``coarse``: bounds of the first rows per cell (H, K), and at the start (H,) [m]."""
        self.path = path
        self._problem, self._zone, self._oracle, self._budget = problem, zone, oracle, budget
        solid = problem.zones[zone]
        self._hollow = isinstance(solid, Zone) and solid.hollow
        self._table = table = problem.rows[zone]
        first = self._size = self._first = len(table.body)
        count = first + SPARE_ROWS
        self._body = np.zeros(count, dtype=np.intp)
        self._obstacle, self.link = self._body.copy(), self._body.copy()
        self._body[:first], self._obstacle[:first] = table.body, table.obstacle
        self.link[:first] = table.link
        self.bound = np.full((count, path.cells), np.inf)
        self.start = np.full(count, np.inf)
        np.maximum(coarse[0], 0.0, out=self.bound[:first])
        np.maximum(coarse[1], 0.0, out=self.start[:first])
        self.doubt = self.bound.copy()
        self.tried = np.zeros((count, path.cells + 1), dtype=bool)
        self.probe = np.full((count, 2), np.nan)
        self._exact: dict[tuple[int, float], Nearest] = {}

    def excess(self, row: int) -> float:
        """How far the shapes of a row bulge beyond their surfaces, about [m]."""
        body = self._problem.bodies[self._body[row]]
        return float(body.excess + self._problem.obstacles[self._obstacle[row]].excess)

    def query(self, row: int, sample: int) -> float:
        """Sharpen bounds with a direction found at one sample; the row's gap there [m], or -inf.

        For a hull the direction is tried on all hulls of the arm: links are often on one side.
        """
        self.tried[row, sample] = True
        pose = self.path.poses(float(self.path.fractions[sample]))[self.link[row]]
        best = -np.inf
        for swapped in (False, True):
            n, low, vertices = self._direction(row, pose, swapped=swapped)
            if n is None:
                break
            if row < self._first:
                rows = self._table.of_obstacle[int(self._obstacle[row])]
                g = self._gaps_of_hulls(n, low)
                mine = int(np.searchsorted(rows, row))
            else:
                link = self.link[row]
                rotations, translations = self.path.of_link(link)
                rows = np.array([row])
                g = gaps(vertices, rotations, translations, n, low)[None]
                mine = 0
            self._raise(rows, g)
            if sample == 0 and g[mine, 0] > best:
                self.probe[row] = g[mine, 0], g[mine, -1]
            best = max(best, float(g[mine, sample]))
            if best > 0.0:
                break
        return best

    def _gaps_of_hulls(self, n: FloatArray, low: float) -> FloatArray:
        """gap(n) of all hulls that may not touch this zone (A, K + 2) [m]."""
        problem, path = self._problem, self.path
        local, along = path.project(n, problem.solid_links)
        support = (local @ problem.hull_vertices).max(axis=2)
        return np.asarray((low - support - along)[self._table.solid])

    def _raise(self, rows: IntArray, g: FloatArray) -> None:
        """Use gaps (A, K + 2) along one direction to raise the bounds of rows (A,)."""
        path, link = self.path, self.link[rows]
        a, b = g[:, :-2], g[:, 1:-1]
        cell = np.minimum(a, b) - path.stray[link]
        np.maximum(cell, 0.5 * (a + b - path.motion[link]), out=cell)
        self.bound[rows] = np.maximum(self.bound[rows], cell)
        self.doubt[rows] = np.maximum(self.doubt[rows], cell)
        self.start[rows] = np.maximum(self.start[rows], g[:, 0])

    def replace(self, row: int) -> list[int]:
        """Put rows of the halves of its more bulging shape in a row's place; [] if it has none."""
        problem = self._problem
        body, obstacle = int(self._body[row]), int(self._obstacle[row])
        halves, others = problem.body_halves[body], problem.obstacle_halves[obstacle]
        if halves and others:
            less = problem.bodies[body].excess < problem.obstacles[obstacle].excess
            halves, others = ((), others) if less else (halves, ())
        pairs = [(half, obstacle) for half in halves] + [(body, other) for other in others]
        if not pairs or self._size + len(pairs) > len(self.start):
            return []
        new = list(range(self._size, self._size + len(pairs)))
        self._size += len(pairs)
        for number, (self._body[number], self._obstacle[number]) in zip(new, pairs, strict=True):
            self.link[number] = self.link[row]
        for bounds in (self.bound, self.doubt, self.start):
            bounds[new] = bounds[row]
            bounds[row] = np.inf
        return new

    def distance(self, link: int, fraction: float) -> Nearest:
        """Exact distance of a link's surface from the zone's, remembered."""
        known = self._exact.get((link, fraction))
        if known is None:
            self._budget.spend()
            pose = self.path.poses(fraction)[link]
            known = self._exact[link, fraction] = self._oracle.distance(link, self._zone, pose)
        return known

    def contained(self) -> tuple[int, Point] | None:
        """A link that starts inside the zone or round it, and a point there.

        Pieces hold surfaces, not what they enclose, so no separation of pieces excludes this.
        Later on the way it cannot come about without surfaces that touch.
        """
        first = slice(0, self._first)
        near = self.link[first] if self._hollow else self.link[first][self.start[first] <= 0.0]
        if not near.size:
            return None
        poses = self.path.poses(0.0)
        for link in sorted(self._oracle.boxed(self._zone, poses).intersection(near.tolist())):
            self._budget.spend()
            point = self._oracle.contained(link, self._zone, poses[link])
            if point is not None:
                return link, point
        return None

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
        linear = ratio(room, float(path.rate[link, cell]))
        if linear >= rest:
            return rest
        curvature, bend = float(path.curvature[link, cell]), float(path.bend[link, cell])
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
        """A direction, the zone's support in it, and the body's vertices (3, v)."""
        self._budget.spend()
        body, obstacle = int(self._body[row]), int(self._obstacle[row])
        vertices = self._problem.vertices[body]
        n = self._oracle.direction(body, obstacle, pose, swapped=swapped)
        if n is None:
            return None, -np.inf, vertices
        return n, lower_support(self._problem.obstacles[obstacle], n), vertices


def ratio(room: float, rate: float) -> float:
    """Room / rate, infinite where nothing moves."""
    return room / rate if rate > 0.0 else np.inf


def _gap(vertices: FloatArray, pose: FloatArray, n: FloatArray, low: float) -> float:
    support = float(((n @ pose[:3, :3]) @ vertices).max())
    return low - support - float(n @ pose[:3, 3])
