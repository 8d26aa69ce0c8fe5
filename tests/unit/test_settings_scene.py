"""Scene files: every kind of object, and what is refused."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.scene import (
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    Mesh,
    Sphere,
)
from rampe_guard.errors import SettingsError
from rampe_guard.settings import load_scene, parse_scene

ALL = """\
frame: world
margin_m: 0.30
objects:
  - {name: power-line, type: capsule, from: [4, -6, 5.2], to: [4, 6, 5.2], radius_m: 0.05,
     margin_m: 3.0}
  - {name: cab-wall, type: box, size: [4, 0.3, 2.5], pose: {xyz: [6, 0, 1.25], rpy: [0, 0, 1]}}
  - {name: silo, type: cylinder, radius_m: 2, height_m: 8}
  - {name: ground, type: halfspace, normal: [0, 0, 2], offset_m: 1, margin_m: 0,
     ignore_links: [bucket, track]}
  - {name: ball, type: sphere, radius_m: 1, center: [1, 2, 3]}
  - {name: terrain, type: mesh, file: ground.stl, scale: 0.001, open: true}
  - {name: road-side, type: actuator_limit, actuator: boom, above: 1.2, below: -1}
"""


def one(line: str) -> str:
    return f"objects:\n  - {{name: a, {line}}}\n"


def refusal(content: bytes | str, **options: object) -> str:
    with pytest.raises(SettingsError) as caught:
        parse_scene(content, actuators=("swing", "boom"), name="s.yaml", **options)  # type: ignore[arg-type]
    return str(caught.value)


def test_every_kind_of_object(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(ALL, encoding="utf-8")
    (tmp_path / "ground.stl").write_bytes(b"solid")
    scene = load_scene(tmp_path / "scene.yaml", actuators=("swing", "boom"))
    line, wall, silo, ground, ball, terrain, road = scene.objects
    assert line == Capsule(
        name="power-line", margin_m=3.0, radius_m=0.05, start_m=(4, -6, 5.2), end_m=(4, 6, 5.2)
    )
    assert isinstance(wall, Box)
    assert (wall.size_m, wall.margin_m) == ((4, 0.3, 2.5), 0.3)
    assert wall.pose[:3, 3] == pytest.approx([6, 0, 1.25])
    assert wall.pose[:2, 0] == pytest.approx([math.cos(1), math.sin(1)])
    assert isinstance(silo, Cylinder)
    assert np.array_equal(silo.pose, np.eye(4))
    assert ground == Halfspace(
        name="ground", margin_m=0.0, ignore_links=("bucket", "track"), normal=(0, 0, 1),
        offset_m=0.5,
    )  # fmt: skip
    assert ball == Sphere(name="ball", margin_m=0.3, radius_m=1, center_m=(1, 2, 3))
    assert isinstance(terrain, Mesh)
    assert (terrain.file, terrain.scale) == (str(tmp_path / "ground.stl"), 0.001)
    assert terrain.open
    assert road == ActuatorLimit(name="road-side", actuator=1, above=1.2, below=-1)
    assert scene.path == str(tmp_path / "scene.yaml")
    assert scene.content_hash == hashlib.sha256(ALL.encode() + b"solid").hexdigest()


def test_rpy_is_roll_then_pitch_then_yaw_about_fixed_axes() -> None:
    scene = parse_scene(one("type: box, size: [1, 1, 1], pose: {rpy: [0.3, -0.4, 0.5]}"))
    (box,) = scene.objects
    assert isinstance(box, Box)
    (cr, cp, cy), (sr, sp, sy) = np.cos([0.3, -0.4, 0.5]), np.sin([0.3, -0.4, 0.5])
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    assert box.pose[:3, :3] == pytest.approx(yaw @ pitch @ roll)


def test_scene_from_text_has_no_path_and_poses_are_read_only() -> None:
    scene = parse_scene(one("type: cylinder, radius_m: 1, height_m: 1").encode())
    (cylinder,) = scene.objects
    assert scene.path == ""
    assert isinstance(cylinder, Cylinder)
    assert cylinder.margin_m == 0.0
    with pytest.raises(ValueError, match="read-only"):
        cylinder.pose[0, 0] = 2.0


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("type: box, size: [1, 1]", "s.yaml:2: objects[0].size: a list of 2 is too short"),
        ("type: box, size: [1, 1, 0]", "objects[0].size[2]: 0 is not greater than"),
        ("type: box, size: [1, 1, 1e300]", "objects[0].size[2]: 1e+300 is greater than 100000"),
        ("type: sphere, radius_m: 1", "objects[0].center: is missing; give the centre x, y, z"),
        ("type: sphere, radius_m: 1, center: [0, .nan, 0]", "center[1]: nan is not a finite"),
        ("type: blob", "objects[0].type: 'blob' is not known; known here: 'box'"),
        ("type: [box]", "objects[0].type: "),
        ("radius_m: 1", "objects[0].type: is missing; give one of box, sphere"),
        ("type: box, size: [1, 1, 1], margin_m: -1", "margin_m: -1 is less than 0"),
        ("type: box, size: [1, 1, 1], sise: 2", "sise: is not a known key; "),
        ("type: halfspace, normal: [0, 0, 0]", "has no direction"),
        ("type: mesh, file: none.stl", "objects[0].file: 'none.stl' does not exist"),
        ("type: mesh, file: notes.txt", "is not a mesh by its ending; give a file in .stl"),
        (f"type: mesh, file: {'a' * 1000}.stl", "cannot be read"),
        (
            "type: actuator_limit, actuator: bom, above: 1",
            "objects[0].actuator: 'bom' is not an actuator of the site; did you mean 'boom'?",
        ),
        ("type: actuator_limit, actuator: boom", "has neither above nor below"),
        ("type: actuator_limit, actuator: boom, above: 1, below: 2", "leave no room"),
    ],
)
def test_mistake_is_named(line: str, expected: str, tmp_path: Path) -> None:
    assert expected in refusal(one(line), directory=tmp_path)


def test_names_are_unique_and_not_the_guards_own() -> None:
    ball = "{name: a, type: sphere, radius_m: 1, center: [0, 0, 0]}"
    text = refusal(f"objects:\n  - {ball}\n  - {ball}\n")
    assert "s.yaml:3: objects[1].name: 'a' is the name of another object (line 2)" in text
    text = refusal(f"objects:\n  - {ball.replace('a,', 'system,')}\n")
    assert "'system' is the zone of the guard's own alerts" in text


def test_scene_without_objects_is_refused() -> None:
    assert "objects: is missing" in refusal("margin_m: 1\n")
    assert "objects: a list of 0 is too short" in refusal("objects: []\n")
