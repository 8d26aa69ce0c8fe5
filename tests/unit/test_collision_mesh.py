from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from rampe_guard.collision import mesh_repair
from rampe_guard.collision.mesh import (
    MAX_TRIANGLES,
    ZONE_MOST_M,
    TriangleMesh,
    ball_mesh,
    box_mesh,
    check_extent,
    checked_mesh,
    load_mesh,
    open_words,
    prism_mesh,
)
from rampe_guard.collision.mesh_repair import first_of_equal
from rampe_guard.collision.zones import build_zone
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
        ("mesh.xyz9", b"1 2 3", "is none of .*by its ending"),
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


BOX = box_mesh(np.array([1.0, 2.0, 3.0]))
OPEN = TriangleMesh(BOX.vertices, BOX.faces[:-1])


def _notes(vertices: np.ndarray, faces: np.ndarray) -> tuple[TriangleMesh, list[str]]:
    mesh = checked_mesh(vertices, faces, "m")
    assert all(note.startswith("m: ") for note in mesh.notes)
    return mesh, [note[3:] for note in mesh.notes]


def test_a_sound_mesh_needs_no_word() -> None:
    for mesh in (BOX, OPEN, ball_mesh(1.0), prism_mesh(1.0, 2.0)):
        again, notes = _notes(mesh.vertices, mesh.faces)
        assert notes == []
        assert np.array_equal(again.faces, mesh.faces)


def test_vertices_of_no_triangle_go_even_if_they_are_not_finite() -> None:
    vertices = np.vstack([BOX.vertices, [[np.nan, 0, 0], [1e9, 0, 0]]])
    mesh, notes = _notes(vertices, BOX.faces)
    assert notes == ["2 vertices of no triangle left out"]
    assert len(mesh.vertices) == 8


def test_equal_vertices_become_one_and_minus_zero_is_zero() -> None:
    soup = BOX.vertices[BOX.faces].reshape(-1, 3)
    mesh, notes = _notes(soup, np.arange(36).reshape(-1, 3))
    assert notes == []
    assert len(mesh.vertices) == 8
    assert mesh.is_watertight()
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0], [1, 0, 0], [0, -1, 0]])
    assert len(checked_mesh(flat, np.arange(6).reshape(-1, 3), "m").vertices) == 4


def test_triangles_given_twice_go_and_a_sheet_keeps_both_sides() -> None:
    twice = np.concatenate([BOX.faces, BOX.faces[:3], np.roll(BOX.faces[3:4], 1, axis=1)])
    mesh, notes = _notes(BOX.vertices, twice)
    assert notes == ["4 triangles given twice left out"]
    assert len(mesh.faces) == 12
    assert mesh.is_closed()
    sheet, notes = _notes(CORNERS, np.array([[0, 1, 2], [2, 1, 0]]))
    assert notes == []
    assert len(sheet.faces) == 2
    assert not sheet.is_closed()


def test_a_triangle_twice_stays_where_the_surface_closes_only_with_both() -> None:
    # two tetrahedra on the same side of one face: the face is walked twice, and each edge evenly
    tops = np.array([[0.1, 0.1, 1.0], [0.2, 0.2, 0.5]])
    vertices = np.vstack([CORNERS, tops])
    faces = [face for top in (3, 4) for face in ([0, 2, 1], [0, 1, top], [1, 2, top], [2, 0, top])]
    mesh, notes = _notes(vertices, np.array(faces))
    assert notes == ["1 triangle given twice kept: the surface closes only with them"]
    assert len(mesh.faces) == 8
    assert mesh.is_closed()


def test_triangles_without_area_go_unless_they_bridge_a_gap() -> None:
    line = np.array([[5.0, 0, 0], [6, 0, 0], [7, 0, 0]])
    mesh, notes = _notes(np.vstack([BOX.vertices, line]), np.vstack([BOX.faces, [[8, 9, 10]]]))
    assert notes == ["1 triangle without area left out"]
    assert len(mesh.vertices) == 8
    # a square of two triangles on one side of an edge, of three on the other
    tetra = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0]])
    faces = np.array([[0, 2, 1], [0, 4, 3], [4, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 4]])
    bridged, notes = _notes(tetra, faces)
    assert notes == ["1 triangle without area kept: they bridge open edges"]
    assert bridged.is_closed()
    with pytest.raises(GeometryError, match="m: no triangle has an area"):
        checked_mesh(line, TRIANGLE, "m")


def test_closed_parts_are_turned_to_face_outwards() -> None:
    mesh, notes = _notes(BOX.vertices, BOX.faces[:, ::-1])
    assert notes == ["the surface turned inside out to face outwards"]
    assert mesh.parts().volume[0] == pytest.approx(6.0)
    both = np.concatenate([BOX.faces, BOX.faces[:, ::-1] + 8])
    mesh, notes = _notes(np.concatenate([BOX.vertices, BOX.vertices + 9.0]), both)
    assert notes == ["1 of 2 parts turned inside out to face outwards"]
    assert (mesh.parts().volume > 0.0).all()
    # a cavity faces inwards by right
    hollow = np.concatenate([BOX.vertices, 0.5 * BOX.vertices])
    mesh, notes = _notes(hollow, both)
    assert notes == []
    assert sorted(mesh.parts().volume) == pytest.approx([-0.75, 6.0])


