"""`scene diff` and `scene export`: what is protected less comes first; a model keeps the names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.scene import ActuatorLimit, Box, Capsule, Cylinder, SolidObject, Sphere
from rampe_guard.resources import shipped_site
from rampe_guard.scene_tools.given_up import given_up_m
from rampe_guard.settings import parse_scene
from tests.support.depth import depth
from tests.support.scene_files import away_m, run

BEFORE = """\
margin_m: 0.3
objects:
  - {name: wall, type: box, size: [1, 4, 2], pose: {xyz: [5, 0, 1]}}
  - {name: tank, type: sphere, radius_m: 1, center: [0, 5, 1], margin_m: 0.5}
  - {name: line, type: capsule, from: [0, -8, 6], to: [5, -8, 6], radius_m: 0.1, margin_m: 2}
  - {name: slew, type: actuator_limit, actuator: swing, above: 1.2}
"""


def scene(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def diff(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *changes: tuple[str, str]
) -> tuple[int, dict[str, Any]]:
    """Exit code and JSON of what happens when the text is changed so."""
    text = BEFORE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    files = scene(tmp_path / "a.yaml", BEFORE), scene(tmp_path / "b.yaml", text)
    code = run("diff", *files, "--json")
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return code, found


def test_the_same_scene_is_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, found = diff(tmp_path, capsys, ("margin_m: 0.3\n", "margin_m: 0.30  # [m]\n"))
    assert (code, found["same"], found["changes"]) == (0, True, [])


def test_what_is_protected_less_comes_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes = (
        ("size: [1, 4, 2]", "size: [2, 4, 2]"),
        ("margin_m: 2}", "margin_m: 1.5}"),
        ("above: 1.2", "above: 1.4"),
        ("name: tank", "name: gas tank"),
    )
    code, found = diff(tmp_path, capsys, *changes)
    assert code == 1
    kinds = [
        (change["kind"], change["name"], bool(change["weaker"])) for change in found["changes"]
    ]
    assert kinds == [
        ("changed", "line", True),
        ("changed", "slew", True),
        ("renamed", "tank", False),
        ("changed", "wall", False),
    ]
    line, slew, _, wall = found["changes"]
    assert line["given_up_m"] == pytest.approx(0.5)
    assert slew["weaker"] == ["above 1.2 -> 1.4"]
    assert wall["fields"] == [{"field": "size_m", "old": [1, 4, 2], "new": [2, 4, 2]}]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("xyz: [5, 0, 1]", "xyz: [5, 0.25, 1]", "moved 0.25 m"),
        ("xyz: [5, 0, 1]", "xyz: [5, 0, 1], rpy: [0, 0, 0.5]", "turned 28.6 deg"),
        ("margin_m: 0.5}", "margin_m: 0.5, ignore_links: [boom]}", "! ignore_links"),
        ("  - {name: slew, type: actuator_limit, actuator: swing, above: 1.2}\n", "", "removed"),
        ("actuator: swing", "actuator: boom", "! is of another actuator"),
        ("radius_m: 1,", "radius_m: 0.9,", "any more: up to 0.1 m"),
    ],
)
def test_it_is_said_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, says: str
) -> None:
    assert old in BEFORE
    a, b = scene(tmp_path / "a.yaml", BEFORE), scene(tmp_path / "b.yaml", BEFORE.replace(old, new))
    assert run("diff", a, b) == 1
    said = capsys.readouterr().out
    assert said.startswith("LESS PROTECTED: 1 of 1 changes")
    assert says in said


def test_a_wrong_file_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("diff", scene(tmp_path / "a.yaml", BEFORE), tmp_path / "none.yaml") == 2
    assert "none.yaml" in capsys.readouterr().err


def test_a_site_is_taken_for_its_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("diff", shipped_site("demo"), shipped_site("demo")) == 0
    assert capsys.readouterr().out == "the same objects\n"


length = st.floats(0.1, 2.0)
place = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@st.composite
def solid(draw: st.DrawFn) -> SolidObject:
    kind = draw(st.sampled_from(["box", "sphere", "capsule", "cylinder"]))
    x, y, z = draw(place)
    pose = f"pose: {{xyz: [{x}, {y}, {z}], rpy: {list(draw(place))}}}"
    sizes = [draw(length) for _ in range(3)]
    words = {
        "box": f"size: {sizes}, {pose}",
        "sphere": f"radius_m: {sizes[0]}, center: [{x}, {y}, {z}]",
        "capsule": f"radius_m: {sizes[0]}, from: [{x}, {y}, {z}], to: [{sizes[1]}, 2, {sizes[2]}]",
        "cylinder": f"radius_m: {sizes[0]}, height_m: {sizes[1]}, {pose}",
    }[kind]
    margin = draw(st.floats(0.0, 1.0))
    text = f"objects:\n- {{name: a, type: {kind}, margin_m: {margin}, {words}}}\n"
    (item,) = parse_scene(text).objects
    assert not isinstance(item, ActuatorLimit)
    return item


@settings(max_examples=depth(40, 1000), deadline=None, derandomize=True)
@given(solid(), solid(), st.integers(0, 2**32 - 1))
def test_no_space_is_given_up_beyond_what_is_told(
    old: SolidObject, new: SolidObject, seed: int
) -> None:
    told = given_up_m(old, new)
    points = np.random.default_rng(seed).uniform(-4.0, 4.0, (400, 3))
    kept = points[away_m(points, old) <= old.margin_m]
    beyond = away_m(kept, new) - new.margin_m
    assert (beyond <= told + 1e-6).all()
    if beyond.size and told == 0.0:
        assert beyond.max() <= 1e-6


@settings(max_examples=depth(10, 200), deadline=None, derandomize=True)
@given(solid())
def test_nothing_is_given_up_by_what_stays(item: SolidObject) -> None:
    slack = 2e-3 * item.radius_m if isinstance(item, Cylinder) else 1e-9  # a solid round it
    assert given_up_m(item, item) <= slack
    assert isinstance(item, Box | Sphere | Capsule | Cylinder)


def test_a_model_is_read_again_with_all_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "m.glb"
    assert run("export", scene(tmp_path / "a.yaml", BEFORE), out) == 0
    assert "not drawn: slew" in capsys.readouterr().err
    model = trimesh.load_scene(out)
    names = {f"{name}{end}" for name in ("wall", "tank", "line") for end in ("", " margin")}
    assert set(model.graph.nodes_geometry) == names
    turn, geometry = model.graph["wall"]
    low, high = trimesh.transform_points(model.geometry[geometry].bounds, turn)
    assert np.minimum(low, high) == pytest.approx([4.5, 0, -2])  # glTF: y is up
    assert np.maximum(low, high) == pytest.approx([5.5, 2, 2])
    assert model.geometry[model.graph["wall margin"][1]].visual.material.alphaMode == "BLEND"


def test_a_model_of_a_site_has_the_arm(tmp_path: Path) -> None:
    out = tmp_path / "m.glb"
    assert run("export", shipped_site("bench"), out) == 0
    names = set(trimesh.load_scene(out).graph.nodes_geometry)
    assert {"crate", "crate margin", "ceiling"} <= names
    assert any(name.startswith("arm ") for name in names)
    assert run("export", shipped_site("bench"), tmp_path / "m.stl") == 2
