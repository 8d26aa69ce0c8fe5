"""Objects that move and the arm against itself: what the files may say of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import pytest

from rampe_guard.core.scene import Box, SelfCollision, Sphere
from rampe_guard.errors import SettingsError
from rampe_guard.settings import Site, load_site, parse_scene, scene_schema

BALL = "name: ball, type: sphere, radius_m: 1, center: [0, 0, 2]"
TRUCK = """\
margin_m: 0.5
objects:
  - {name: ground, type: halfspace, normal: [0, 0, 1]}
  - name: truck-1
    type: box
    size: [8, 2.5, 3.5]
    pose: {xyz: [4, 0, 1.75]}
    key: rampe/site/truck-1/pose
    max_speed: 8
    timeout_s: 0.5
"""
SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard}
inputs: {joystick: {on_change: true, alive_key: r/lever}}
arm:
  urdf: arm.urdf
  actuators:
    - {name: swing, joint: swing_joint, max_velocity: 0.6}
scene: scene.yaml
"""


def objects(*lines: str) -> str:
    return "objects:\n" + "".join(f"  - {{{line}}}\n" for line in lines)


def refusal(text: str) -> str:
    with pytest.raises(SettingsError) as caught:
        parse_scene(text, actuators=("swing",), name="s.yaml")
    return str(caught.value)


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Site]:
    (tmp_path / "arm.urdf").write_text("<robot name='arm'/>", encoding="utf-8")

    def write_and_load(site: str = "", scene: str = TRUCK) -> Site:
        (tmp_path / "scene.yaml").write_text(scene, encoding="utf-8")
        (tmp_path / "site.yaml").write_text(SITE + site, encoding="utf-8")
        return load_site(tmp_path / "site.yaml")

    return write_and_load


def test_an_object_with_a_key_moves_and_the_others_do_not() -> None:
    scene = parse_scene(TRUCK)
    ground, truck = scene.objects
    assert isinstance(truck, Box)
    assert (truck.key, truck.max_speed, truck.timeout_s) == ("rampe/site/truck-1/pose", 8.0, 0.5)
    assert truck.pose[:3, 3] == pytest.approx([4, 0, 1.75])  # in its own frame
    assert scene.moving == (truck,)
    assert ground not in scene.moving


def test_the_time_out_has_a_default() -> None:
    (ball,) = parse_scene(objects(f"{BALL}, key: a/b, max_speed: 1")).objects
    assert isinstance(ball, Sphere)
    assert ball.timeout_s == 1.0


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (f"{BALL}, key: a/b", "s.yaml:2: objects[0].max_speed: is missing, and an object with a"),
        (f"{BALL}, max_speed: 1", "objects[0].max_speed: means nothing for an object without key"),
        (f"{BALL}, timeout_s: 1", "objects[0].timeout_s: means nothing for an object without key"),
        (f"{BALL}, key: a/*/b, max_speed: 1", "objects[0].key: 'a/*/b' has '*', which an exact"),
        (f"{BALL}, key: /a, max_speed: 1", "objects[0].key: '/a' starts or ends with a slash"),
        (f"{BALL}, key: a, max_speed: 0", "max_speed: 0 is not greater than 0; give the top"),
        (f"{BALL}, key: a, max_speed: .inf", "max_speed: inf is not a finite number"),
        (f"{BALL}, key: a, max_speed: 1, timeout_s: 0", "timeout_s: 0 is less than 0.05"),
        (f"{BALL}, key: 7, max_speed: 1", "objects[0].key: 7 is not text"),
        (
            "name: g, type: halfspace, normal: [0, 0, 1], key: a, max_speed: 1",
            "s.yaml:2: objects[0].key: a halfspace cannot move; remove it, or describe",
        ),
        (
            "name: g, type: actuator_limit, actuator: swing, above: 1, timeout_s: 2",
            "objects[0].timeout_s: an actuator limit cannot move",
        ),
        ("name: 'self:boom', type: sphere, radius_m: 1, center: [0, 0, 0]", "begins with 'self:'"),
    ],
)
def test_mistake_is_named(line: str, expected: str) -> None:
    assert expected in refusal(objects(line))


def test_two_objects_cannot_share_a_key() -> None:
    other = BALL.replace("ball", "other")
    moving = "key: a/b, max_speed: 1"
    text = refusal(objects(f"{BALL}, {moving}", f"{other}, {moving}"))
    assert "s.yaml:3: objects[1].key: 'a/b' is the key of object 'ball' already" in text


@pytest.mark.parametrize(
    ("key", "what"),
    [
        ("r/joystick", "keys.joystick"),
        ("r/actuators", "keys.actuators"),
        ("r/lever", "inputs.joystick.alive_key"),
        ("r/guard/alert", "a key of the guard itself"),
    ],
)
def test_a_key_of_the_site_is_no_key_of_an_object(
    load: Callable[..., Site], key: str, what: str
) -> None:
    with pytest.raises(SettingsError) as caught:
        load(scene=TRUCK.replace("rampe/site/truck-1/pose", key))
    assert f"scene.yaml:8: objects[1].key: '{key}' is {what} already" in str(caught.value)


def test_an_editor_refuses_a_key_on_a_halfspace() -> None:
    ground = {"name": "g", "type": "halfspace", "normal": [0, 0, 1]}
    jsonschema.validate({"objects": [ground]}, scene_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"objects": [{**ground, "key": "a"}]}, scene_schema())


def test_the_arm_is_not_swept_against_itself_unless_asked(load: Callable[..., Site]) -> None:
    assert load().self_collision == SelfCollision(enabled=False, margin_m=0.0, allow=())
    asked = "self_collision: {enabled: true, margin_m: 0.02, allow: [[boom, stick], [a, b]]}\n"
    expected = SelfCollision(enabled=True, margin_m=0.02, allow=(("boom", "stick"), ("a", "b")))
    assert load(asked).self_collision == expected


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ("margin_m: -1", "site.yaml:10: self_collision.margin_m: -1 is less than 0"),
        ("allow: [[boom]]", "site.yaml:10: self_collision.allow[0]: a list of 1 is too short"),
        ("allow: [[a, b, c]]", "self_collision.allow[0]: a list of 3 is too long"),
        ("allow: [boom, stick]", "self_collision.allow[0]: 'boom' is not a list"),
        ("allow: [[boom, boom]]", "self_collision.allow[0]: names 'boom' twice; give the names"),
        ("allow: [[a, b], [b, a]]", "self_collision.allow[1]: is the same pair as allow[0]"),
        ("enabled: 1", "self_collision.enabled: 1 is not true or false"),
        ("allowed: []", "self_collision.allowed: is not a known key; did you mean 'allow'?"),
    ],
)
def test_mistakes_about_self_collision(
    load: Callable[..., Site], block: str, expected: str
) -> None:
    with pytest.raises(SettingsError) as caught:
        load(f"self_collision: {{{block}}}\n")
    assert expected in str(caught.value)
