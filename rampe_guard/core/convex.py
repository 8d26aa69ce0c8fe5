"""Convex pieces: what links and keep-out objects are bounded by, and proofs that two are apart.

A direction n separates A from B by gap(n) = min over B of n·x - max over A of n·x. For a unit n
this is a lower bound of their distance, whoever proposed n: it needs no trust in a solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

IntArray: TypeAlias = npt.NDArray[np.intp]
MAX_SPHERES = 8


@dataclass(frozen=True, slots=True)
class ConvexPiece:
    """All points within ``radius`` of the hull of ``vertices``.

    Attributes:
        vertices: (v, 3) [m], in the link's frame or, for an obstacle, in the world.
        center: of a box that holds the vertices (3,) [m].
        rotation: its edges as columns (3, 3).
        half: its half lengths (3,) [m].
        radius: [m].
        excess: estimate of how far the piece reaches beyond the true surface [m]. Only the
            sharpness of a clearance rests on it, never a proof.
    """

    vertices: FloatArray
    center: FloatArray
    rotation: FloatArray
    half: FloatArray
    radius: float = 0.0
    excess: float = 0.0


@dataclass(frozen=True, slots=True)
class HalfspacePiece:
    """All x with normal·x <= offset."""

    normal: FloatArray
    offset: float
    excess: float = 0.0


ObstaclePiece = ConvexPiece | HalfspacePiece
HALFSPACE_BOX_M = 1e6
"""Half size of the box that stands for a halfspace where only a coarse bound is wanted [m]."""


def oriented_box(vertices: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Center, rotation and half lengths of a box round the vertices.

    The tighter, by volume, of the axis-aligned box and the one along the principal axes.
    """
    _, _, axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=True)
    rotations = [np.eye(3), axes.T]
    boxes = []
    for rotation in rotations:
        local = vertices @ rotation
        low, high = local.min(axis=0), local.max(axis=0)
        boxes.append((rotation @ (0.5 * (low + high)), rotation, 0.5 * (high - low)))
    return min(boxes, key=lambda box: float(np.prod(box[2] + 1e-3)))


def covering_spheres(piece: ConvexPiece) -> FloatArray:
    """Spheres (m, 4) = center, radius [m] that together hold the piece, at most MAX_SPHERES.

    The piece's box is cut along its longest edge into bricks, each inside its sphere.
    """
    order = np.argsort(piece.half)[::-1]
    long, wide = piece.half[order[0]], piece.half[order[1]]
    count = int(np.clip(np.ceil(long / max(wide, 0.1 * long, 1e-9)), 1, MAX_SPHERES))
    brick = piece.half.copy()
    brick[order[0]] /= count
    steps = (2.0 * np.arange(count) + 1.0 - count) * brick[order[0]]
    centers = piece.center + steps[:, None] * piece.rotation[:, order[0]]
    radius = float(np.linalg.norm(brick)) + piece.radius
    return np.column_stack([centers, np.full(count, radius)])


def lower_support(piece: ObstaclePiece, direction: FloatArray) -> float:
    """Min over the obstacle piece of n·x for a unit direction n; -inf if it has none."""
    if isinstance(piece, HalfspacePiece):
        aligned = float(direction @ piece.normal) <= -1.0 + 1e-12
        return -piece.offset if aligned else -np.inf
    return float((piece.vertices @ direction).min()) - piece.radius


def gaps(
    vertices: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
    direction: FloatArray,
    low: float,
) -> FloatArray:
    """gap(n) of a moving piece at k poses against an obstacle with lower support ``low``.

    Args:
        vertices: of the moving piece, in its own frame, transposed (3, v) [m].
        rotations: (k, 3, 3).
        translations: (k, 3) [m].
        direction: unit n (3,), from the moving piece to the obstacle.
        low: `lower_support` of the obstacle [m].

    Returns:
        (k,) [m]; each is at most the true distance at that pose.
    """
    support = ((direction @ rotations) @ vertices).max(axis=1)
    return np.asarray(low - support - translations @ direction)


class CoarseBounds:
    """Lower bounds of the distance between every body and every obstacle piece at once.

    Bodies are held by spheres, obstacle pieces by boxes rounded by their radius.
    """

    def __init__(
        self, bodies: list[ConvexPiece], links: IntArray, obstacles: list[ObstaclePiece]
    ) -> None:
        """``links``: index of the link that carries each body."""
        spheres = [covering_spheres(body) for body in bodies]
        stacked = np.concatenate(spheres)
        self._centers, self._radii = stacked[:, :3], stacked[:, 3]
        sizes = [len(block) for block in spheres]
        self._starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)
        self._sphere_link = np.repeat(links, sizes)
        boxes = [_coarse_box(piece) for piece in obstacles]
        # all first axes, then all second, then all third: long rows are quick to run through
        axes = np.array([rotation for _, rotation, _, _ in boxes])
        self._axes = axes.transpose(1, 2, 0).reshape(3, -1)
        centers = np.array([center for center, _, _, _ in boxes])
        self._center = np.einsum("zca,zc->az", axes, centers).ravel()
        self._half = np.array([half for _, _, half, _ in boxes]).T.ravel()
        self._radius = np.array([radius for _, _, _, radius in boxes])

    def __call__(self, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        """Bounds (k, bodies, obstacle pieces) [m] at k poses of all links.

        Args:
            rotations: of all links (k, L, 3, 3).
            translations: (k, L, 3) [m].
        """
        k, link, count = rotations.shape[0], self._sphere_link, len(self._radius)
        centers = (rotations[:, link] @ self._centers[:, :, None])[..., 0] + translations[:, link]
        outside = centers.reshape(-1, 3) @ self._axes
        outside -= self._center
        np.abs(outside, out=outside)
        outside -= self._half
        np.maximum(outside, 0.0, out=outside)
        np.square(outside, out=outside)
        distance = outside[:, :count] + outside[:, count : 2 * count]
        distance += outside[:, 2 * count :]
        np.sqrt(distance, out=distance)
        distance -= self._radius
        distance = distance.reshape(k, len(link), count)
        distance -= self._radii[:, None]
        return np.asarray(np.minimum.reduceat(distance, self._starts, axis=1))


def _coarse_box(piece: ObstaclePiece) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    if isinstance(piece, ConvexPiece):
        return piece.center, piece.rotation, piece.half, piece.radius
    normal = piece.normal
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    side /= np.linalg.norm(side)
    rotation = np.column_stack([normal, side, np.cross(normal, side)])
    center = normal * (piece.offset - HALFSPACE_BOX_M)
    return center, rotation, np.full(3, HALFSPACE_BOX_M), 0.0
