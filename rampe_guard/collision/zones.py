"""Scene objects to zones: convex pieces for the core, exact solids for FCL.

Spheres and capsules are a point or a segment with a radius: their distance is that of the core
less the radius. Cylinders become prisms that contain them. A closed mesh is solid; an open one,
like a terrain, is a surface with no inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import fcl
import numpy as np

from rampe_guard.collision.mesh import TriangleMesh, checked_mesh, load_mesh, prism_mesh
from rampe_guard.collision.pieces import cut, fcl_bvh, fcl_convex, piece_tree, speck
from rampe_guard.core.convex import ConvexPiece, HalfspacePiece
from rampe_guard.core.kinematics import apply
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from rampe_guard.core.sweep_problem import PieceTree, Zone
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.types import FloatArray

PRISM_EXCESS_M = 1e-4
"""How far the prism round a cylinder may bulge [m]; it is part of a contact's tolerance."""
MAX_PRISM_SIDES = 720
MESH_LEAVES = 512
MESH_EXCESS_M = 0.002
MESH_PIECES = 16


@dataclass(frozen=True, slots=True)
class Solid:
    """The exact shape of a zone: ``body`` (placed in the world) grown by ``radius`` [m].

    Attributes:
        body: FCL object; None for a halfspace, which needs none.
        radius: [m].
        inner: a point in each connected part of it (k, 3) [m].
        closed: parts whose inside counts as the zone though FCL sees only their surface.
    """

    body: fcl.CollisionObject | None
    radius: float
    inner: FloatArray
    closed: tuple[TriangleMesh, ...] = ()


Built: TypeAlias = tuple[tuple[PieceTree, ...], Solid]


def build_zone(item: SolidObject, link_names: Sequence[str]) -> tuple[Zone, Solid]:
    """A zone and its exact solid.

    Raises:
        GeometryError: naming the object and what is wrong with it.
    """
    unknown = [name for name in item.ignore_links if name not in link_names]
    if unknown:
        raise GeometryError(
            f"object '{item.name}' ignores link '{unknown[0]}'; the arm has {', '.join(link_names)}"
        )
    if not (np.isfinite(item.margin_m) and item.margin_m >= 0.0):
        raise GeometryError(f"object '{item.name}' has margin_m {item.margin_m}; use 0 or more")
    pieces, solid = _build(item)
    ignored = frozenset(link_names.index(name) for name in item.ignore_links)
    return Zone(item.name, item.margin_m, pieces, ignored, hollow=bool(solid.closed)), solid


def _build(item: SolidObject) -> Built:
    match item:
        case Box():
            return _box(item)
        case Sphere():
            return _round(item, item.center_m, item.center_m, item.radius_m)
        case Capsule():
            return _round(item, item.start_m, item.end_m, item.radius_m)
        case Cylinder():
            return _cylinder(item)
        case Halfspace():
            return _halfspace(item)
        case Mesh():
            return _mesh(item)


def _box(item: Box) -> Built:
    size, pose = _positive(item, item.size_m), _pose(item, item.pose)
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    center, rotation = pose[:3, 3], pose[:3, :3]
    piece = ConvexPiece(apply(pose, corners * size), center, rotation, 0.5 * size)
    body = fcl.CollisionObject(fcl.Box(*size), fcl.Transform(rotation, center))
    return (PieceTree(piece),), Solid(body, 0.0, center[None])


def _round(item: Sphere | Capsule, start: Sequence[float], end: Sequence[float], r: float) -> Built:
    (radius,) = _positive(item, [r])
    a, b = _finite(item, start), _finite(item, end)
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    _, _, basis = np.linalg.svd(along[None])
    half = np.array([0.5 * length, 0.0, 0.0])
    core = np.stack([a, b]) if length > 0.0 else a[None]
    piece = ConvexPiece(core, 0.5 * (a + b), basis.T, half, radius=float(radius))
    body = fcl.CollisionObject(fcl_bvh(speck(a, b if length > 0.0 else None)))
    return (PieceTree(piece),), Solid(body, float(radius), a[None])


def _cylinder(item: Cylinder) -> Built:
    radius, height = (float(x) for x in _positive(item, [item.radius_m, item.height_m]))
    pose = _pose(item, item.pose)
    sides = int(np.ceil(np.pi * np.sqrt(radius / (2.0 * PRISM_EXCESS_M))))
    prism = prism_mesh(radius, height, int(np.clip(sides, 24, MAX_PRISM_SIDES)))
    wide = float(np.abs(prism.vertices[:, 0]).max())
    half = np.array([wide, wide, 0.5 * height])
    vertices = apply(pose, prism.vertices)
    piece = ConvexPiece(vertices, pose[:3, 3], pose[:3, :3], half)
    return (PieceTree(piece),), Solid(
        fcl.CollisionObject(fcl_convex(vertices)), 0.0, pose[None, :3, 3]
    )


def _halfspace(item: Halfspace) -> Built:
    normal, (offset,) = _finite(item, item.normal), _finite(item, [item.offset_m])
    norm = float(np.linalg.norm(normal))
    if not abs(norm - 1.0) < 1e-6:  # noqa: PLR2004  # settings has normed it
        raise GeometryError(f"object '{item.name}' has a normal of length {norm:.6g}; norm it")
    piece = HalfspacePiece(normal / norm, float(offset))
    return (PieceTree(piece),), Solid(None, 0.0, np.zeros((0, 3)))


def _mesh(item: Mesh) -> Built:
    (scale,) = _positive(item, [item.scale])
    placed = load_mesh(item.file).moved(_pose(item, item.pose), float(scale))
    mesh = checked_mesh(placed.vertices, placed.faces, f"object '{item.name}': {item.file}")
    tree = piece_tree(mesh, MESH_EXCESS_M, MESH_LEAVES, measured=False)
    pieces = tuple(cut(tree, MESH_PIECES))
    parts = mesh.components()
    inner = np.array([part.vertices[0] for part in parts])
    closed = tuple(part for part in parts if part.is_closed())
    if len(closed) < len(parts):
        raise GeometryError(
            f"object '{item.name}': {item.file}: {len(parts) - len(closed)} of {len(parts)} parts"
            " are not closed (an edge is open, or a triangle is turned over), so inside"
            " and outside cannot be told apart; close the mesh, or use boxes"
        )
    return pieces, Solid(fcl.CollisionObject(fcl_bvh(mesh)), 0.0, inner, closed)


def _finite(item: SolidObject, values: Sequence[float]) -> FloatArray:
    array = np.asarray(values, dtype=float)
    if not np.isfinite(array).all():
        raise GeometryError(f"object '{item.name}' has {array.tolist()}: not finite")
    return array


def _positive(item: SolidObject, values: Sequence[float]) -> FloatArray:
    array = _finite(item, values)
    if not (array > 0.0).all():
        raise GeometryError(f"object '{item.name}' has a size of {array.tolist()}; use more than 0")
    return array


def _pose(item: SolidObject, pose: FloatArray) -> FloatArray:
    pose = np.asarray(pose, dtype=float)
    rotation = pose[:3, :3]
    if not (np.isfinite(pose).all() and np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)):
        raise GeometryError(f"object '{item.name}' has a pose that is no rigid motion")
    return pose
