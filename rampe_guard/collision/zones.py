"""Scene objects to zones: bounding trees for the sweep.

Spheres and capsules are a point or a segment with a radius, cylinders and halfspaces nodes of
their own kind: all of them exact. A closed mesh is solid; one that the scene calls open, like a
scanned terrain, is a surface with no inside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.mesh import ZONE_MOST_M
from rampe_guard.collision.shape import placed
from rampe_guard.collision.shape_cache import load_shape
from rampe_guard.core.bounding_tree import cylinder, halfspace, single
from rampe_guard.core.kinematics import apply
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from rampe_guard.core.sweep_problem import Zone
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.collision.shape_cache import ShapeCache
    from rampe_guard.collision.tree_split import Progress
    from rampe_guard.core.bounding_tree import BoundingTree
    from rampe_guard.core.types import FloatArray

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class BuiltZone:
    """A zone, and sentences on what was mended or is remarkable in its mesh."""

    zone: Zone
    notes: tuple[str, ...] = ()


def build_zone(
    item: SolidObject,
    link_names: Sequence[str],
    *,
    cache: ShapeCache | None = None,
    progress: Progress | None = None,
) -> BuiltZone:
    """The zone of a scene object.

    Args:
        item: as the scene file describes it.
        link_names: of the arm.
        cache: where shapes of meshes are kept; None for the one that the environment names.
        progress: told what is done, and which share of it.

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
    ignored = frozenset(link_names.index(name) for name in item.ignore_links)
    notes: tuple[str, ...] = ()
    if isinstance(item, Mesh):
        tree, notes = _mesh(item, cache, progress)
    else:
        tree = _tree(item)
    zone = Zone(item.name, item.margin_m, tree, ignored, placed=item.key is not None)
    return BuiltZone(zone, notes)


def _tree(item: Box | Sphere | Capsule | Cylinder | Halfspace) -> BoundingTree:
    match item:
        case Box():
            size, pose = _positive(item, item.size_m), _pose(item, item.pose)
            return single(apply(pose, CORNERS * size))
        case Sphere():
            (radius,) = _positive(item, [item.radius_m])
            return single(_finite(item, item.center_m)[None], float(radius))
        case Capsule():
            (radius,) = _positive(item, [item.radius_m])
            ends = np.stack([_finite(item, item.start_m), _finite(item, item.end_m)])
            return single(np.unique(ends, axis=0), float(radius))
        case Cylinder():
            radius, height = (float(x) for x in _positive(item, [item.radius_m, item.height_m]))
            pose = _pose(item, item.pose)
            return cylinder(pose[:3, 3], 0.5 * height * pose[:3, 2], radius)
        case Halfspace():
            return _halfspace(item)


def _halfspace(item: Halfspace) -> BoundingTree:
    normal, (offset,) = _finite(item, item.normal), _finite(item, [item.offset_m])
    norm = float(np.linalg.norm(normal))
    if not abs(norm - 1.0) < ROUNDING:  # settings has normed it
        raise GeometryError(f"object '{item.name}' has a normal of length {norm:.6g}; norm it")
    return halfspace(normal / norm, float(offset))


def _mesh(
    item: Mesh, cache: ShapeCache | None, progress: Progress | None
) -> tuple[BoundingTree, tuple[str, ...]]:
    """The tree of a mesh, and what there is to say about it."""
    (scale,) = _positive(item, [item.scale])
    pose, name = _pose(item, item.pose), f"object '{item.name}': {item.file}"
    shape = load_shape(
        item.file,
        float(scale),
        name=name,
        most_m=ZONE_MOST_M,
        cache=cache,
        progress=None if progress is None else about(progress, Path(item.file).name),
    )
    tree, notes = placed(shape.tree, pose), shape.notes
    if item.open:
        if shape.closed:
            notes = (*notes, f"{name}: is closed, yet 'open' takes its inside for free space")
        return replace(tree, enclosing=np.zeros_like(tree.enclosing)), notes
    if not shape.closed:
        raise GeometryError(
            f"{name}: {shape.parts - shape.closed_parts} of {shape.parts} parts"
            " are not closed (an edge is open, or a triangle is turned over), so inside"
            " and outside cannot be told apart; close the mesh, use boxes, or say 'open: true'"
            " if it is a surface without an inside, such as a scanned terrain"
        )
    return tree, notes


def about(progress: Progress, what: str) -> Progress:
    """The same, told of which mesh it is."""
    return lambda doing, share: progress(f"{doing} {what}", share)


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
    if not (
        np.isfinite(pose).all() and np.allclose(rotation @ rotation.T, np.eye(3), atol=ROUNDING)
    ):
        raise GeometryError(f"object '{item.name}' has a pose that is no rigid motion")
    return pose
