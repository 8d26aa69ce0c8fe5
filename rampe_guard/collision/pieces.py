"""Convex pieces that together contain a mesh: hulls of a partition of its triangles."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import fcl
import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull, QhullError

from rampe_guard.collision.mesh import IntArray, TriangleMesh
from rampe_guard.core.convex import ConvexPiece, oriented_box
from rampe_guard.core.sweep_problem import PieceTree

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

SKIN_M = 1e-5
"""Flat sets of points get this thickness where a hull must have a volume [m]."""
EXCESS_SAMPLES = 40
MEASURED_SHARE = 8
"""Pieces with less than this part of the leaves are not measured: it takes milliseconds each."""
INSIDE = 0.3
"""Winding number from which a point counts as inside a mesh that may be open."""
EXCESS_TRIANGLES = 20_000
"""Above so many triangles the bulge of a hull is not measured but taken as its size."""


def piece_tree(mesh: TriangleMesh, excess_m: float, most: int, *, measured: bool) -> PieceTree:
    """Hull of a mesh, cut in halves until no hull bulges more than ``excess_m`` beyond it.

    Every triangle is whole in one half, so the halves contain what was cut, however it was.

    Args:
        mesh: link or obstacle.
        excess_m: bulge that needs no further cut [m].
        most: how many leaves there may be.
        measured: whether bulges of the larger pieces are measured by samples; all others are
            taken for the pieces' thickness.
    """
    surface = fcl.CollisionObject(fcl_bvh(mesh))

    def grow(part: TriangleMesh, leaves: int, bulge: float) -> PieceTree:
        sampled = measured and leaves * MEASURED_SHARE >= most
        piece = _piece(part, mesh, surface if sampled else None)
        piece = replace(piece, excess=min(piece.excess, bulge))
        if leaves < 2 or piece.excess <= excess_m:  # noqa: PLR2004
            return PieceTree(piece)
        # trying all axes pays off where pieces are large; below, the longest one is near enough
        order = np.argsort(piece.half)[::-1]
        halves = _halves(part, piece, order if leaves * MEASURED_SHARE >= most else order[:1])
        if halves is None:
            return PieceTree(piece)
        return PieceTree(piece, tuple(grow(half, leaves // 2, piece.excess) for half in halves))

    return grow(mesh, most, np.inf)


def cut(tree: PieceTree, most: int) -> list[PieceTree]:
    """Up to ``most`` branches that contain what the tree does."""
    branches = [tree]
    while True:
        sizes = [branch.piece.excess if branch.halves else -1.0 for branch in branches]
        worst = int(np.argmax(sizes))
        halves = branches[worst].halves
        if not halves or len(branches) + len(halves) - 1 > most:
            return branches
        branches[worst : worst + 1] = halves


def hull(points: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices and outward triangles of a hull with volume that contains the points."""
    try:
        found = ConvexHull(points)
    except QhullError:
        skin = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * SKIN_M
        points = (points[:, None, :] + skin).reshape(-1, 3)
        found = ConvexHull(points)
    index = np.full(len(points), -1)
    index[found.vertices] = np.arange(len(found.vertices))
    faces = index[found.simplices]
    vertices = points[found.vertices]
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces.astype(np.int64)


def fcl_convex(points: FloatArray) -> fcl.Convex:
    """FCL's hull of some points; for proposals of directions only, see core/convex."""
    vertices, faces = hull(points)
    flat = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    return fcl.Convex(vertices, len(faces), flat)


def fcl_bvh(mesh: TriangleMesh) -> fcl.BVHModel:
    """FCL's exact mesh. `TriangleMesh` is checked, so it is never empty or NaN here."""
    model = fcl.BVHModel()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    return model


def speck(point: FloatArray, other: FloatArray | None = None) -> TriangleMesh:
    """A triangle SKIN_M wide that contains a point, or the segment between two."""
    other = point if other is None else other
    way = other - point
    side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    norm = float(np.linalg.norm(side))
    side = side / norm if norm > 0.0 else np.array([0.0, 1.0, 0.0])
    if norm == 0.0:
        other = point + SKIN_M * np.array([1.0, 0.0, 0.0])
    corners = np.stack([point, other, point + SKIN_M * side])
    return TriangleMesh(corners, np.array([[0, 1, 2]], dtype=np.int64))


def _piece(
    part: TriangleMesh, whole: TriangleMesh, surface: fcl.CollisionObject | None
) -> ConvexPiece:
    used = part.vertices[np.unique(part.faces)]
    try:
        vertices = used[ConvexHull(used).vertices]
    except QhullError:
        vertices = used
    center, rotation, half = oriented_box(vertices)
    if len(part.faces) == 1:
        excess = 0.0
    elif surface is None:
        excess = 2.0 * float(half.min())
    elif len(whole.faces) > EXCESS_TRIANGLES:
        excess = 2.0 * float(np.linalg.norm(half))
    else:
        excess = _excess(vertices, whole, surface)
    return ConvexPiece(vertices, center, rotation, half, excess=excess)


def _excess(vertices: FloatArray, whole: TriangleMesh, surface: fcl.CollisionObject) -> float:
    """About how far the hull reaches beyond the whole mesh [m], from samples of its surface.

    Samples inside the mesh do not count: nothing comes near to them from outside.
    """
    corners, faces = hull(vertices)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    face = rng.choice(len(faces), size=EXCESS_SAMPLES, p=area / area.sum())
    u, v = rng.random((2, EXCESS_SAMPLES, 1))
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u), np.where(fold, 1.0 - v, v)
    samples = a[face] + u * (b[face] - a[face]) + v * (c[face] - a[face])
    centers = (a + b + c) / 3.0
    largest = np.argsort(area)[::-1][: EXCESS_SAMPLES // 2]
    samples = np.concatenate([samples, centers[largest]])
    point = fcl.CollisionObject(fcl_bvh(speck(np.zeros(3))))
    distance = np.empty(len(samples))
    for i, sample in enumerate(samples):
        point.setTransform(fcl.Transform(np.eye(3), sample))
        distance[i] = fcl.distance(surface, point, fcl.DistanceRequest())
    for i in np.argsort(distance)[::-1]:
        if distance[i] <= SKIN_M or abs(whole.winding(samples[i][None])[0]) < INSIDE:
            return float(max(distance[i], 0.0))
    return 0.0


def _halves(
    mesh: TriangleMesh, piece: ConvexPiece, axes: npt.NDArray[np.intp]
) -> list[TriangleMesh] | None:
    """Cut across that of some edges of the piece's box that leaves the least hull volume."""
    best: tuple[float, list[TriangleMesh]] | None = None
    for axis in axes:
        along = mesh.vertices[mesh.faces].mean(axis=1) @ piece.rotation[:, axis]
        low = along <= 0.5 * (along.min() + along.max())
        if low.all() or not low.any():
            continue
        halves = [TriangleMesh(mesh.vertices, mesh.faces[side]) for side in (low, ~low)]
        if len(axes) == 1:
            return halves
        volume = sum(_volume(half.vertices[np.unique(half.faces)]) for half in halves)
        if best is None or volume < best[0]:
            best = volume, halves
    return best[1] if best else None


def _volume(points: FloatArray) -> float:
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0
