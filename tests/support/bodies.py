"""Exact shapes for the oracle: triangles of links and obstacles as FCL bodies, by themselves.

Links are always surfaces of triangles (a round link primitive is cut into triangles from
within, with an arrow of at most ARROW_M). Obstacles are solid where FCL has an exact and safe
pair for them; spheres and capsules are a point or segment with a radius, which FCL measures to
1e-15 m against triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fcl
import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

if TYPE_CHECKING:
    import numpy.typing as npt

    from rampe_guard.core.types import FloatArray

ARROW_M = 2e-5
"""How far a polyhedron inscribed in something round may stay inside it [m]."""
GROUP = 24
"""Balls that cover a link."""


@dataclass(frozen=True, slots=True)
class Surface:
    """Triangles: vertices (v, 3) [m], faces (f, 3)."""

    vertices: FloatArray
    faces: npt.NDArray[np.int64]

    def moved(self, pose: FloatArray) -> Surface:
        return Surface(self.vertices @ pose[:3, :3].T + pose[:3, 3], self.faces)

    def bvh(self) -> Any:
        model = fcl.BVHModel()
        model.beginModel(len(self.faces), len(self.vertices))
        model.addSubModel(self.vertices, self.faces)
        model.endModel()
        return model

    def parts(self) -> list[Surface]:
        """Connected parts, equal vertices taken as one."""
        vertices, same = np.unique(self.vertices, axis=0, return_inverse=True)
        faces = same.reshape(-1)[self.faces]
        count = len(vertices)
        a, b = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
        graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
        label = connected_components(graph, directed=False)[1][faces[:, 0]]
        return [Surface(vertices, faces[label == k]) for k in np.unique(label)]

    def closed(self) -> bool:
        """Whether every edge is walked once each way."""
        good = self.faces[[len(set(face)) == 3 for face in self.faces.tolist()]]
        edges = good[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        walked = set(map(tuple, edges.tolist()))
        return len(walked) == len(edges) and all((b, a) in walked for a, b in walked)

    def holds(self, points: FloatArray) -> npt.NDArray[np.bool_]:
        """Which points (n, 3) are inside, by the solid angle of all triangles."""
        corners = self.vertices[self.faces]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        inside: npt.NDArray[np.bool_] = np.all((points >= low) & (points <= high), axis=1)
        for i in np.flatnonzero(inside):
            inside[i] = abs(_turns(corners - points[i])) > 0.5
        return inside


def _turns(corners: FloatArray) -> float:
    """Solid angle of triangles (f, 3, 3) seen from the origin, in full spheres."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.sqrt((side * side).sum(axis=1)) for side in (a, b, c))
    above = (a * np.cross(b, c)).sum(axis=1)
    below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la
    return float(np.arctan2(above, below + (c * a).sum(axis=1) * lb).sum()) / (2.0 * np.pi)


def read_surface(file: Path, scale: FloatArray | float = 1.0) -> Surface:
    loaded = trimesh.load_scene(str(file), process=False).to_mesh()
    vertices = np.asarray(loaded.vertices, dtype=float) * scale
    return Surface(vertices, np.asarray(loaded.faces, dtype=np.int64))


def box_surface(size: FloatArray) -> Surface:
    made = trimesh.creation.box(size)
    return Surface(np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int64))


def cylinder_surface(radius: float, height: float) -> Surface:
    """Prism inside a cylinder along z, at most ARROW_M from it."""
    sides = max(24, int(np.ceil(np.pi * np.sqrt(radius / (2.0 * ARROW_M)))))
    made = trimesh.creation.cylinder(radius, height, sections=sides)
    return Surface(np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int64))


def segment(a: FloatArray, b: FloatArray) -> Surface:
    """A segment (or, of equal ends, a point) as one flat triangle."""
    return Surface(np.stack([a, b, b]), np.array([[0, 1, 2]]))


@dataclass(frozen=True, slots=True)
class Piece:
    """Triangles of a link, in its frame; or a point at ``center``, thickened to a ball.

    ``solid`` is what `collide` is asked about, ``body`` what `distance` is.
    """

    body: Any
    solid: Any
    radius: float
    center: FloatArray

    def place(self, pose: FloatArray) -> Any:
        """The body with its link at ``pose`` (4, 4)."""
        self.body.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        return self.body

    def place_solid(self, pose: FloatArray) -> Any:
        """The solid with its link at ``pose`` (4, 4)."""
        where = pose[:3, :3] @ self.center + pose[:3, 3]
        self.solid.setTransform(fcl.Transform(pose[:3, :3], where))
        return self.solid


