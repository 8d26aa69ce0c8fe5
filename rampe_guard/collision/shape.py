"""All that the sweep needs of a mesh, without the mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.node_shapes import ROUNDING
from rampe_guard.collision.tree_build import build_tree
from rampe_guard.core.bounding_tree import NONE, BoundingTree

if TYPE_CHECKING:
    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.collision.tree_split import Progress
    from rampe_guard.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class Shape:
    """A mesh ready to be swept.

    Attributes:
        tree: in the mesh's frame.
        triangles: of the mended mesh.
        parts: that share no vertex.
        closed_parts: how many of them have an inside.
        low, high: box (3,) [m].
        notes: sentences on what was mended.
    """

    tree: BoundingTree
    triangles: int
    parts: int
    closed_parts: int
    low: FloatArray
    high: FloatArray
    notes: tuple[str, ...]

    @property
    def closed(self) -> bool:
        """Whether all parts have an inside."""
        return self.closed_parts == self.parts

    @property
    def extent_m(self) -> float:
        """Longest side of the box."""
        return float((self.high - self.low).max())


def shape_of(mesh: TriangleMesh, progress: Progress | None = None) -> Shape:
    """The shape of a checked mesh, built now."""
    parts = mesh.parts()
    return Shape(
        tree=build_tree(mesh, parts=parts, progress=progress),
        triangles=len(mesh.faces),
        parts=len(parts),
        closed_parts=int(parts.closed.sum()),
        low=mesh.vertices.min(axis=0),
        high=mesh.vertices.max(axis=0),
        notes=mesh.notes,
    )


def placed(tree: BoundingTree, pose: FloatArray) -> BoundingTree:
    """The tree moved by a rigid motion, a 4x4 homogeneous matrix."""
    if np.array_equal(pose, np.eye(4)):
        return tree
    rotation, shift = pose[:3, :3], pose[:3, 3]
    moved = [x @ rotation.T + shift for x in (tree.vertices, tree.ball[:, :3], tree.inner)]
    corners = tree.corners.reshape(-1, 3) @ rotation.T + shift
    largest = max(float(np.abs(x).max(initial=0.0)) for x in (*moved, corners))
    # what rounding may have put outside; a convex solid that was moved is that solid
    pad = ROUNDING * largest
    exact = (tree.left == NONE) & (tree.triangle_count == 0)
    return replace(
        tree,
        vertices=moved[0],
        radius=np.where(exact, tree.radius, tree.radius + pad),
        ball=np.column_stack([moved[1], tree.ball[:, 3] + 2.0 * pad]),
        corners=corners.reshape(-1, 3, 3),
        inner=moved[2],
    )
