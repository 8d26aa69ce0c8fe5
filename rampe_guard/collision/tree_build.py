"""A mesh as a tree of convex shapes: cut top-down, wrapped bottom-up.

Convex closed parts become one exact node each. All other triangles are divided in two and two
again until a leaf holds at most `tree_split.LEAF` of them. Few vertices are a shape as they are;
more are wrapped in their hull, thinned out if it has too many; and where there are too many
nodes for a hull each, in an oriented box. Every shape contains the triangles and exact parts
below it; a box need not lie within the hull above it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from rampe_guard.collision.convex_parts import convex_parts
from rampe_guard.collision.mesh_topology import BoolArray, IntArray, Parts, parts_of
from rampe_guard.collision.node_shapes import FEW, MOST, boxes, hull_points, principal_axes, thinned
from rampe_guard.collision.tree_split import Division, Progress, divide, spans
from rampe_guard.core.bounding_tree import BoundingTree

if TYPE_CHECKING:
    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.core.types import FloatArray

VERSION = 1
"""Of the trees built here: another one makes kept trees worthless."""
HULLS = 512
"""Most nodes that are wrapped in a hull; those of fewest triangles get a box."""
PASSED_ON = 200
"""A hull of more vertices is passed to the node above thinned out."""
TRIED_ITEMS = 400
"""So many of a node's triangles tell how large the hulls of its halves would be."""
POINTS_AT_ONCE = 200_000
"""Bounds the memory of what is measured for many nodes at once."""


@dataclass(frozen=True, slots=True)
class _Atoms:
    """What the leaves hold, in the order of the leaves.

    Attributes:
        ids: vertices of all atoms, one atom after the other (k,).
        begin: where each atom's vertices begin in ``ids`` (n + 1,).
        triangle: its triangle (n,), or -1 for an exact part.
    """

    ids: IntArray
    begin: IntArray
    triangle: IntArray

    def ordered(self, order: IntArray) -> _Atoms:
        rows, starts = spans(self.begin[order], self.begin[order + 1])
        return _Atoms(self.ids[rows], np.append(starts, len(rows)), self.triangle[order])


def build_tree(
    mesh: TriangleMesh, *, parts: Parts | None = None, progress: Progress | None = None
) -> BoundingTree:
    """The tree of a checked mesh.

    Args:
        mesh: link or obstacle, in the frame that the tree shall be in.
        parts: of the mesh, if known already.
        progress: told what is done, and which share of it from 0 to 1.
    """
    say = progress or _silent
    say("finding convex parts", 0.0)
    parts = parts or parts_of(mesh.vertices, mesh.faces)
    atoms = _atoms(mesh, parts)
    say("dividing triangles", 0.1)
    low, high = _atom_boxes(mesh.vertices, atoms)
    middle = 0.5 * (low + high)
    del low, high
    tree = divide(middle, atoms.triangle < 0, _Chooser(mesh.vertices, atoms, middle))
    del middle
    say("wrapping", 0.3)
    atoms = atoms.ordered(tree.order)
    shapes = _Shapes(mesh.vertices, atoms, tree)
    shapes.wrap(say)
    say("measuring", 0.9)
    result = _assemble(mesh, parts, atoms, tree, shapes)
    say("built", 1.0)
    return result


def _silent(_what: str, _share: float) -> None:
    pass


def _atoms(mesh: TriangleMesh, parts: Parts) -> _Atoms:
    convex = convex_parts(mesh.vertices, mesh.faces, parts)
    exact = np.zeros(len(parts), dtype=bool)
    exact[[part for part, _ in convex]] = True
    loose = np.flatnonzero(~exact[parts.label])
    ids = np.concatenate([mesh.faces[loose].ravel(), *(used for _, used in convex)])
    sizes = np.concatenate([np.full(len(loose), 3), [len(used) for _, used in convex]])
    begin = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    return _Atoms(ids, begin, np.concatenate([loose, np.full(len(convex), -1)]).astype(np.int64))


def _atom_boxes(vertices: FloatArray, atoms: _Atoms) -> tuple[FloatArray, FloatArray]:
    starts = atoms.begin[:-1]
    low, high = np.empty((2, len(starts), 3))
    for axis in range(3):
        along = vertices[:, axis][atoms.ids]
        low[:, axis] = np.minimum.reduceat(along, starts)
        high[:, axis] = np.maximum.reduceat(along, starts)
    return low, high


