"""`scene import`: MoveIt scenes, meshes, clouds and plans become scenes that the loader takes."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest
import trimesh

from rampe_guard.assembly import load_machine
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, Sphere
from rampe_guard.resources import shipped_site
from rampe_guard.scene_tools.cloud import CloudWishes, import_cloud
from rampe_guard.scene_tools.draft import Common, Names
from rampe_guard.settings import load_site
from tests.support.scene_files import (
    MOVEIT,
    MOVEIT_OLD,
    away_m,
    feature,
    plan,
    read,
    run,
)

SQUARE = [[[4, -1], [6, -1], [6, 1], [4, 1], [4, -1]]]
CUT = [
    [[4, -1], [8, -1], [8, 3], [6, 3], [6, 1], [4, 1], [4, -1]],
    [[6.5, 0], [7, 0], [7, 1], [6.5, 0]],
]


def moveit(tmp_path: Path, text: str = MOVEIT) -> Path:
    path = tmp_path / "in.scene"
    path.write_text(text, encoding="utf-8")
    return path


def las(path: Path, points: np.ndarray) -> Path:
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.zeros(3)
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    data.write(path)
    return path


def test_a_moveit_scene_of_today(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "s.yaml"
    assert run("import", moveit(tmp_path), "--out", out, "--margin-m", 0.2) == 0
    top, leg, cone, wedge, floor = read(out).scene.objects
    assert isinstance(top, Box)
    assert isinstance(leg, Cylinder)
    assert (top.name, leg.name, top.margin_m) == ("table top", "table top-2", 0.2)
    assert (leg.radius_m, leg.height_m) == (0.05, 0.5)
    assert leg.pose[:3, 3] == pytest.approx([1, 2, 0.2])
    corner = np.array([[1 + 1.0, 2 + 0.5, 0.55], [1 + 0.5, 2 + 1.0, 0.55]])  # turned by 90 degrees
    assert away_m(corner, top) == pytest.approx([0.0, 0.5], abs=1e-6)
    assert isinstance(cone, Mesh)
    tip = np.array([[3, 0, 1.0 - 1e-6], [3.49, 0, 0.01], [3.4, 0, 0.9]])
    assert (away_m(tip, cone) > 0.0).tolist() == [False, False, True]
    assert isinstance(wedge, Mesh)
    assert away_m(np.array([[-2.9, 3.1, 0.1]]), wedge) == pytest.approx([0.0])
    assert isinstance(floor, Halfspace)
    assert (floor.normal, floor.offset_m) == ((0, 0, 1), 0)
    said = capsys.readouterr().err
    assert "octomap" in said
    assert "subframes" in said
    assert "two sides" in said


def test_a_moveit_scene_of_before(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "s.yaml"
    where = ("--xyz", 0, 0, 1, "--rpy", 0, 0, math.pi / 2)
    assert run("import", moveit(tmp_path, MOVEIT_OLD), "--out", out, *where) == 0
    ball, sheet = read(out).scene.objects
    assert isinstance(ball, Sphere)
    assert ball.center_m == pytest.approx((0, 1, 1.5))
    assert isinstance(sheet, Box)
    assert sheet.size_m[2] == 0.001
    said = capsys.readouterr().err
    assert "is made 0.001" in said
    assert "margin_m is 0" in said


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("1 2 0.1\n", "1 nan 0.1\n", "in.scene:7: 'nan' where a finite number"),
        ("1 2 0.1\n", "1 -2 0.1\n", "a size of -2 m"),
        ("\n.\n", "\n", "cut off"),
        ("4 4\n", "4000000000 4\n", "where a finite number"),
        ("0 3 2\n", "0 3 9\n", "names vertex 9 of 4"),
        ("cylinder", "octree", "a shape 'octree'"),
        ("* cone", "cone", "where '*'"),
        ("0 0 0.70710678 0.70710678", "0 0 0 0", "quaternion of length 0"),
        ("0 3 2\n1 2 3\n", "0 3 2\n0 3 2\n", "is not closed"),
        ("1 2 0.1\n", "1e300 2 0.1\n", "size[0]"),
    ],
)
def test_what_is_wrong_with_a_moveit_scene_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, says: str
) -> None:
    assert old in MOVEIT
    out = tmp_path / "s.yaml"
    assert run("import", moveit(tmp_path, MOVEIT.replace(old, new, 1)), "--out", out) == 2
    assert says in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["in.scene"]  # nothing half written


def test_a_mesh_in_millimetres_with_y_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    box = trimesh.creation.box((1000.0, 3000.0, 2000.0))
    box.export(tmp_path / "part.stl")
    box.export(tmp_path / "part.glb")
    out = tmp_path / "s.yaml"
    assert run("import", tmp_path / "part.stl", "--out", out, "--up", "y") == 0
    assert "millimetres" in capsys.readouterr().err
    how = ("--scale", 0.001, "--name", "tank", "--margin-m", 0.5, "--ignore-link", "boom")
    assert run("import", tmp_path / "part.glb", "--out", out, "--append", *how) == 0
    first, tank = read(out).scene.objects
    assert isinstance(tank, Mesh)
    assert (first.name, tank.name) == ("part", "tank")
    assert (tank.margin_m, tank.ignore_links, tank.scale) == (0.5, ("boom",), 1.0)
    held = away_m(np.array([[0.49, 0.99, 1.49], [0, 0, 1.6]]), tank)
    assert held == pytest.approx([0.0, 0.1], abs=1e-6)


def test_an_open_mesh_is_refused_hulled_or_a_surface(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    box = trimesh.creation.box((1, 1, 1))
    trimesh.Trimesh(box.vertices, box.faces[:-1], process=False).export(tmp_path / "open.obj")
    out = tmp_path / "s.yaml"
    assert run("import", tmp_path / "open.obj", "--out", out) == 2
    assert "--if-open hull" in capsys.readouterr().err
    assert run("import", tmp_path / "open.obj", "--out", out, "--if-open", "surface") == 0
    (surface,) = read(out).scene.objects
    assert isinstance(surface, Mesh)
    assert surface.open
    assert run("import", tmp_path / "open.obj", "--out", out, "--if-open", "hull") == 2
    assert "--replace" in capsys.readouterr().err
    how = ("--replace", "--if-open", "hull")
    assert run("import", tmp_path / "open.obj", "--out", out, *how) == 0
    (hull,) = read(out).scene.objects
    assert away_m(np.array([[0.0, 0.0, 0.0]]), hull) == pytest.approx([0.0])


def cloud_points() -> np.ndarray:
    rng = np.random.default_rng(5)
    wall = np.column_stack([np.full(3000, 3.02), rng.uniform(-2, 2, 3000), rng.uniform(0, 2, 3000)])
    ground = np.column_stack([rng.uniform(-4, 4, (2000, 2)), rng.normal(0, 0.01, 2000)])
    return np.concatenate([wall, ground, [[0.5, -3.0, 1.77]]])


@pytest.mark.parametrize("kind", ["las", "ply", "ascii.ply", "xyz", "csv"])
def test_a_cloud_of_every_kind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    points = np.round(cloud_points(), 3)
    file = tmp_path / f"cloud.{kind}"
    if kind == "las":
        las(file, points)
    elif "ply" in kind:
        encoding = "ascii" if "ascii" in kind else "binary"
        file.write_bytes(trimesh.PointCloud(points).export(file_type="ply", encoding=encoding))
    elif kind == "xyz":
        np.savetxt(file, points, header="x y z")
    else:
        np.savetxt(file, points, delimiter=",", header="x,y,z", comments="")
    out = tmp_path / "s.yaml"
    assert run("import", file, "--out", out, "--ground", 0.1, "--voxel", 0.25) == 0
    objects = read(out).scene.objects
    away = np.min([away_m(points[::7], item) for item in objects], axis=0)
    assert not away.any()
    assert isinstance(objects[0], Halfspace)
    said = capsys.readouterr().err
    assert f"{len(points)} points" in said
    assert "LEFT OUT" not in said
    assert "1 voxels stand alone" in said
    assert "times the" in said


def test_what_is_done_to_a_cloud_is_told_while_it_is_done(tmp_path: Path) -> None:
    file = tmp_path / "c.xyz"
    np.savetxt(file, cloud_points())
    told: list[str] = []
    import_cloud(file, Names(), Common(), CloudWishes(0.1, 20), tell=told.append)
    assert told[0] == f"{file}: 5,001 points read"
    assert all(f"{file}: joining " in text for text in told[1:])
    assert "voxels of 0.1 m to at most 20 boxes" in told[1]
    assert "voxels of 0.2 m to at most 20 boxes" in told[2]


def test_notes_are_told_even_if_nothing_can_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "c.xyz", tmp_path / "s.yaml"
    np.savetxt(file, cloud_points())
    out.write_text(
        "objects:\n  - {name: a, type: sphere, radius_m: 1, center: [0, 0, 9]}\nmargin_m: 0\n"
    )
    assert run("import", file, "--out", out, "--append") == 2
    first, *_, last = capsys.readouterr().err.splitlines()
    assert first.startswith(f"note: {file}: 5001 points")
    assert str(out) in last


def test_what_is_left_out_of_a_cloud_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = las(tmp_path / "c.las", cloud_points()), tmp_path / "s.yaml"
    how = ("--ground", 0.1, "--crop", -3.5, -3.5, -1, 3.5, 3.5, 3, "--min-points", 2)
    assert run("import", file, "--out", out, *how, "--max-objects", 20) == 0
    said = capsys.readouterr().err
    assert "lie outside of --crop: LEFT OUT" in said
    assert "the first near 0.50 -3.00 1.70): LEFT OUT" in said
    assert "instead of 0.1 m, so that 19 objects" in said
    assert len(read(out).scene.objects) <= 20


def test_points_of_the_arm_itself_are_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rampe_guard.dashboard.model import load_model  # noqa: PLC0415

    site = shipped_site("bench")
    model = load_model(load_site(site))
    at = np.array([0.3, *model.arm.limits[1:].mean(axis=1)])
    poses = model.poses(at[None])[0]
    own = np.concatenate(
        [
            body.vertices @ pose[:3, :3].T + pose[:3, 3]
            for body, pose in zip(model.bodies, poses, strict=True)
            if body is not None
        ]
    )
    post = np.array([[2.0, 2.0, 0.1 * k] for k in range(10)])
    np.savetxt(tmp_path / "c.xyz", np.concatenate([own, post]))
    out = tmp_path / "s.yaml"
    how = ("--without-arm", site, "--arm-margin-m", 0.08, "--at", *at)
    assert run("import", tmp_path / "c.xyz", "--out", out, *how) == 0
    assert f"{len(own)} points are the arm's own" in capsys.readouterr().err
    objects = read(out).scene.objects
    assert not np.min([away_m(post, item) for item in objects], axis=0).any()
    assert run("import", tmp_path / "c.xyz", "--out", tmp_path / "t.yaml", *how[:2]) == 2
    assert "--at: nothing" in capsys.readouterr().err


PLY = b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n"
XYZ = b"property float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("c.xyz", b"0 0 0\n1 nan 1\n", "point 2 is [1.0, nan, 1.0], not finite"),
        ("c.xyz", b"0 0 0\n1 x 1\n", "give lines of x y z"),
        ("c.xyz", b"", "holds no points"),
        ("c.xyz", b"500000 5000000 3\n", "give the --xyz"),
        ("c.xyz", b"0 0 0\n1e300 1 1\n", "give the --xyz"),
        ("c.las", b"LASF", "cannot be read as LAS"),
        ("c.las", b"LASF" + b"\xff" * 400, "cannot be read as LAS"),
        ("c.laz", b"", "it has no LAS header"),
        ("c.ply", PLY + XYZ + b"\0" * 12, "names 9 points and ends after 1"),
        ("c.ply", PLY + b"end_header\n", "no x, y, z"),
        ("c.ply", b"plx", "is no PLY file"),
        ("c.ply", PLY.replace(b"9", b"9" * 11) + XYZ, "points; more than"),
        ("c.ply", PLY + b"property list uchar int x\nend_header\n", "hold lists"),
        ("c.what", b"", "say what it is with --kind"),
    ],
)
def test_what_is_wrong_with_a_cloud_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: bytes, says: str
) -> None:
    (tmp_path / name).write_bytes(content)
    assert run("import", tmp_path / name, "--out", tmp_path / "s.yaml") == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert not (tmp_path / "s.yaml").exists()


def test_beams_without_an_echo_are_left_out_if_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = PLY.replace(b"9", b"2") + XYZ + struct.pack("<6f", 1, 2, 3, *[math.nan] * 3)
    (tmp_path / "c.ply").write_bytes(data)
    assert run("import", tmp_path / "c.ply", "--out", tmp_path / "s.yaml", "--skip-invalid") == 0
    assert "1 points are not finite (--skip-invalid): LEFT OUT" in capsys.readouterr().err


def test_a_plan_in_metres(tmp_path: Path) -> None:
    file = plan(
        tmp_path / "p.geojson",
        feature("Polygon", SQUARE, name="shed", height_m=3, base_m=0.5, margin_m=1),
        feature("Polygon", CUT, name="hall", height_m=6),
        feature("MultiLineString", [[[0, 9], [5, 9]], [[5, 9], [9, 12]]], height_m=2, width_m=0.1),
        feature("LineString", [[0, -9, 7], [9, -9, 6]], name="line", radius_m=0.05),
        feature("MultiPoint", [[0, 5], [1, 5]], name="mast", radius_m=0.2, height_m=8),
        feature("Point", [0, 6, 2], name="lamp", radius_m=0.3),
    )
    out = tmp_path / "s.yaml"
    where = ("--xyz", 10, 0, 1)
    assert run("import", file, "--out", out, "--metres", "--margin-m", 0.3, *where) == 0
    objects = {item.name: item for item in read(out).scene.objects}
    kinds = {name: type(item) for name, item in objects.items()}
    assert kinds == {
        "shed": Box, "hall": Mesh, "p-linestring": Box, "p-linestring-2": Box, "line": Capsule,
        "mast": Cylinder, "mast-2": Cylinder, "lamp": Sphere,
    } or kinds["p-linestring"] is Mesh  # fmt: skip
    shed, hall, lamp = (objects[name] for name in ("shed", "hall", "lamp"))
    assert isinstance(shed, Box)
    assert isinstance(lamp, Sphere)
    assert (shed.margin_m, lamp.margin_m) == (1, 0.3)
    assert shed.pose[:3, 3] == pytest.approx([15, 0, 3])
    assert shed.size_m == pytest.approx((2.002, 2.002, 3))
    there = np.array([[17.9, 2.9, 6.9], [15, 0, 2], [15, 2, 3], [16.9, 0.3, 3]])
    assert away_m(there, hall)[:2] == pytest.approx([0, 0])
    assert away_m(there, hall)[2] == pytest.approx(1, abs=2e-3)  # the notch
    assert away_m(there, hall)[3] > 0.02  # the court
    assert lamp.center_m == (10, 6, 3)


@pytest.mark.parametrize(
    ("features", "options", "says"),
    [
        ([feature("Polygon", SQUARE, height_m=3)], (), "may be degrees"),
        ([feature("Polygon", SQUARE, height_m=3)], ("--origin", 100, 0), "km from --origin"),
        ([feature("Point", [200, 99], radius_m=1)], ("--origin", 1, 2), "are no degrees"),
        ([feature("Polygon", SQUARE)], ("--metres",), "height_m of a Polygon is missing"),
        ([feature("Polygon", SQUARE, height_m="3")], ("--metres",), "height_m is '3'"),
        ([feature("Polygon", SQUARE, height_m=-3)], ("--metres",), "height_m is -3"),
        ([feature("LineString", [[0, 0], [1, 1]], radius_m=1)], ("--metres",), "hangs somewhere"),
        ([feature("LineString", [[0, 0]], width_m=1, height_m=1)], ("--metres",), "of one point"),
        (
            [feature("Polygon", [[[0, 0], [2, 2], [2, 0], [0, 2], [0, 0]]], name="x", height_m=1)],
            ("--metres",),
            "features[0] ('x'): the outline is not valid (Self-intersection",
        ),
        ([feature("Polygon", [[[0, 0], [2, 2]]], height_m=1)], ("--metres",), "three corners"),
        ([feature("Polygon", [], height_m=1)], ("--metres",), "without coordinates"),
        ([feature("Point", [1e300, 0], radius_m=1)], ("--metres",), "finite numbers"),
        ([feature("Point", [1e7, 0], radius_m=1)], ("--metres",), "near to the machine"),
        ([feature("Point", "here", radius_m=1)], ("--metres",), "a list of coordinates"),
        ([feature("Circle", [0, 0], radius_m=1)], ("--metres",), "geometry 'Circle'"),
        ([], ("--metres",), "holds no point"),
    ],
)
def test_what_is_wrong_with_a_plan_is_said(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    features: list[dict[str, object]],
    options: tuple[object, ...],
    says: str,
) -> None:
    file = plan(tmp_path / "p.geojson", *features)
    assert run("import", file, "--out", tmp_path / "s.yaml", *options) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    "content", [b"", b"[1]", b"{", b'{"type": "Feature"}', b"NaN", b"[" * 100_000, b"\xff\xfe"]
)
def test_what_is_no_plan_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "p.json").write_bytes(content)
    assert run("import", tmp_path / "p.json", "--out", tmp_path / "s.yaml", "--metres") == 2


def test_a_plan_in_degrees_by_its_origin(tmp_path: Path) -> None:
    # at 45 degrees north a degree is 111131.8 m to the north and 78846.8 m to the east (WGS 84)
    lon, lat = 10.0 + 300.0 / 78846.81, 45.0 + 400.0 / 111131.75
    file = plan(tmp_path / "p.geojson", feature("Point", [lon, lat], radius_m=1, name="far"))
    assert run("import", file, "--out", tmp_path / "s.yaml", "--origin", 10, 45) == 0
    (far,) = read(tmp_path / "s.yaml").scene.objects
    assert isinstance(far, Sphere)
    assert far.center_m[:2] == pytest.approx((300, 400), abs=0.05)  # the meridians come together


def test_an_option_that_means_nothing_here_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("import", moveit(tmp_path), "--out", tmp_path / "s.yaml", "--voxel", 0.1) == 2
    assert "--voxel means nothing for a moveit" in capsys.readouterr().err


def test_objects_are_added_to_a_file_that_a_person_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "s.yaml"
    own = (
        "margin_m: 0.4\nobjects:   # ours\n- name: ball\n  type: sphere\n  radius_m: 1\n"
        "  center: [0, 0, 0]\n- {name: slew, type: actuator_limit, actuator: swing, above: 1}\n"
    )
    out.write_text(own, encoding="utf-8")
    assert run("import", moveit(tmp_path, MOVEIT_OLD), "--out", out, "--append") == 0
    assert out.read_text("utf-8").startswith(own)
    names = [item.name for item in read(out).scene.objects]
    assert names == ["ball", "slew", "ball-2", "ball-3"]
    out.write_text(f"{own}frame: world\n", encoding="utf-8")
    assert run("import", moveit(tmp_path, MOVEIT_OLD), "--out", out, "--append") == 2
    assert out.read_text("utf-8") == f"{own}frame: world\n"
    assert "s.yaml" in capsys.readouterr().err


def test_a_guard_sweeps_against_all_that_was_imported(tmp_path: Path) -> None:
    out = tmp_path / "s.yaml"
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "crate.obj")
    assert run("import", moveit(tmp_path), "--out", out, "--xyz", 9, 9, -9) == 0
    assert run("import", tmp_path / "crate.obj", "--out", out, "--append") == 0
    cloud = las(tmp_path / "c.las", cloud_points() + np.array([9, 9, 0]))
    assert run("import", cloud, "--out", out, "--append", "--max-objects", 30) == 0
    hall = plan(tmp_path / "p.json", feature("Polygon", CUT, name="hall", height_m=6))
    assert run("import", hall, "--out", out, "--append", "--metres") == 0
    site = load_site(shipped_site("bench"))
    machine = load_machine(replace(site, scene=read(out).scene))
    assert len(machine.sweeper.zones) == len(read(out).scene.objects) > 10
    pose = machine.arm.limits[:, :].copy()
    pose[~np.isfinite(pose)] = 0.0
    here = machine.sweeper.sweep(pose.mean(axis=1), np.zeros(len(pose)))
    assert {zone.zone for zone in here.zones} >= {"hall", "crate", "cone"}
    near = {zone.zone: zone for zone in here.zones}
    assert near["crate"].inside or (near["crate"].clearance_now_m or 0.0) < 1.0
    assert (near["hall"].clearance_now_m or 0.0) > 2.0