@pytest.mark.parametrize("seed", range(5))
def test_turned_triangles_are_turned_back_where_that_closes_the_part(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ball = ball_mesh(1.0)
    faces = ball.faces.copy()
    wrong = rng.random(len(faces)) < (0.01, 0.2, 0.5, 0.9, 1.0)[seed]
    faces[wrong] = faces[wrong][:, ::-1]
    mesh, notes = _notes(ball.vertices, faces)
    assert notes
    assert mesh.is_watertight()
    assert mesh.parts().volume[0] == pytest.approx(ball.parts().volume[0])
    assert mesh.parts().volume[0] > 0.0


def test_what_cannot_face_one_way_is_left_as_it_is_and_not_closed() -> None:
    k, n = np.arange(12), 12
    angle = 2 * np.pi * k / n
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    turn = np.column_stack(
        [np.cos(angle) * np.cos(angle / 2), np.sin(angle) * np.cos(angle / 2), np.sin(angle / 2)]
    )
    vertices = np.concatenate([ring + 0.3 * turn, ring - 0.3 * turn])
    after = np.where(k < n - 1, k + 1, n)  # a Moebius strip: the last joins the other edge
    other = np.where(k < n - 1, k + 1 + n, 0)
    faces = np.concatenate([np.column_stack([k, after, other]), np.column_stack([k, other, k + n])])
    mesh, notes = _notes(vertices, faces)
    assert notes == []
    assert np.array_equal(mesh.faces, faces)
    assert not mesh.is_closed()
    assert open_words(mesh, "m") == ("m: it is not closed: a surface without an inside",)


def test_open_parts_are_counted_in_words() -> None:
    away = np.eye(4)
    away[0, 3] = 9.0
    lid = OPEN.moved(away)
    mesh = checked_mesh(
        np.concatenate([BOX.vertices, lid.vertices]),
        np.concatenate([BOX.faces, lid.faces + 8]),
        "m",
    )
    assert open_words(mesh, "m") == ("m: 1 of 2 parts is not closed: a surface without an inside",)
    assert open_words(BOX, "m") == ()


def test_a_mirroring_scale_keeps_the_outside_outside(tmp_path: Path) -> None:
    mirrored = BOX.moved(np.eye(4), np.array([1.0, -1.0, 1.0]))
    assert mirrored.parts().volume[0] == pytest.approx(6.0)
    file = write_stl(tmp_path / "m.stl", BOX.vertices[BOX.faces])
    read = load_mesh(file, np.array([-1e-3, 1e-3, 1e-3]))
    assert read.parts().volume[0] == pytest.approx(6e-9)
    assert read.notes == ()


@pytest.mark.parametrize(
    ("extent", "most", "words"),
    [
        (5700.0, 200.0, "is 5700 m long, more than 200 m.*millimetre.*scale of 0.001"),
        (0.0005, 200.0, "is 0.5 mm in all.*scaled twice"),
        (30_000.0, ZONE_MOST_M, "is 3e.04 m long"),
    ],
)
def test_sizes_that_cannot_be_are_refused_with_the_likely_scale(
    extent: float, most: float, words: str
) -> None:
    with pytest.raises(GeometryError, match=f"link 'boom': {words}"):
        check_extent(extent, "link 'boom'", most)
    assert check_extent(5.7, "link 'boom'") == ()
    (remark,) = check_extent(150.0, "link 'boom'")
    assert "if that is in millimetres" in remark


def test_the_unit_that_a_file_names_counts(tmp_path: Path) -> None:
    box = trimesh.creation.box((1000.0, 2000.0, 3000.0))
    text = box.export(file_type="dae").decode()
    assert 'meter="1.0"' in text or "<unit" not in text
    for unit, metres in (("0.001", 3.0), ("1.0", 3000.0)):
        file = tmp_path / f"{unit}.dae"
        asset = text.replace("<asset>", f'<asset><unit name="u" meter="{unit}"/>', 1)
        file.write_text(
            re.sub(
                r'(<unit name="u"[^>]*/>)(.*?)<unit [^>]*/>',
                r"\1\2",
                asset,
                count=1,
                flags=re.DOTALL,
            )
        )
        mesh = load_mesh(file)
        assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(metres)
        said = [note for note in mesh.notes if "taken to metres" in note]
        assert len(said) == (unit != "1.0")


def test_binary_and_text_stl_read_alike(tmp_path: Path) -> None:
    mesh = trimesh.Trimesh(*_soup(fork_triangles()))
    (tmp_path / "b.stl").write_bytes(mesh.export(file_type="stl"))
    (tmp_path / "a.stl").write_text(mesh.export(file_type="stl_ascii"))
    binary, text = (load_mesh(tmp_path / name) for name in ("b.stl", "a.stl"))
    assert len(binary.faces) == len(text.faces) == 36
    assert np.allclose(binary.vertices[binary.faces], text.vertices[text.faces], atol=1e-6)


def test_a_binary_stl_of_too_many_triangles_is_refused_by_its_header(tmp_path: Path) -> None:
    file = tmp_path / "huge.stl"
    count = MAX_TRIANGLES + 1
    with file.open("wb") as sparse:
        sparse.write(b"\0" * 80 + count.to_bytes(4, "little"))
        sparse.truncate(84 + 50 * count)
    with pytest.raises(GeometryError, match=f"huge.stl: {count} triangles; more than"):
        load_mesh(file)


def test_rows_with_one_number_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    rows = rng.integers(0, 4, (500, 3))
    first, kind = first_of_equal(rows)
    _, index, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    assert np.array_equal(first, np.sort(index))
    assert np.array_equal(rows[first][kind], rows)
    assert len(np.unique(inverse)) == len(first)
    # the mixing sends rows to equal numbers only by chance: make it so
    monkeypatch.setattr(mesh_repair, "mixed", lambda words: words[:, 0] & np.uint64(1))
    assert np.array_equal(first_of_equal(rows)[0], first)
    assert np.array_equal(first_of_equal(rows)[1], kind)
