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


@dataclass(frozen=True, slots=True)
class Zone:
    """A solid keep-out object.

    Attributes:
        name: of the object.
        margin_m: keep-out distance [m].
        pieces: convex pieces (or one halfspace) that together contain it.
        ignored: indices of links that may touch it.
    """

    name: str
    margin_m: float
    pieces: tuple[ObstaclePiece, ...]
    ignored: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class LinkBody:
    """A link as one convex hull, and as smaller pieces that together contain it too."""

    hull: ConvexPiece
    pieces: tuple[ConvexPiece, ...] = ()


@dataclass(frozen=True, slots=True)
class RowTable:
    """All (body, obstacle piece) pairs of one zone that must stay apart.

    Bodies are numbered hulls first, then pieces; so are the rows. The row of a hull can be
    replaced by the rows of its link's pieces.

    Attributes:
        body, obstacle, link: of each row (P,).
        excess: how far its shapes bulge beyond their surfaces, about (P,) [m].
        hulls: number of rows of hulls.
        of_obstacle: rows of hulls (A,) against each obstacle piece of the zone.
        solid: which of the solid links (A,) those rows belong to.
        pieces: rows that replace each hull row; empty if there are none.
    """

    body: IntArray
    obstacle: IntArray
    link: IntArray
    excess: FloatArray
    hulls: int
    of_obstacle: Mapping[int, IntArray]
    solid: IntArray
    pieces: tuple[IntArray, ...]


class SweepProblem:
    """An arm and its zones in the flat form the search works on.

    Attributes:
        solid_links: indices of links with geometry; hull i belongs to solid link i.
        bodies: all hulls, then all pieces.
        obstacles: obstacle pieces of all zones.
        hull_vertices: of all hulls (S, 3, V) [m], filled up with repetitions.
    """

    def __init__(
        self,
        arm: ArmMotion,
        link_names: Sequence[str],
        links: Sequence[LinkBody | None],
        zones: Sequence[Zone | ActuatorLimit],
    ) -> None:
        """``links``: one entry per link, None without geometry."""
        self.arm = arm
        self.link_names = tuple(link_names)
        self.zones = tuple(zones)
        self.obstacles = [p for zone in zones if isinstance(zone, Zone) for p in zone.pieces]
        solid = [(link, body) for link, body in enumerate(links) if body is not None]
        self.solid_links = np.array([link for link, _ in solid], dtype=np.intp)
        self.bodies = [body.hull for _, body in solid]
        self.body_link = [link for link, _ in solid]
        self._pieces: list[list[int]] = []
        for link, body in solid:
            first = len(self.bodies)
            self.bodies += body.pieces
            self.body_link += [link] * len(body.pieces)
            self._pieces.append(list(range(first, len(self.bodies))))
        self.vertices = [np.ascontiguousarray(body.vertices.T) for body in self.bodies]
        most = max((block.shape[1] for block in self.vertices[: len(solid)]), default=1)
        self.hull_vertices = np.array(
            [
                np.pad(block, ((0, 0), (0, most - block.shape[1])), mode="edge")
                for block in self.vertices[: len(solid)]
            ]
        ).reshape(len(solid), 3, most)
        self.coarse = (
            CoarseBounds(self.bodies[: len(solid)], self.solid_links, self.obstacles)
            if solid and self.obstacles
            else None
        )
        self.rows = self._row_tables()

    def _row_tables(self) -> list[RowTable]:
        tables = []
        first = 0
        for zone in self.zones:
            pieces = zone.pieces if isinstance(zone, Zone) else ()
            ignored = zone.ignored if isinstance(zone, Zone) else frozenset()
            tables.append(self._row_table(list(range(first, first + len(pieces))), ignored))
            first += len(pieces)
        return tables

    def _row_table(self, obstacles: list[int], ignored: frozenset[int]) -> RowTable:
        allowed = [i for i, link in enumerate(self.solid_links) if int(link) not in ignored]
        rows = [(hull, o) for hull in allowed for o in obstacles]
        hulls = len(rows)
        replaced: list[IntArray] = []
        for hull, o in rows[:hulls]:
            own = self._pieces[hull]
            replaced.append(np.arange(len(rows), len(rows) + len(own), dtype=np.intp))
            rows += [(piece, o) for piece in own]
        body = np.array([row[0] for row in rows], dtype=np.intp)
        obstacle = np.array([row[1] for row in rows], dtype=np.intp)
        excess = [self.bodies[b].excess + self.obstacles[o].excess for b, o in rows]
        return RowTable(
            body=body,
            obstacle=obstacle,
            link=np.array([self.body_link[b] for b in body], dtype=np.intp),
            excess=np.array(excess),
            hulls=hulls,
            of_obstacle={o: np.flatnonzero(obstacle[:hulls] == o) for o in obstacles},
            solid=np.array(allowed, dtype=np.intp),
            pieces=tuple(replaced),
        )
