"""Triangle meshes: read, mended and checked before FCL may see them; what lies inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rampe_guard.collision.mesh_limits import MAX_TRIANGLES, refuse_too_many
from rampe_guard.collision.mesh_read import read_mesh
from rampe_guard.collision.mesh_repair import (
    first_of_equal,
    oriented,
    without_collapsed,
    without_duplicates,
    without_needles,
)
from rampe_guard.collision.mesh_topology import IntArray, Parts, edges, part_labels, parts_of
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

__all__ = [
    "MAX_COORDINATE_M",
    "MAX_TRIANGLES",
    "IntArray",
    "TriangleMesh",
    "ball_mesh",
    "box_mesh",
    "check_extent",
    "checked_mesh",
    "load_mesh",
    "open_words",
    "prism_mesh",
]

MAX_COORDINATE_M = 1e5
"""Beyond, rounding would be felt in a tenth of a millimetre of a chain of sums [m]."""
MAX_RAW_COORDINATE = 1e9
"""In a file, whose unit may be a micrometre."""
LINK_MOST_M = 200.0
"""No link is larger; what is, is in millimetres [m]."""
ZONE_MOST_M = 20_000.0
"""No terrain is larger [m]."""
LEAST_M = 1e-3
"""No link or obstacle is smaller; what is, was scaled twice [m]."""
ROUND_SIDES = 48
"""Sides of the prism that stands for a round link primitive."""


@dataclass(frozen=True, slots=True)
class TriangleMesh:
    """A checked mesh: finite vertices (v, 3) [m], faces (f, 3) with distinct corners, f >= 1.

    ``notes`` are sentences: what was mended in it.
    """

    vertices: FloatArray
    faces: IntArray
    notes: tuple[str, ...] = ()

    def moved(self, pose: FloatArray, scale: FloatArray | float = 1.0) -> TriangleMesh:
        """The mesh scaled, then posed; a mirroring scale keeps its outside outside."""
        vertices = (self.vertices * scale) @ pose[:3, :3].T + pose[:3, 3]
        mirrored = np.prod(np.broadcast_to(scale, 3)) < 0.0
        return TriangleMesh(vertices, self.faces[:, ::-1] if mirrored else self.faces, self.notes)

    def parts(self) -> Parts:
        """Parts that share no vertex, and which of them have an inside."""
        return parts_of(self.vertices, self.faces)

    def components(self) -> list[TriangleMesh]:
        """Parts that share no vertex."""
        label = part_labels(self.faces, len(self.vertices))
        return [
            TriangleMesh(self.vertices, self.faces[label == part]).compact()
            for part in range(int(label.max()) + 1)
        ]

    def compact(self) -> TriangleMesh:
        """The mesh without vertices that no face uses."""
        used, faces = np.unique(self.faces, return_inverse=True)
        faces = faces.reshape(self.faces.shape).astype(np.int64)
        return TriangleMesh(self.vertices[used], faces, self.notes)

    def is_watertight(self) -> bool:
        """Whether every edge is walked once each way, so that inside and outside are told apart."""
        key, forth = edges(self.faces, len(self.vertices))
        up, down = np.sort(key[forth]), np.sort(key[~forth])
        return bool(np.array_equal(up, down) and (np.diff(up) > 0).all())

    def is_closed(self) -> bool:
        """Whether inside and outside can be told apart, touching edges allowed.

        In every part each edge is walked as often one way as the other, and there is a volume: a
        skin and its mirror image cancel and enclose nothing.
        """
        return bool(self.parts().closed.all())

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


def checked_mesh(
    vertices: FloatArray,
    faces: IntArray,
    name: str,
    *,
    notes: Sequence[str] = (),
    most: float = MAX_COORDINATE_M,
) -> TriangleMesh:
    """A mesh fit for use: equal vertices merged, triangles mended, each repair with a word.

    Args:
        vertices: (v, 3) [m].
        faces: (f, 3).
        name: what errors and notes call it.
        notes: on repairs already made.
        most: largest coordinate allowed [m].

    Raises:
        GeometryError: naming ``name`` and what is wrong.
    """
    vertices = np.asarray(vertices, dtype=float).reshape(-1, 3)
    faces = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    if not len(faces):
        raise GeometryError(f"{name}: no triangles; give a mesh with a surface")
    refuse_too_many(len(faces), name)
    if faces.min() < 0 or faces.max() >= len(vertices):
        wrong = faces.min() if faces.min() < 0 else faces.max()
        raise GeometryError(f"{name}: a triangle names vertex {wrong} of {len(vertices)}")
    words: list[str] = []
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    if not used.all():
        words.append(f"{int((~used).sum())} vertices of no triangle left out")
    bad = np.flatnonzero(used & ~np.isfinite(vertices).all(axis=1))
    if bad.size:
        raise GeometryError(f"{name}: vertex {bad[0]} is {vertices[bad[0]]}, not finite")
    largest = float(np.abs(vertices[used]).max())
    if largest > most:
        raise GeometryError(f"{name}: a coordinate of {largest:.3g} m; wrong unit or scale?")
    vertices, faces = _merged(vertices, faces, used)
    faces, said = without_collapsed(faces)
    words += said
    if not len(faces):
        raise GeometryError(f"{name}: all triangles are collapsed; wrong scale?")
    faces, said = without_duplicates(faces, len(vertices))
    words += said
    faces, said = without_needles(vertices, faces)
    words += said
    if not len(faces):
        raise GeometryError(f"{name}: no triangle has an area; give a mesh with a surface")
    faces, said, _ = oriented(vertices, faces)
    words += said
    told = (*notes, *(f"{name}: {sentence}" for sentence in words))
    mesh = TriangleMesh(vertices, faces, tuple(dict.fromkeys(told)))
    return mesh.compact() if words else mesh


def _merged(
    vertices: FloatArray, faces: IntArray, used: npt.NDArray[np.bool_]
) -> tuple[FloatArray, IntArray]:
    """Equal vertices as one; those of no triangle gone."""
    if not used.all():
        faces = (np.cumsum(used) - 1)[faces]
        vertices = vertices[used]
    # 0.0 added: -0.0 and 0.0 are the same place
    first, kind = first_of_equal(vertices + 0.0)
    if len(first) == len(vertices):
        return vertices, faces
    return vertices[first], kind[faces]


def load_mesh(file: str | Path, scale: FloatArray | None = None) -> TriangleMesh:
    """Read an STL, OBJ, DAE or other mesh file that trimesh knows.

    Args:
        file: its coordinates count in the unit that it names, or as metres.
        scale: three factors on top of that; None if the caller will scale, so that even
            micrometres are let through.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    path = Path(file)
    raw = read_mesh(path)
    vertices, faces, notes = raw.vertices, raw.faces, [f"{path}: {note}" for note in raw.notes]
    if raw.unit_m is not None and raw.unit_m != 1.0:
        vertices = vertices * raw.unit_m
        notes.append(f"{path}: the file's unit is {raw.unit_m:g} m: taken to metres")
    most = MAX_RAW_COORDINATE
    if scale is not None:
        vertices, most = vertices * scale, MAX_COORDINATE_M
        if np.prod(np.sign(scale)) < 0.0:
            faces = faces[:, ::-1]
    return checked_mesh(vertices, faces, str(path), notes=notes, most=most)


