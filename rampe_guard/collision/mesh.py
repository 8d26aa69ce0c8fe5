"""Triangle meshes: read, checked before FCL may see them, and asked what lies inside."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]
MAX_TRIANGLES = 2_000_000
MAX_COORDINATE_M = 1e5
ROUND_SIDES = 48
"""Sides of the prism that stands for a round link primitive."""


_LEAST_FILL = 1e-6
"""Share of its box that a closed mesh must fill to count as a solid."""


@dataclass(frozen=True, slots=True)
class TriangleMesh:
    """A checked mesh: finite vertices (v, 3) [m], faces (f, 3) with distinct corners, f >= 1."""

    vertices: FloatArray
    faces: IntArray

    def moved(self, pose: FloatArray, scale: FloatArray | float = 1.0) -> TriangleMesh:
        """The mesh scaled, then posed."""
        vertices = (self.vertices * scale) @ pose[:3, :3].T + pose[:3, 3]
        return TriangleMesh(vertices, self.faces)

    def components(self) -> list[TriangleMesh]:
        """Parts that share no vertex."""
        count = len(self.vertices)
        a, b = self.faces[:, [0, 1]].ravel(), self.faces[:, [1, 2]].ravel()
        graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
        _, label = connected_components(graph, directed=False)
        of_face = label[self.faces[:, 0]]
        return [
            TriangleMesh(self.vertices, self.faces[of_face == part]).compact()
            for part in np.unique(of_face)
        ]

    def compact(self) -> TriangleMesh:
        """The mesh without vertices that no face uses."""
        used, faces = np.unique(self.faces, return_inverse=True)
        return TriangleMesh(self.vertices[used], faces.reshape(self.faces.shape).astype(np.int64))

    def is_watertight(self) -> bool:
        """Whether every edge is walked once each way, so that inside and outside are told apart."""
        forth, back = self._walks()
        return bool((forth == back).all() and (np.diff(forth) > 0).all())

    def is_closed(self) -> bool:
        """Whether inside and outside can be told apart, touching edges allowed.

        Every edge is walked as often one way as the other, and there is a volume: a skin and
        its mirror image cancel and enclose nothing.
        """
        forth, back = self._walks()
        a, b, c = (self.vertices[self.faces] - self.vertices.mean(axis=0)).transpose(1, 0, 2)
        volume = abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6.0
        box = float(np.prod(np.ptp(self.vertices, axis=0)))
        return bool((forth == back).all()) and volume > _LEAST_FILL * box

    def _walks(self) -> tuple[IntArray, IntArray]:
        """All directed edges as numbers, and the same edges walked backwards, both sorted."""
        edges = self.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        count = len(self.vertices)
        forth = np.sort(edges[:, 0] * count + edges[:, 1])
        return forth, np.sort(edges[:, 1] * count + edges[:, 0])

    def winding(self, points: FloatArray) -> FloatArray:
        """Winding number of points (n, 3): ±1 inside a watertight mesh, 0 outside."""
        corners = self.vertices[self.faces]
        result = np.empty(len(points))
        for i, point in enumerate(points):
            a, b, c = np.moveaxis(corners - point, 1, 0)
            la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
            volume = np.einsum("fi,fi->f", a, np.cross(b, c))
            solid = la * lb * lc + np.einsum("fi,fi->f", a, b) * lc
            solid += np.einsum("fi,fi->f", b, c) * la + np.einsum("fi,fi->f", c, a) * lb
            result[i] = np.arctan2(volume, solid).sum() / (2.0 * np.pi)
        return result


def checked_mesh(vertices: FloatArray, faces: IntArray, name: str) -> TriangleMesh:
    """A mesh fit for use, its equal vertices merged and collapsed triangles dropped.

    Raises:
        GeometryError: naming ``name`` and what is wrong.
    """
    vertices = np.asarray(vertices, dtype=float).reshape(-1, 3)
    faces = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    if not len(faces):
        raise GeometryError(f"{name}: no triangles; give a mesh with a surface")
    if len(faces) > MAX_TRIANGLES:
        raise GeometryError(
            f"{name}: {len(faces)} triangles; more than {MAX_TRIANGLES} are refused, simplify it"
        )
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise GeometryError(f"{name}: a triangle names vertex {faces.max()} of {len(vertices)}")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if bad.size:
        raise GeometryError(f"{name}: vertex {bad[0]} is {vertices[bad[0]]}, not finite")
    if np.abs(vertices).max() > MAX_COORDINATE_M:
        raise GeometryError(
            f"{name}: a coordinate of {np.abs(vertices).max():.3g} m; wrong unit or scale?"
        )
    vertices, merged = np.unique(vertices, axis=0, return_inverse=True)
    faces = merged.reshape(-1)[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    if not len(faces):
        raise GeometryError(f"{name}: all triangles are collapsed; wrong scale?")
    return TriangleMesh(vertices, faces).compact()


def load_mesh(file: str | Path) -> TriangleMesh:
    """Read an STL, OBJ, DAE or other mesh file that trimesh knows.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    path = Path(file)
    if not path.is_file():
        raise GeometryError(f"{path}: no such mesh file")
    try:
        loaded = trimesh.load_scene(str(path), process=False).to_mesh()
        vertices, faces = np.asarray(loaded.vertices), np.asarray(loaded.faces)
    except Exception as error:  # readers of foreign formats raise whatever they like
        raise GeometryError(f"{path}: cannot be read as a mesh: {error}") from error
    return checked_mesh(vertices, faces, str(path))


def box_mesh(size: FloatArray) -> TriangleMesh:
    """Box of these edge lengths [m] about the origin."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    return TriangleMesh(corners * np.asarray(size), np.array(faces, dtype=np.int64))


def prism_mesh(radius: float, height: float, sides: int = ROUND_SIDES) -> TriangleMesh:
    """Prism round a cylinder along z about the origin: it contains the cylinder."""
    angle = np.arange(sides) * (2.0 * np.pi / sides)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * (radius / np.cos(np.pi / sides))
    low = np.column_stack([ring, np.full(sides, -0.5 * height)])
    high = np.column_stack([ring, np.full(sides, 0.5 * height)])
    i = np.arange(sides)
    j = (i + 1) % sides
    walls = np.concatenate(
        [np.column_stack([i, j, j + sides]), np.column_stack([i, j + sides, i + sides])]
    )
    fan = np.arange(1, sides - 1)
    bottom = np.column_stack([np.zeros_like(fan), fan + 1, fan])
    top = np.column_stack([np.full_like(fan, sides), fan + sides, fan + 1 + sides])
    return TriangleMesh(np.concatenate([low, high]), np.concatenate([walls, bottom, top]))


def ball_mesh(radius: float) -> TriangleMesh:
    """Polyhedron round a sphere about the origin: it contains the sphere."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    depth = np.abs(np.einsum("fi,fi->f", normal, a)) / np.linalg.norm(normal, axis=1)
    return TriangleMesh(vertices * (radius / float(depth.min())), faces)
