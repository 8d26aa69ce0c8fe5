from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from rampe_guard.collision import node_shapes, tree_build
from rampe_guard.collision.mesh import TriangleMesh, ball_mesh, box_mesh, checked_mesh, load_mesh
from rampe_guard.collision.mesh import prism_mesh as prism
from rampe_guard.collision.node_shapes import boxes, hull_points, thinned
from rampe_guard.collision.tree_build import build_tree
from rampe_guard.collision.tree_split import LEAF, divide
from rampe_guard.core.bounding_tree import NONE, BoundingTree
from tests.support.arms import fork_triangles

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

ROOT = Path(__file__).parents[2]
TOLERANCE_M = 1e-9


def terrain(n: int, seed: int = 0, rough: float = 0.05) -> TriangleMesh:
    """An open, bumpy sheet of 2 (n - 1)² triangles."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 10, n), np.linspace(0, 7, n), indexing="ij")
    z = np.sin(x) + 0.3 * np.cos(2 * y) + rough * rng.normal(size=x.shape)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return TriangleMesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces)


def together(*meshes: TriangleMesh) -> TriangleMesh:
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return TriangleMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + o for mesh, o in zip(meshes, offsets, strict=True)]),
    )


def outside(points: FloatArray, vertices: FloatArray, most: int = 40) -> float:
    """Farthest of some points from the hull of the vertices [m].

    Points within all planes of the hull are inside. For those farthest beyond a plane (``most``
    of them, or all if there is no plane to ask) the nearest mixture of the vertices is found by
    nonnegative least squares with a heavy row that makes the weights sum to one.
    """
    try:
        planes = ConvexHull(vertices).equations
    except QhullError:
        beyond = np.full(len(points), np.inf)
    else:
        beyond = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    farthest = 0.0
    for point in points[np.argsort(-beyond)[: min(most, int((beyond > 0.0).sum()))]]:
        heavy = 1e4 * float(np.abs(vertices - point).max() + 1e-9)
        rows = np.vstack([(vertices - point).T, np.full(len(vertices), heavy)])
        weights, _ = nnls(rows, np.array([0.0, 0.0, 0.0, heavy]), maxiter=10_000)
        nearest = weights @ vertices / weights.sum()
        farthest = max(farthest, float(np.linalg.norm(nearest - point)))
    return farthest


def below(tree: BoundingTree, node: int) -> FloatArray:
    """Points (k, 3) whose hull holds all that is below a node: corners, and exact leaves."""
    todo, points = [node], []
    while todo:
        i = todo.pop()
        if tree.left[i] != NONE:
            todo += [int(tree.left[i]), int(tree.right[i])]
            continue
        if tree.triangle_count[i]:
            own = slice(tree.triangle_first[i], tree.triangle_first[i] + tree.triangle_count[i])
            points.append(tree.corners[own].reshape(-1, 3))
        else:
            points.append(tree.vertices[tree.first[i] : tree.first[i] + tree.count[i]])
    return np.unique(np.concatenate(points), axis=0)


def check_tree(tree: BoundingTree, mesh: TriangleMesh, *, nodes: int = 40) -> None:
    """All that the contract of `BoundingTree` promises, containment for a sample of nodes."""
    count = tree.nodes
    leaf = tree.left == NONE
    assert ((tree.right == NONE) == leaf).all()
    inner = np.flatnonzero(~leaf)
    assert (tree.left[inner] > inner).all()
    assert (tree.right[inner] > inner).all()
    children = np.concatenate([tree.left[inner], tree.right[inner]])
    assert sorted(children.tolist()) == list(range(1, count))
    assert (tree.triangle_count[~leaf] == 0).all()
    assert tree.triangle_count.max() <= LEAF
    held = np.flatnonzero(tree.triangle_count)
    rows = np.concatenate(
        [np.zeros(0, dtype=int)]
        + [
            np.arange(tree.triangle_first[i], tree.triangle_first[i] + tree.triangle_count[i])
            for i in held
        ]
    )
    assert sorted(rows.tolist()) == list(range(len(tree.corners)))
    given = {tuple(t.ravel()) for t in mesh.vertices[mesh.faces]}
    assert {tuple(t.ravel()) for t in tree.corners} <= given
    if not (leaf & (tree.triangle_count == 0)).any():
        assert len(tree.corners) == len(mesh.faces)
    rng = np.random.default_rng(0)
    some = np.unique([0, *range(min(count, 7)), *rng.integers(0, count, nodes).tolist()])
    for i in some:
        own = tree.vertices[tree.first[i] : tree.first[i] + tree.count[i]]
        points = below(tree, int(i))
        assert outside(points, own, 20) <= tree.radius[i] + TOLERANCE_M
        reach = np.linalg.norm(own - tree.ball[i, :3], axis=1).max()
        assert reach + tree.radius[i] <= tree.ball[i, 3] + 1e-12


MESHES = {
    "terrain": terrain(40),
    "smooth": terrain(40, rough=0.0),
    "flat": TriangleMesh(terrain(20).vertices * [1.0, 1.0, 0.0], terrain(20).faces),
    "ball": ball_mesh(0.7),
    "fork": checked_mesh(fork_triangles().reshape(-1, 3), np.arange(108).reshape(-1, 3), "fork"),
    "far": box_mesh(np.ones(3)).moved(np.array([[1, 0, 0, 9e4], [0, 1, 0, 0], [0, 0, 1, 0.0]])),
}


@pytest.mark.parametrize("name", [*MESHES, "boom", "bucket", "undercarriage"])
def test_every_node_holds_what_is_below(name: str) -> None:
    mesh = MESHES.get(name) or load_mesh(ROOT / f"geometry/excavator/meshes/{name}.stl")
    check_tree(build_tree(mesh), mesh)


def test_convex_closed_parts_are_exact_nodes() -> None:
    box, tube = box_mesh(np.array([1.0, 2, 3])), prism(0.4, 2.0, 48)
    away = np.eye(4)
    away[:3, 3] = 5.0, 0, 0
    mesh = together(box, tube.moved(away), terrain(6))
    tree = build_tree(mesh)
    check_tree(tree, mesh)
    exact = np.flatnonzero((tree.left == NONE) & (tree.triangle_count == 0))
    assert sorted(tree.count[exact].tolist()) == [8, 96]
    assert (tree.size[exact] == 0.0).all()
    assert (tree.radius[exact] == 0.0).all()
    assert len(tree.corners) == 50
    assert not tree.enclosing.any()
    assert len(tree.inner) == 3
    alone = build_tree(box)
    assert alone.nodes == 1
    assert alone.triangle_count[0] == 0


def test_what_is_not_convex_keeps_its_triangles() -> None:
    lid = box_mesh(np.ones(3))
    dented = TriangleMesh(lid.vertices.copy(), lid.faces)
    dented.vertices[0] *= 0.2
    for mesh, closed in ((dented, True), (TriangleMesh(lid.vertices, lid.faces[:-1]), False)):
        tree = build_tree(mesh)
        check_tree(tree, mesh)
        assert len(tree.corners) == len(mesh.faces)
        assert (tree.enclosing == closed).all()


def test_boxes_and_hulls_hold_too_where_a_hull_each_is_dear(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tree_build, "HULLS", 6)
    ball = trimesh.creation.icosphere(subdivisions=4)
    for mesh in (terrain(50), TriangleMesh(np.asarray(ball.vertices), np.asarray(ball.faces))):
        tree = build_tree(mesh)
        assert (tree.count == 8).sum() > 10
        check_tree(tree, mesh)


def test_thinned_hull_with_its_radius_covers_the_dropped_vertices() -> None:
    rng = np.random.default_rng(3)
    for stretch in ([1, 1, 1], [10, 1, 1], [10, 5, 0.01]):
        points = rng.normal(size=(700, 3))
        points *= np.array(stretch) / np.linalg.norm(points, axis=1, keepdims=True)
        kept, radius = thinned(points)
        assert len(kept) <= node_shapes.MOST
        assert outside(points, points[kept]) <= radius + TOLERANCE_M
        # and the cover is no looser than it must be: some point does need most of it
        assert outside(points, points[kept]) >= 0.9 * radius


def test_hulls_of_flat_and_straight_points_cover_them() -> None:
    rng = np.random.default_rng(4)
    flat = np.column_stack([rng.normal(size=(90, 2)), np.zeros(90)])
    line = np.outer(rng.normal(size=90), [1.0, 2, 3])
    tilt = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    for points in (flat, line, flat @ tilt.T + 1e3, np.ones((90, 3))):
        kept, radius = hull_points(points)
        assert len(kept) <= 40
        assert outside(points, points[kept]) <= radius + TOLERANCE_M
        assert radius < 1e-9


def test_boxes_hold_their_points_and_turn_with_them() -> None:
    rng = np.random.default_rng(5)
    tilt = trimesh.transformations.rotation_matrix(0.6, [0, 0, 1])[:3, :3]
    bar = (rng.random((50, 3)) * [5.0, 1.0, 0.5]) @ tilt.T
    cube = rng.random((60, 3))
    corners = boxes(np.concatenate([bar, cube]), np.array([0, 50]))
    for box, points in zip(corners, (bar, cube), strict=True):
        assert outside(points, box) <= TOLERANCE_M
    edges = np.linalg.norm(corners[0][[1, 2, 4]] - corners[0][0], axis=1)
    assert np.prod(edges) < 1.3 * 2.5


def test_division_is_even_enough_whatever_the_points() -> None:
    rng = np.random.default_rng(6)
    lone = np.zeros(3000, dtype=bool)
    for points in (
        np.zeros((3000, 3)),
        np.exp(rng.normal(size=(3000, 3)) * 8),
        rng.random((3000, 3)),
    ):
        tree = divide(points, lone, lambda _points: None)
        assert sorted(tree.order.tolist()) == list(range(3000))
        assert len(tree.levels) < 45
        leaf = tree.left < 0
        assert (tree.last - tree.first)[leaf].max() <= LEAF
        assert (tree.last - tree.first)[leaf].sum() == 3000


def test_progress_is_told_in_order() -> None:
    told: list[tuple[str, float]] = []
    build_tree(terrain(30), progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
