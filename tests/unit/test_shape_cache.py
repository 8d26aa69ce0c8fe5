from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from rampe_guard.collision import shape_cache
from rampe_guard.collision.mesh import box_mesh, load_mesh
from rampe_guard.collision.shape import Shape, placed, shape_of
from rampe_guard.collision.shape_cache import ShapeCache, cached_shape, default_cache, load_shape
from rampe_guard.collision.shape_file import BrokenShapeError, read_shape, write_shape
from rampe_guard.core.bounding_tree import BoundingTree
from rampe_guard.errors import GeometryError
from tests.support.arms import box_triangles, write_stl

ROOT = Path(__file__).parents[2]
BUCKET = ROOT / "geometry/excavator/meshes/bucket.stl"
FIELDS = [field.name for field in dataclasses.fields(BoundingTree)]


def same(a: Shape, b: Shape) -> bool:
    plain = [
        field.name
        for field in dataclasses.fields(Shape)
        if field.name not in {"tree", "low", "high"}
    ]
    return (
        all(getattr(a, name) == getattr(b, name) for name in plain)
        and np.array_equal([a.low, a.high], [b.low, b.high])
        and all(np.array_equal(getattr(a.tree, name), getattr(b.tree, name)) for name in FIELDS)
        and all(
            getattr(a.tree, name).dtype == getattr(b.tree, name).dtype
            and getattr(b.tree, name).flags.c_contiguous
            and getattr(b.tree, name).flags.aligned
            for name in FIELDS
        )
    )


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of what was built, not found."""
    log: list[str] = []

    def build(*arguments: object, **options: object) -> Shape:
        log.append("built")
        return shape_of(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(shape_cache, "shape_of", build)
    return log


def test_the_second_time_the_same_shape_comes_from_the_folder(
    tmp_path: Path, built: list[str]
) -> None:
    cache = ShapeCache(tmp_path / "deep" / "folder")
    first = load_shape(BUCKET, cache=cache)
    second = load_shape(BUCKET, cache=cache)
    assert built == ["built"]
    assert same(first, second)
    assert second.closed
    assert second.triangles == 1432
    assert same(first, load_shape(BUCKET, cache=ShapeCache(None)))
    assert [path.suffix for path in (tmp_path / "deep" / "folder").iterdir()] == [".shape"]


def test_other_bytes_scale_or_version_are_built_anew(
    tmp_path: Path, built: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = ShapeCache(tmp_path / "cache")
    file = tmp_path / "m.stl"
    shutil.copy(BUCKET, file)
    load_shape(file, cache=cache)
    load_shape(file, 2.0, cache=cache)
    load_shape(file, [1.0, 1.0, 2.0], cache=cache)  # type: ignore[arg-type]
    assert len(built) == 3
    load_shape(file, [1.0, 1.0, 1.0], cache=cache)  # type: ignore[arg-type]
    shutil.copy(file, tmp_path / "n.stl")
    load_shape(tmp_path / "n.stl", cache=cache)
    assert len(built) == 3  # the same content under another name
    data = bytearray(file.read_bytes())
    data[84 + 12] ^= 1
    file.write_bytes(data)
    load_shape(file, cache=cache)
    assert len(built) == 4
    monkeypatch.setattr(shape_cache, "_MADE_BY", "a later builder")
    load_shape(file, cache=cache)
    assert len(built) == 5


def test_words_on_repairs_are_kept_and_name_the_file_asked_for(tmp_path: Path) -> None:
    cache = ShapeCache(tmp_path / "cache")
    triangles = box_triangles((1, 2, 3))
    doubled = np.concatenate([triangles, triangles[:2], np.zeros((1, 3, 3))])
    one = write_stl(tmp_path / "one.stl", doubled)
    shutil.copy(one, tmp_path / "two.stl")
    first = load_shape(one, cache=cache)
    second = load_shape(tmp_path / "two.stl", name="object 'shed'", cache=cache)
    for shape, name in ((first, str(one)), (second, "object 'shed'")):
        assert shape.notes == (
            f"{name}: 1 triangle with equal corners left out",
            f"{name}: 2 triangles given twice left out",
        )


def test_a_mesh_in_hand_is_kept_by_its_numbers(tmp_path: Path, built: list[str]) -> None:
    cache = ShapeCache(tmp_path)
    mesh = load_mesh(BUCKET)
    first = cached_shape(mesh, cache=cache)
    again = cached_shape(dataclasses.replace(mesh, notes=("mended",)), cache=cache)
    assert built == ["built"]
    assert again.notes == ("mended",)
    assert same(first, dataclasses.replace(again, notes=first.notes))
    moved = mesh.vertices.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 9.0)
    cached_shape(dataclasses.replace(mesh, vertices=moved), cache=cache)
    assert len(built) == 2


def test_damaged_files_are_never_believed(tmp_path: Path, built: list[str]) -> None:
    cache = ShapeCache(tmp_path)
    fresh = load_shape(BUCKET, cache=cache)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    rng = np.random.default_rng(7)
    damages = [whole[:n] for n in (0, 5, 51, 52, 60, 200, len(whole) - 1, len(whole) // 2)]
    damages += [whole + b"\0", whole + whole, b"x" * len(whole), whole[:60] + whole[124:]]
    for at in (*rng.integers(0, len(whole), 60), *range(0, 64, 3)):
        flipped = bytearray(whole)
        flipped[at] ^= 1 << int(rng.integers(8))
        damages.append(bytes(flipped))
    for damage in damages:
        path.write_bytes(damage)
        with pytest.raises(BrokenShapeError):
            read_shape(path, path.stem)
    assert len(built) == 1
    assert same(load_shape(BUCKET, cache=cache), fresh)
    assert len(built) == 2
    assert path.read_bytes() == whole  # mended


def test_a_whole_file_of_something_else_is_not_believed(tmp_path: Path, built: list[str]) -> None:
    cache = ShapeCache(tmp_path)
    box = load_shape(write_stl(tmp_path / "b.stl", box_triangles((1, 1, 1))), cache=cache)
    (stranger,) = tmp_path.glob("*.shape")
    load_shape(BUCKET, cache=cache)
    (mine,) = set(tmp_path.glob("*.shape")) - {stranger}
    shutil.copy(stranger, mine)
    assert load_shape(BUCKET, cache=cache).triangles == 1432
    assert len(built) == 3
    assert box.triangles == 12


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("left", lambda a: a + 1_000_000),
        ("right", np.zeros_like),
        ("first", lambda a: a + 10**6),
        ("first", lambda a: a - 1),
        ("count", lambda a: a * 0),
        ("triangle_first", lambda a: a + 10**6),
        ("vertices", lambda a: a * np.nan),
        ("radius", lambda a: a - 1.0),
        ("ball", lambda a: a[:-1]),
        ("enclosing", lambda a: a[:-1]),
    ],
)
def test_numbers_that_would_lead_astray_are_refused_even_with_a_checksum(
    tmp_path: Path, name: str, change: object
) -> None:
    shape = shape_of(load_mesh(BUCKET))
    assert callable(change)
    wrong = dataclasses.replace(shape.tree, **{name: change(getattr(shape.tree, name))})
    path = tmp_path / "k.shape"
    for tree, fine in ((shape.tree, True), (wrong, False)):
        with path.open("wb") as file:
            write_shape(file, "k", dataclasses.replace(shape, tree=tree))
        if fine:
            assert same(read_shape(path, "k"), shape)
        else:
            with pytest.raises(BrokenShapeError, match="cannot be"):
                read_shape(path, "k")


def test_a_folder_that_cannot_be_written_is_said_once_and_stops_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_bytes(b"in the way")  # the superuser may write any folder, not this
    cache = ShapeCache(tmp_path / "file" / "cache")
    assert cache.trouble is None
    for _ in range(3):
        assert load_shape(BUCKET, cache=cache).triangles == 1432
    assert cache.trouble is not None
    assert "RAMPE_GUARD_CACHE" in cache.trouble
    said = [r for r in caplog.records if "cannot be kept" in r.getMessage()]
    assert len(said) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_read_only_folder_still_serves_what_it_has(tmp_path: Path, built: list[str]) -> None:
    cache = ShapeCache(tmp_path / "c")
    load_shape(BUCKET, cache=cache)
    (tmp_path / "c").chmod(0o500)
    try:
        load_shape(BUCKET, cache=ShapeCache(tmp_path / "c"))
        assert built == ["built"]
        load_shape(BUCKET, 2.0, cache=cache)
        assert cache.trouble is not None
    finally:
        (tmp_path / "c").chmod(0o700)


def test_the_cache_is_bounded_and_what_was_not_used_for_longest_goes(tmp_path: Path) -> None:
    cache = ShapeCache(tmp_path, most_bytes=1)
    load_shape(BUCKET, cache=cache)
    size = next(tmp_path.iterdir()).stat().st_size
    cache = ShapeCache(tmp_path, most_bytes=int(3.5 * size))
    stranger = tmp_path / "notes.txt"
    stranger.write_text("mine")
    left = tmp_path / ".unfinished-abc"
    left.write_bytes(b"half a shape")
    now = time.time()
    os.utime(left, (now - 9999, now - 9999))
    for i, scale in enumerate((2.0, 3.0)):
        load_shape(BUCKET, scale, cache=cache)
        for path in tmp_path.glob("*.shape"):
            os.utime(path, (now - 500 + i, now - 500 + i))
    paths = set(tmp_path.glob("*.shape"))
    assert len(paths) == 3
    load_shape(BUCKET, 2.0, cache=cache)  # used again: now the newest
    fresh = max(paths, key=lambda path: path.stat().st_mtime)
    load_shape(BUCKET, 4.0, cache=cache)
    kept = set(tmp_path.glob("*.shape"))
    assert len(kept) == 3
    assert fresh in kept
    assert stranger.exists()
    assert not left.exists()


def test_two_processes_at_once_leave_one_whole_file(tmp_path: Path) -> None:
    program = (
        "import sys; from rampe_guard.collision.shape_cache import load_shape\n"
        "for _ in range(3): assert load_shape(sys.argv[1]).triangles == 1432\n"
    )
    environment = {**os.environ, "RAMPE_GUARD_CACHE": str(tmp_path)}
    running = [
        subprocess.Popen([sys.executable, "-c", program, str(BUCKET)], env=environment, cwd=ROOT)
        for _ in range(2)
    ]
    assert [process.wait(120) for process in running] == [0, 0]
    (path,) = tmp_path.iterdir()
    assert same(
        read_shape(path, path.stem),
        dataclasses.replace(load_shape(BUCKET, cache=ShapeCache(None)), notes=()),
    )


def test_where_it_is_kept(tmp_path: Path) -> None:
    home = Path.home() / ".cache" / "rampe-guard"
    assert default_cache({"RAMPE_GUARD_CACHE": ""}).folder is None
    assert default_cache({"RAMPE_GUARD_CACHE": str(tmp_path)}).folder == tmp_path
    assert default_cache({"XDG_CACHE_HOME": str(tmp_path)}).folder == tmp_path / "rampe-guard"
    assert default_cache({"XDG_CACHE_HOME": "relative"}).folder == home
    assert default_cache({}).folder == home


def test_bad_files_and_scales_are_refused_not_kept(tmp_path: Path) -> None:
    cache = ShapeCache(tmp_path / "cache")
    file = write_stl(tmp_path / "m.stl", 1000.0 * box_triangles((3, 1, 1)))
    with pytest.raises(GeometryError, match=r"m\.stl: is 3000 m long.*scale of 0\.001"):
        load_shape(file, most_m=200.0, cache=cache)
    assert load_shape(file, 1e-3, most_m=200.0, cache=cache).extent_m == pytest.approx(3.0)
    with pytest.raises(GeometryError, match="scaled twice"):
        load_shape(file, 1e-7, cache=cache)
    for scale in (0.0, np.nan, np.inf):
        with pytest.raises(GeometryError, match="a scale of"):
            load_shape(file, scale, cache=cache)
    with pytest.raises(GeometryError, match="no such mesh file"):
        load_shape(tmp_path / "none.stl", cache=cache)
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_a_gltf_that_is_not_all_there_is_kept_nowhere(tmp_path: Path) -> None:
    cache = ShapeCache(tmp_path / "cache")
    exported = trimesh.creation.box().export(file_type="gltf")
    for name, data in exported.items():
        (tmp_path / name).write_bytes(data)
    gone = tmp_path / min(name for name in exported if name.endswith(".bin"))
    content = gone.read_bytes()
    gone.unlink()
    with pytest.raises(GeometryError, match=rf"model\.gltf: .*{gone.name} cannot be read"):
        load_shape(tmp_path / "model.gltf", cache=cache)
    assert not (tmp_path / "cache").exists()
    gone.write_bytes(content)
    assert load_shape(tmp_path / "model.gltf", cache=cache).triangles == 12


def test_progress_is_told_of_both_ways(tmp_path: Path) -> None:
    cache = ShapeCache(tmp_path)
    for expected in ("built", "kept from before"):
        told: list[tuple[str, float]] = []
        load_shape(BUCKET, cache=cache, progress=lambda what, share: told.append((what, share)))  # noqa: B023
        assert told[-1] == (expected, 1.0)


def test_a_placed_tree_holds_the_placed_mesh() -> None:
    mesh = box_mesh(np.array([1.0, 2, 3]))
    pose = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [4, 5, 6])
    tree = placed(shape_of(mesh).tree, pose)
    assert np.allclose(tree.vertices, mesh.moved(pose).vertices)
    shape = shape_of(load_mesh(BUCKET))
    there = placed(shape.tree, pose)
    assert np.allclose(
        there.corners.reshape(-1, 3),
        shape.tree.corners.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3],
    )
    reach = np.linalg.norm(
        there.vertices - np.repeat(there.ball[:, :3], there.count, axis=0), axis=1
    )
    grown = reach + np.repeat(there.radius, there.count)
    assert (grown <= np.repeat(there.ball[:, 3], there.count)).all()
    assert placed(shape.tree, np.eye(4)) is shape.tree
