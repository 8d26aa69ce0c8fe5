"""What a sweep is asked about: pieces of links, pieces of zones, and who may touch whom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from rampe_guard.core.convex import CoarseBounds, ConvexPiece, ObstaclePiece

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.scene import ActuatorLimit
    from rampe_guard.core.sweep_path import ArmMotion
    from rampe_guard.core.types import FloatArray, Point

IntArray: TypeAlias = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Nearest:
    """A distance that may be trusted [m], 0 in contact, and the nearest point of the zone."""

    distance_m: float
    point_m: Point


class ClearanceOracle(Protocol):
    """Geometry that the pure core cannot hold."""

    def direction(
        self, piece: int, obstacle: int, pose: FloatArray, *, swapped: bool
    ) -> FloatArray | None:
        """A guess of the unit direction from a link piece at ``pose`` to an obstacle piece.

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


class SweepProblem:
    """An arm and its zones in the flat form the search works on.

    Link pieces and obstacle pieces are numbered through, in order of links and zones.
    """

    def __init__(
        self,
        arm: ArmMotion,
        link_names: Sequence[str],
        links: Sequence[Sequence[ConvexPiece]],
        zones: Sequence[Zone | ActuatorLimit],
    ) -> None:
        self.arm = arm
        self.link_names = tuple(link_names)
        self.zones = tuple(zones)
        solid = [zone for zone in zones if isinstance(zone, Zone)]
        pieces = [piece for own in links for piece in own]
        self.obstacles = [piece for zone in solid for piece in zone.pieces]
        self.piece_link = np.array(
            [link for link, own in enumerate(links) for _ in own], dtype=np.intp
        )
        self.vertices = [np.ascontiguousarray(piece.vertices.T) for piece in pieces]
        self.piece_excess = np.array([piece.excess for piece in pieces])
        self.obstacle_excess = np.array([piece.excess for piece in self.obstacles])
        self.coarse = (
            CoarseBounds([list(own) for own in links], self.obstacles)
            if pieces and self.obstacles
            else None
        )
        self.rows = _rows(self.piece_link, self.zones)


def _rows(
    piece_link: IntArray, zones: Sequence[Zone | ActuatorLimit]
) -> list[tuple[IntArray, IntArray]]:
    """Per zone: all (link piece, obstacle piece) pairs that must stay apart."""
    rows: list[tuple[IntArray, IntArray]] = []
    first = 0
    for zone in zones:
        count = len(zone.pieces) if isinstance(zone, Zone) else 0
        ignored = zone.ignored if isinstance(zone, Zone) else frozenset()
        allowed = np.array([p for p, link in enumerate(piece_link) if link not in ignored], np.intp)
        obstacles = np.arange(first, first + count, dtype=np.intp)
        rows.append((np.repeat(allowed, count), np.tile(obstacles, len(allowed))))
        first += count
    return rows
