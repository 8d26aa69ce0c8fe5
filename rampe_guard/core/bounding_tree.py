"""A surface or solid as a tree of convex shapes, each of which contains all that is below it.

Node i is the set of all points within ``radius[i]`` of the hull of
``vertices[first[i] : first[i] + count[i]]``. It contains its children; a leaf with triangles
contains those triangles; a leaf without is exact: it *is* that part of the solid. Two kinds of
exact nodes are no hulls: see HALFSPACE and CYLINDER. So whatever is
farther than d from a node is farther than d from the part of the surface under it, and following
the nearest nodes down to the triangles ends in the exact distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

Int32Array: TypeAlias = npt.NDArray[np.int32]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

NONE = -1
"""In ``left``, ``right``: no such child."""
HALFSPACE = 0
"""``count`` of a halfspace: vertices are its outward normal, then (offset, -, -)."""
CYLINDER = -1
"""``count`` of a cylinder: vertices are its center, half its axis, and two radii across it."""


@dataclass(frozen=True, slots=True)
class BoundingTree:
    """Flat arrays, node 0 the root, parents before their children.

    Attributes:
        vertices: of all nodes' shapes (V, 3) [m].
        first, count: each node's vertices (N,).
        radius: how far each shape reaches beyond the hull of its vertices (N,) [m].
        left, right: children (N,), NONE for leaves; both or neither.
        ball: center and radius of a ball round each shape, its ``radius`` included (N, 4) [m].
        size: about how far each shape may reach beyond what it holds (N,) [m], 0 for an exact
            one. Only the order of the search rests on it, never a proof.
        triangle_first, triangle_count: triangles of each *leaf* (N,); count 0 elsewhere, and for
            a leaf that is exact itself.
        corners: corners of all triangles, leaf by leaf (T, 3, 3) [m].
        enclosing: triangles of closed parts, which have an inside (T,).
        inner: a point on each connected part (P, 3) [m].
    """

    vertices: FloatArray
    first: Int32Array
    count: Int32Array
    radius: FloatArray
    left: Int32Array
    right: Int32Array
    ball: FloatArray
    size: FloatArray
    triangle_first: Int32Array
    triangle_count: Int32Array
    corners: FloatArray
    enclosing: BoolArray
    inner: FloatArray

    @property
    def nodes(self) -> int:
        """N."""
        return len(self.first)


def single(vertices: FloatArray, radius: float = 0.0) -> BoundingTree:
    """The tree of one convex solid: the hull of ``vertices`` (v, 3) [m] grown by ``radius``."""
    vertices = np.ascontiguousarray(vertices, dtype=float)
    center = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    reach = float(np.linalg.norm(vertices - center, axis=1).max()) + radius
    one = np.zeros(1, dtype=np.int32)
    return BoundingTree(
        vertices=vertices,
        first=one,
        count=np.array([len(vertices)], dtype=np.int32),
        radius=np.array([radius]),
        left=one + NONE,
        right=one + NONE,
        ball=np.array([[*center, reach]]),
        size=np.zeros(1),
        triangle_first=one,
        triangle_count=one,
        corners=np.zeros((0, 3, 3)),
        enclosing=np.zeros(0, dtype=bool),
        inner=vertices[:1].copy(),
    )


def cylinder(center: FloatArray, half_axis: FloatArray, radius: float) -> BoundingTree:
    """The tree of one cylinder: center (3,), half its axis (3,), radius [m]."""
    reach = float(np.hypot(np.linalg.norm(half_axis), radius)) * (1.0 + 1e-9)
    _, _, axes = np.linalg.svd(np.asarray(half_axis, dtype=float)[None], full_matrices=True)
    vertices = np.array([center, half_axis, radius * axes[1], radius * axes[2]], dtype=float)
    return _special(vertices, CYLINDER, np.array([[*center, reach]]), vertices[:1])


def halfspace(normal: FloatArray, offset: float) -> BoundingTree:
    """The tree of all x with normal·x <= offset [m]; no ball holds it."""
    vertices = np.array([normal, [offset, 0.0, 0.0]], dtype=float)
    return _special(vertices, HALFSPACE, np.array([[0.0, 0.0, 0.0, np.inf]]), vertices[:0])


def _special(vertices: FloatArray, kind: int, ball: FloatArray, inner: FloatArray) -> BoundingTree:
    plain = single(np.zeros((1, 3)))
    count = np.array([kind], dtype=np.int32)
    return replace(plain, vertices=vertices, count=count, ball=ball, inner=inner.copy())