def check_extent(extent: float, name: str, most_m: float = LINK_MOST_M) -> tuple[str, ...]:
    """See that something in metres has a size that a link or an obstacle can have.

    Args:
        extent: its longest side [m].
        name: what errors and notes call it.
        most_m: longest side that can be (LINK_MOST_M, ZONE_MOST_M); from a tenth of it on there
            is a word [m].

    Returns:
        Sentences, none if nothing is remarkable.

    Raises:
        GeometryError: naming ``name``, the extent, and the scale that is likely right.
    """
    if extent < LEAST_M:
        raise GeometryError(
            f"{name}: is {extent * 1e3:.3g} mm in all; likely it was scaled twice: leave out its"
            " scale of 0.001, or give the scale that makes it metres"
        )
    if extent > most_m:
        raise GeometryError(
            f"{name}: is {extent:.4g} m long, more than {most_m:g} m; likely its unit is the"
            " millimetre: give it a scale of 0.001"
        )
    if extent > 0.1 * most_m:
        return (f"{name}: is {extent:.4g} m long; if that is in millimetres, scale it by 0.001",)
    return ()


def open_words(mesh: TriangleMesh, name: str) -> tuple[str, ...]:
    """A sentence on parts that are not closed, none if all are."""
    parts = mesh.parts()
    missing = len(parts) - int(parts.closed.sum())
    if not missing:
        return ()
    which = "it" if len(parts) == 1 else f"{missing} of {len(parts)} parts"
    verb = "is" if missing == 1 else "are"
    return (f"{name}: {which} {verb} not closed: a surface without an inside",)


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
    import trimesh  # noqa: PLC0415  # half a second, and balls are rare

    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    depth = np.abs(np.einsum("fi,fi->f", normal, a)) / np.linalg.norm(normal, axis=1)
    return TriangleMesh(vertices * (radius / float(depth.min())), faces)
