"""What a sweep is asked about: pieces of links, pieces of zones, and who may touch whom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rampe_guard.core.convex import CoarseBounds, ConvexPiece, IntArray, ObstaclePiece

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rampe_guard.core.scene import ActuatorLimit
    from rampe_guard.core.sweep_path import ArmMotion
    from rampe_guard.core.types import FloatArray, Point


@dataclass(frozen=True, slots=True)
class Nearest:
    """A distance that may be trusted [m], 0 in contact, and the nearest point of the zone."""

    distance_m: float
    point_m: Point


class ClearanceOracle(Protocol):
    """Geometry that the pure core cannot hold."""

    def direction(
        self, body: int, obstacle: int, pose: FloatArray, *, swapped: bool
    ) -> FloatArray | None:
        """A guess of the unit direction from a body at its link's ``pose`` to an obstacle piece.

        It may be wrong: the sweep proves what it gives. None when they seem to overlap.
        ``swapped`` asks the solver the other way round.
        """
        ...

    def distance(self, link: int, zone: int, pose: FloatArray) -> Nearest:
        """Distance of the exact surfaces [m]: never more than the truth."""
        ...

    def contained(self, link: int, zone: int, pose: FloatArray) -> Point | None:
        """A point of one that lies inside the other while their surfaces are apart."""
        ...

    def boxed(self, zone: int, poses: FloatArray) -> frozenset[int]:
        """Links that `contained` could say yes to at the poses (L, 4, 4): all others it denies."""
        ...


@dataclass(frozen=True, slots=True)
class PieceTree:
    """A convex shape that contains a part of a surface, and smaller ones that do so together."""

    piece: ObstaclePiece
    halves: tuple[PieceTree, ...] = ()


@dataclass(frozen=True, slots=True)
class Zone:
    """A solid keep-out object.

    Attributes:
        name: of the object.
        margin_m: keep-out distance [m].
        pieces: trees of convex pieces (or one halfspace) that together contain it.
        ignored: indices of links that may touch it.
        hollow: its inside counts, but its pieces hold no more than its surface.
    """

    name: str
    margin_m: float
    pieces: tuple[PieceTree, ...]
    ignored: frozenset[int] = frozenset()
    hollow: bool = False


@dataclass(frozen=True, slots=True)
class RowTable:
    """The pairs of whole links and coarsest obstacle pieces of one zone that must stay apart.

    Attributes:
        body, obstacle, link: of each row (H,).
        of_obstacle: rows of all solid links (A,) against one obstacle piece.
        solid: which of the solid links those are (A,).
    """

    body: IntArray
    obstacle: IntArray
    link: IntArray
    of_obstacle: Mapping[int, IntArray]
    solid: IntArray


class SweepProblem:
    """An arm and its zones in the flat form the search works on.

    Bodies are numbered with the hulls of whole links first, obstacles with all zones' coarsest
    pieces first; what they are cut into follows.

    Attributes:
        solid_links: indices of links with geometry; body i is the hull of solid link i.
        bodies, obstacles: all convex shapes.
        body_halves, obstacle_halves: what each is cut into, by number.
        body_link: link of each body.
        vertices: of each body (3, v) [m].
        hull_vertices: of all hulls (S, 3, V) [m], filled up with repetitions.
        coarse: bounds between all hulls and coarsest obstacle pieces; None without either.
        rows: one table per zone.
    """

    def __init__(
        self,
        arm: ArmMotion,
        link_names: Sequence[str],
        links: Sequence[PieceTree | None],
        zones: Sequence[Zone | ActuatorLimit],
    ) -> None:
        """``links``: one entry per link, None without geometry."""
        self.arm = arm
        self.link_names = tuple(link_names)
        self.zones = tuple(zones)
        solid = [(link, tree) for link, tree in enumerate(links) if tree is not None]
        self.solid_links = np.array([link for link, _ in solid], dtype=np.intp)
        bodies, self.body_halves, roots = _flat([tree for _, tree in solid])
        self.bodies = [body for body in bodies if isinstance(body, ConvexPiece)]
        self.body_link = [solid[root][0] for root in roots]
        self.vertices = [np.ascontiguousarray(body.vertices.T) for body in self.bodies]
        hulls = self.vertices[: len(solid)]
        most = max((block.shape[1] for block in hulls), default=1)
        self.hull_vertices = np.array(
            [np.pad(block, ((0, 0), (0, most - block.shape[1])), mode="edge") for block in hulls]
        ).reshape(len(solid), 3, most)
        trees = [tree for zone in zones if isinstance(zone, Zone) for tree in zone.pieces]
        self.obstacles, self.obstacle_halves, _ = _flat(trees)
        self.coarse = (
            CoarseBounds(self.bodies[: len(solid)], self.solid_links, self.obstacles[: len(trees)])
            if solid and trees
            else None
        )
        self.rows = self._row_tables()

    def _row_tables(self) -> list[RowTable]:
        tables = []
        first = 0
        for zone in self.zones:
            count = len(zone.pieces) if isinstance(zone, Zone) else 0
            ignored = zone.ignored if isinstance(zone, Zone) else frozenset()
            allowed = [i for i, link in enumerate(self.solid_links) if int(link) not in ignored]
            solid = np.array(allowed, dtype=np.intp)
            obstacles = np.arange(first, first + count, dtype=np.intp)
            body, obstacle = np.repeat(solid, count), np.tile(obstacles, len(solid))
            of_obstacle = {int(o): np.flatnonzero(obstacle == o) for o in obstacles}
            tables.append(RowTable(body, obstacle, self.solid_links[body], of_obstacle, solid))
            first += count
        return tables


def _flat(
    trees: Sequence[PieceTree],
) -> tuple[list[ObstaclePiece], list[tuple[int, ...]], list[int]]:
    """Pieces of all trees, roots first; the numbers of each one's halves; each one's root."""
    pieces: list[ObstaclePiece] = [tree.piece for tree in trees]
    halves: list[tuple[int, ...]] = []
    roots = list(range(len(trees)))
    todo = list(trees)
    for number, tree in enumerate(todo):  # grows as it goes
        first = len(todo)
        todo += tree.halves
        pieces += [half.piece for half in tree.halves]
        roots += [roots[number]] * len(tree.halves)
        halves.append(tuple(range(first, len(todo))))
    return pieces, halves, roots
