from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from rampe_guard.collision.mesh import (
    MAX_TRIANGLES,
    ball_mesh,
    box_mesh,
    checked_mesh,
    load_mesh,
    prism_mesh,
)
from rampe_guard.collision.pieces import cut, hull, piece_tree
from rampe_guard.collision.zones import build_zone
from rampe_guard.core.convex import ConvexPiece
from rampe_guard.core.scene import Halfspace, Mesh, Sphere
from rampe_guard.errors import GeometryError
from tests.support.arms import box_triangles, fork_triangles, write_stl

if TYPE_CHECKING:
    from pathlib import Path

TRIANGLE = np.array([[0, 1, 2]])
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), "no triangles"),
        (CORNERS, np.zeros((0, 3)), "no triangles"),
        (np.array([[0.0, 0, 0], [np.nan, 0, 0], [0, 1, 0]]), TRIANGLE, "vertex 1 .*not finite"),
        (np.array([[0.0, 0, 0], [np.inf, 0, 0], [0, 1, 0]]), TRIANGLE, "not finite"),
        (CORNERS, np.array([[0, 1, 3]]), "vertex 3 of 3"),
        (CORNERS, np.array([[0, 1, -1]]), "names vertex"),
        (CORNERS * 0.0, TRIANGLE, "collapsed"),
        (CORNERS * 1e9, TRIANGLE, "wrong unit"),
        (CORNERS, np.zeros((MAX_TRIANGLES + 1, 3), dtype=np.int64), "simplify"),
    ],
)
def test_unfit_meshes_are_refused_by_name(
    vertices: np.ndarray, faces: np.ndarray, words: str
) -> None:
    with pytest.raises(GeometryError, match=f"boom.stl: .*{words}"):
        checked_mesh(vertices, faces, "boom.stl")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.stl", None, "no such mesh"),
        ("empty.stl", b"", "cannot be read|no triangles"),
        ("noise.stl", b"solid x\nnot a mesh at all\n", "cannot be read|no triangles"),
        (
            "cut.stl",
            b"\x00" * 80 + b"\x10\x00\x00\x00" + b"\x00" * 30,
            "cannot be read|no triangles",
        ),
        ("mesh.xyz9", b"1 2 3", "cannot be read"),
    ],
)
def test_unreadable_files_name_the_file(
    tmp_path: Path, name: str, content: bytes | None, words: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(GeometryError, match=words) as caught:
        load_mesh(path)
    assert str(path) in str(caught.value)


def test_files_of_all_kinds_read_alike(tmp_path: Path) -> None:
    mesh = trimesh.Trimesh(*_soup(fork_triangles()))
    for suffix in ("stl", "obj", "dae", "ply"):
        mesh.export(str(tmp_path / f"fork.{suffix}"))
        read = load_mesh(tmp_path / f"fork.{suffix}")
        assert len(read.faces) == 36
        assert np.allclose(read.vertices.min(axis=0), mesh.bounds[0], atol=1e-6)
        assert np.allclose(read.vertices.max(axis=0), mesh.bounds[1], atol=1e-6)


def _soup(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    vertices, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def test_inside_outside_and_parts() -> None:
    fork = checked_mesh(*_soup(fork_triangles()), "fork")
    assert len(fork.components()) == 3
    assert all(part.is_watertight() for part in fork.components())
    inside, between, far = fork.winding(np.array([[0.03, 0, 0.01], [0.15, 0, 0.01], [9, 9, 9.0]]))
    assert abs(inside) == pytest.approx(1.0)
    assert between == pytest.approx(0.0, abs=1e-9)
    assert far == pytest.approx(0.0, abs=1e-9)
    lidless = checked_mesh(*_soup(box_triangles((1, 1, 1))[:-1]), "lidless")
    assert not lidless.is_watertight()


def test_round_primitives_contain_what_they_stand_for() -> None:
    angle = np.linspace(0, 2 * np.pi, 1000)
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(1000)])
    assert abs(prism_mesh(0.99, 1.0).winding(0.989 * circle)).min() > 0.5
    ball = ball_mesh(1.0)
    ways = np.random.default_rng(0).normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    assert abs(ball.winding(0.9999 * ways)).min() > 0.5
    assert np.linalg.norm(ball.vertices, axis=1).max() < 1.02
    assert box_mesh(np.array([1.0, 2, 3])).is_watertight()


@pytest.mark.parametrize("most", [1, 3, 8])
def test_pieces_contain_every_triangle(most: int) -> None:
    fork = checked_mesh(*_soup(fork_triangles()), "fork")
    pieces = [branch.piece for branch in cut(piece_tree(fork, 1e-4, 8, measured=True), most)]
    assert len(pieces) <= most
    rng = np.random.default_rng(1)
    weights = rng.dirichlet([1, 1, 1], size=(len(fork.faces), 5))
    samples = np.einsum("fkc,fcx->fkx", weights, fork.vertices[fork.faces]).reshape(-1, 3)
    held = np.zeros(len(samples), dtype=bool)
    for piece in pieces:
        assert isinstance(piece, ConvexPiece)
        vertices, faces = hull(piece.vertices)
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        normal = np.cross(b - a, c - a)
        outside = np.einsum("fi,sfi->sf", normal, samples[:, None] - a).max(axis=1)
        held |= outside <= 1e-12
    assert held.all()


def test_hull_of_flat_points_has_a_volume_and_holds_them() -> None:
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    vertices, faces = hull(flat)
    assert len(faces) >= 12
    assert (vertices.min(axis=0) < flat.min(axis=0)).all()
    assert (vertices.max(axis=0) > flat.max(axis=0)).all()


def test_bad_scene_objects_are_refused_by_name(tmp_path: Path) -> None:
    file = str(write_stl(tmp_path / "m.stl", box_triangles((1, 1, 1))))
    turned = np.diag([2.0, 1, 1, 1])
    for item, words in (
        (Sphere(name="s", margin_m=0, radius_m=-1, center_m=(0, 0, 0)), "'s' has a size"),
        (Sphere(name="s", margin_m=np.nan, radius_m=1, center_m=(0, 0, 0)), "margin_m nan"),
        (Sphere(name="s", margin_m=0, radius_m=1, center_m=(0, np.nan, 0)), "not finite"),
        (Halfspace(name="g", margin_m=0, normal=(0, 0, 2), offset_m=0), "length 2"),
        (Mesh(name="m", margin_m=0, file=file, scale=1, pose=turned), "no rigid motion"),
        (
            Sphere(name="s", margin_m=0, radius_m=1, center_m=(0, 0, 0), ignore_links=("x",)),
            "ignores link 'x'; the arm has tool",
        ),
    ):
        with pytest.raises(GeometryError, match=words):
            build_zone(item, ("tool",))