def _piece(surface: Surface, radius: float) -> Piece:
    body = fcl.CollisionObject(surface.bvh())
    if radius == 0.0:
        return Piece(body, body, 0.0, np.zeros(3))
    return Piece(body, fcl.CollisionObject(fcl.Sphere(radius)), radius, surface.vertices[0])


@dataclass(frozen=True, slots=True)
class LinkBody:
    """The geometry of one link, in its frame.

    Attributes:
        pieces: what is measured.
        hull: the points (h, 3) among which the farthest moving one is [m].
        reach: how far the link goes beyond ``hull`` (round parts) [m].
        middle: center (3,) of a ball of radius ``extent`` round all of it [m].
        centers: balls (g, 3) that cover all of the link [m].
        radii: theirs (g,) [m].
        closed: its closed parts, which are solid.
        inner: a point (p, 3) of each part [m].
    """

    pieces: tuple[Piece, ...]
    hull: FloatArray
    reach: float
    middle: FloatArray
    extent: float
    centers: FloatArray
    radii: FloatArray
    closed: tuple[Surface, ...]
    inner: FloatArray


def link_body(surfaces: list[tuple[Surface, float]]) -> LinkBody | None:
    """A link of parts with a thickness each (a sphere is a thick point)."""
    if not surfaces:
        return None
    thin = [surface for surface, radius in surfaces if radius == 0.0]
    merged = [(surface, radius) for surface, radius in surfaces if radius > 0.0]
    if thin:
        offsets = np.cumsum([0] + [len(s.vertices) for s in thin[:-1]])
        faces = np.concatenate([s.faces + o for s, o in zip(thin, offsets, strict=True)])
        merged.append((Surface(np.concatenate([s.vertices for s in thin]), faces), 0.0))
    parts = [part for surface, radius in merged if radius == 0.0 for part in surface.parts()]
    covers = [_cover(surface) for surface, _ in merged]
    cloud = np.concatenate([surface.vertices for surface, _ in surfaces])
    inner = [part.vertices[part.faces[0, 0]] for part in parts]
    middle = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    reach = max(radius for _, radius in surfaces)
    return LinkBody(
        pieces=tuple(_piece(surface, radius) for surface, radius in merged),
        hull=outermost(cloud),
        reach=reach,
        middle=middle,
        extent=float(np.linalg.norm(cloud - middle, axis=1).max()) + reach,
        centers=np.concatenate([centers for centers, _ in covers]),
        radii=np.concatenate([r + t for (_, r), (_, t) in zip(covers, merged, strict=True)]),
        closed=tuple(part for part in parts if part.closed()),
        inner=np.array(inner).reshape(-1, 3),
    )


def outermost(cloud: FloatArray) -> FloatArray:
    """The corners of the convex hull of points (n, 3)."""
    try:
        return np.asarray(cloud[ConvexHull(cloud).vertices])
    except (QhullError, ValueError):  # flat or a point
        return np.unique(cloud, axis=0)


def _cover(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Balls round groups of triangles, groups halved across their longest side."""
    corners = surface.vertices[surface.faces]
    groups = [np.arange(len(corners))]
    while len(groups) < GROUP:
        sizes = [np.ptp(corners[g].reshape(-1, 3), axis=0).max() for g in groups]
        at = int(np.argmax([s if len(g) > 1 else 0.0 for s, g in zip(sizes, groups, strict=True)]))
        if len(groups[at]) < 2:
            break
        group = groups.pop(at)
        middles = corners[group].mean(axis=1)
        order = group[np.argsort(middles[:, int(np.argmax(np.ptp(middles, axis=0)))])]
        groups += [order[: len(order) // 2], order[len(order) // 2 :]]
    clouds = [corners[g].reshape(-1, 3) for g in groups]
    centers = np.array([0.5 * (c.min(axis=0) + c.max(axis=0)) for c in clouds])
    radii = [np.linalg.norm(c - m, axis=1).max() for c, m in zip(clouds, centers, strict=True)]
    return centers, np.array(radii)