class _Chooser:
    """Cuts across that of six axes which leaves the least hull volume."""

    def __init__(self, vertices: FloatArray, atoms: _Atoms, middle: FloatArray) -> None:
        self._vertices = vertices
        self._atoms = atoms
        self._middle = middle

    def __call__(self, items: IntArray) -> BoolArray | None:
        place = self._middle[items]
        # a share of a large node's triangles tells enough
        every = -(-len(items) // TRIED_ITEMS)
        axes = principal_axes(place[::every], np.zeros(1, dtype=np.int64))[0]
        best: tuple[float, BoolArray] | None = None
        for axis in (*np.eye(3), *axes.T):
            along = place @ axis
            right = along > 0.5 * (along.min() + along.max())
            if right.all() or not right.any():
                continue
            size = sum(self._bulk(items[side][::every]) for side in (right, ~right))
            if best is None or size < best[0]:
                best = size, right
        return best[1] if best else None

    def _bulk(self, items: IntArray) -> float:
        """Volume of the hull, and a little of its surface, so that flat ones differ too [m³]."""
        rows, _ = spans(self._atoms.begin[items], self._atoms.begin[items + 1])
        points = self._vertices[np.unique(self._atoms.ids[rows])]
        try:
            hull = ConvexHull(points)
        except QhullError:
            return 0.0
        return float(hull.volume + 1e-3 * hull.area**1.5)


class _Shapes:
    """The shapes of all nodes: blocks of vertices, and for each node where its own are."""

    def __init__(self, vertices: FloatArray, atoms: _Atoms, tree: Division) -> None:
        self._vertices = vertices
        self._atoms = atoms
        self._tree = tree
        nodes = len(tree.first)
        self.first, self.count = np.zeros((2, nodes), dtype=np.int64)
        self.radius = np.zeros(nodes)
        self.blocks: list[FloatArray] = []
        self._filled = 0
        weight = atoms.begin[tree.last] - atoms.begin[tree.first]
        self._weight = weight
        self._may_hull = np.zeros(nodes, dtype=bool)
        self._may_hull[np.argsort(-weight, kind="stable")[:HULLS]] = True
        # hull vertices and radius of nodes that the node above may build upon
        self._known: dict[int, tuple[IntArray, float]] = {}

    def wrap(self, say: Progress) -> None:
        """Give every node its shape, from the leaves up."""
        levels = self._tree.levels
        for depth in range(len(levels) - 2, -1, -1):
            self._level(np.arange(levels[depth], levels[depth + 1]))
            say("wrapping", 0.3 + 0.6 * (len(levels) - 1 - depth) / (len(levels) - 1))

    def _level(self, nodes: IntArray) -> None:
        exact = self._atoms.triangle[self._tree.first[nodes]] < 0
        exact &= self._tree.left[nodes] < 0
        # seldom is a vertex shared by more than eight triangles; if it is, a box or hull will do
        light = exact | (self._weight[nodes] <= 8 * FEW)
        few = nodes[light]
        if len(few):
            node, ids = self._distinct(few)
            count = np.bincount(node, minlength=len(few))
            raw = (count <= FEW) | exact[light]
            self._put(few[raw], count[raw], self._vertices[ids[raw[node]]])
            starts = np.cumsum(count) - count
            for i in np.flatnonzero(~raw & self._may_hull[few]):
                self._hull(int(few[i]), ids[starts[i] : starts[i] + count[i]], 0.0)
            self._box(few[~raw & ~self._may_hull[few]])
        for i in nodes[~light & self._may_hull[nodes]]:
            self._hull(int(i), *self._below(int(i)))
        self._box(nodes[~light & ~self._may_hull[nodes]])

    def _distinct(self, nodes: IntArray) -> tuple[IntArray, IntArray]:
        """Vertices of some nodes, each once per node: which of the nodes, and the vertex."""
        rows, starts = self._rows(nodes)
        count = np.diff(np.append(starts, len(rows)))
        span = len(self._vertices)
        key = np.repeat(np.arange(len(nodes)) * span, count) + self._atoms.ids[rows]
        key.sort()
        key = key[np.concatenate([[True], key[1:] != key[:-1]])]
        return key // span, key % span

    def _rows(self, nodes: IntArray) -> tuple[IntArray, IntArray]:
        begin = self._atoms.begin
        return spans(begin[self._tree.first[nodes]], begin[self._tree.last[nodes]])

    def _below(self, node: int) -> tuple[IntArray, float]:
        """Vertices and radius that hold all below a node: of its children's hulls, if known."""
        children = [int(self._tree.left[node]), int(self._tree.right[node])]
        known = [self._known.pop(child, None) for child in children]
        if children[0] < 0 or all(entry is None for entry in known):
            return self._distinct(np.array([node]))[1], 0.0
        ids, radii = zip(
            *(
                entry or (self._distinct(np.array([child]))[1], 0.0)
                for child, entry in zip(children, known, strict=True)
            ),
            strict=True,
        )
        return np.unique(np.concatenate(ids)), max(radii)

    def _hull(self, node: int, ids: IntArray, radius: float) -> None:
        """Wrap a node in the hull of some vertices that holds it when grown by ``radius``."""
        kept, reach = hull_points(self._vertices[ids])
        ids, radius = ids[kept], radius + reach
        self._known[node] = ids, radius
        if len(ids) > MOST:
            kept, reach = thinned(self._vertices[ids])
            if len(ids) > PASSED_ON:
                self._known[node] = ids[kept], radius + reach
            ids, radius = ids[kept], radius + reach
        self._put(np.array([node]), np.array([len(ids)]), self._vertices[ids])
        self.radius[node] = radius

    def _box(self, nodes: IntArray) -> None:
        for some in _bundles(nodes, self._weight[nodes]):
            rows, starts = self._rows(some)
            corners = boxes(self._vertices[self._atoms.ids[rows]], starts)
            self._put(some, np.full(len(some), 8), corners.reshape(-1, 3))

    def _put(self, nodes: IntArray, count: IntArray, vertices: FloatArray) -> None:
        self.first[nodes] = self._filled + np.cumsum(count) - count
        self.count[nodes] = count
        self.blocks.append(vertices)
        self._filled += len(vertices)


def _bundles(nodes: IntArray, weight: IntArray) -> list[IntArray]:
    """Nodes (n,) in bundles of about POINTS_AT_ONCE points, given how many each has (n,)."""
    if not len(nodes):
        return []
    bundle = np.cumsum(weight) // POINTS_AT_ONCE
    return np.split(nodes, np.flatnonzero(np.diff(bundle)) + 1)


def _assemble(
    mesh: TriangleMesh, parts: Parts, atoms: _Atoms, tree: Division, shapes: _Shapes
) -> BoundingTree:
    loose = atoms.triangle >= 0
    triangles = atoms.triangle[loose]
    before = np.concatenate([[0], np.cumsum(loose)])
    leaf = tree.left < 0
    held = before[tree.last] - before[tree.first]
    vertices, first, count = _in_node_order(shapes)
    closed = parts.closed
    _, one = np.unique(parts.label, return_index=True)
    corners = mesh.vertices[mesh.faces[triangles]]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    summed = np.concatenate([[0.0], np.cumsum(area)])
    covered = summed[before[tree.last]] - summed[before[tree.first]]
    ball, size = _measure(vertices, first, covered)
    size[(held == 0) | (held == 1)] = 0.0
    ball[:, 3] += shapes.radius
    size += shapes.radius
    size[leaf & (held == 0)] = 0.0
    return BoundingTree(
        vertices=vertices,
        first=first.astype(np.int32),
        count=count.astype(np.int32),
        radius=shapes.radius,
        left=tree.left.astype(np.int32),
        right=tree.right.astype(np.int32),
        ball=ball,
        size=size,
        triangle_first=before[tree.first].astype(np.int32),
        triangle_count=np.where(leaf, held, 0).astype(np.int32),
        corners=corners,
        enclosing=closed[parts.label[triangles]],
        inner=mesh.vertices[mesh.faces[one, 0]],
    )


def _in_node_order(shapes: _Shapes) -> tuple[FloatArray, IntArray, IntArray]:
    """Vertices of the root first, its children's next: what is walked together lies together."""
    blocks = np.concatenate(shapes.blocks)
    shapes.blocks.clear()
    rows, starts = spans(shapes.first, shapes.first + shapes.count)
    return blocks[rows], starts, shapes.count


def _measure(
    vertices: FloatArray, starts: IntArray, covered: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A ball round each shape (N, 4) [m] and about how far it bulges beyond what it holds (N,) [m].

    The bulge is taken for the thickness of the shape, and where the triangles do not cover half
    of its broad side, for as much of its width as they leave open.

    Args:
        vertices: of all shapes.
        starts: where each shape's begin.
        covered: area of the triangles below each node (N,) [m²].
    """
    ball, extent = np.empty((len(starts), 4)), np.empty((len(starts), 3))
    count = np.diff(np.append(starts, len(vertices)))
    for some in _bundles(np.arange(len(starts)), count):
        begin = starts[some[0]]
        points = vertices[begin : starts[some[-1]] + count[some[-1]]]
        at = starts[some] - begin
        run = np.repeat(np.arange(len(some)), count[some])
        low, high = np.minimum.reduceat(points, at), np.maximum.reduceat(points, at)
        center = 0.5 * (low + high)
        reach = np.maximum.reduceat(np.linalg.norm(points - center[run], axis=1), at)
        ball[some] = np.column_stack([center, reach * (1.0 + 1e-12)])
        along = np.einsum("kc,kca->ka", points, principal_axes(points, at)[run])
        extent[some] = np.maximum.reduceat(along, at) - np.minimum.reduceat(along, at)
    broad = extent[:, 1] * extent[:, 2]
    share = 2.0 * covered / np.maximum(broad, np.finfo(float).tiny)
    return ball, extent[:, 0] + extent[:, 1] * np.clip(1.0 - share, 0.0, 1.0)
