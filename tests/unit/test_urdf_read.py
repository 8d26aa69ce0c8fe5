"""What is read of a URDF, and what is no URDF: told with the line and the way to make one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rampe_guard.collision import load_arm
from rampe_guard.collision.urdf import Arm, movable_joints, read_urdf
from rampe_guard.core.kinematics import ForwardKinematics
from rampe_guard.errors import GeometryError
from tests.support.arms import describe

BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>\n'


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{inside}</joint>\n"
    )


def written(folder: Path, body: str, name: str = "arm.urdf") -> Path:
    path = folder / name
    path.write_text(body if body.lstrip().startswith("<?") else f'<robot name="a">{body}</robot>')
    return path


MESH = '<collision><geometry><mesh filename="a.stl" scale="{}"/></geometry></collision>'
TURN = '<axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="1.5" effort="1"/>'
TWO = link("a") + link("b", BOX) + joint("turn", "revolute", "a", "b", TURN)


FOREIGN_PREFIX = (
    '<?xml version="1.0"?><robot name="a" xmlns:x="http://www.ros.org/wiki/xacro">'
    '<x:include filename="b"/></robot>'
)
RING = link("c") + link("d") + joint("x", "fixed", "c", "d") + joint("y", "fixed", "d", "c")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<?xml version="1.0"?><sdf version="1.9"><model name="m"/></sdf>', "is SDF.*convert"),
        ('<?xml version="1.0"?><mujoco model="m"/>', "is MJCF.*convert"),
        ('<?xml version="1.0"?><COLLADA/>', "is a COLLADA file"),
        ('<?xml version="1.0"?><svg/>', "root is <svg>, that of a URDF is <robot>"),
        ('<group name="arm"/>', "is an SRDF"),
        ("", "no links"),
        ('<xacro:macro name="m"/>' + TWO, r"arm.urdf:1: is xacro.*xacro IN.xacro > OUT.urdf"),
        (TWO.replace("1 1 1", "${w} 1 1"), r"arm.urdf:2: is xacro"),
        (link("a", BOX.replace("<box", "<mesh filename='$(find p)/a.stl'/><box")), "is xacro"),
        (FOREIGN_PREFIX, "is xacro"),
        (TWO + link("b"), r"arm.urdf:4: there is a link 'b' on line 2 already"),
        (
            TWO + link("c") + joint("turn", "fixed", "b", "c"),
            r"arm.urdf:5: there is a joint 'turn' on line 3",
        ),
        (link("a", BOX) + link("b", BOX), "needs one root link, has 2: 'a', 'b'"),
        (
            TWO + link("c") + joint("j", "fixed", "c", "b"),
            "'b' has two parents: joints 'turn' and 'j'",
        ),
        (TWO + RING, "form a loop: 'c', 'd'"),
        (joint("x", "fixed", "a", "a") + link("a"), "form a loop: 'a'"),
        (TWO + joint("x", "fixed", "b", "gone"), "joint 'x' names no link 'gone'"),
        (TWO.replace('<parent link="a"/>', ""), r"arm.urdf:3: <joint> 'turn' has no <parent>"),
        (TWO.replace("revolute", "hinge"), r"arm.urdf:3: joint 'turn' is of type 'hinge'"),
        (TWO.replace(' type="revolute"', ""), r"<joint> has no type"),
        (TWO.replace('name="b"', ""), r"arm.urdf:2: <link> has no name"),
        (TWO.replace("1 1 1", "1 1"), r'arm.urdf:2: <box> has size="1 1"; give 3'),
        (TWO.replace('lower="-1"', 'lower="low"'), r'<limit> has lower="low"; give 1'),
        (TWO.replace('<box size="1 1 1"/>', ""), "<geometry>.*needs one shape|needs one shape"),
        (TWO.replace('<box size="1 1 1"/>', "<cone/>"), "link 'b': a shape <cone>"),
        (TWO.replace("0 0 1", "0 0"), r'<axis> has xyz="0 0"'),
        (TWO.replace('"-1"', '"nan"'), r"arm.urdf:3: joint 'turn' has lower=\"nan\"; give a num"),
        (TWO.replace('"2"', '"-nan"'), r"arm.urdf:3: joint 'turn' has upper=\"-nan\"; give a num"),
        (TWO.replace('"2"', '"-2"'), r"urdf:3: joint 'turn' has lower=-1 above upper=-2; correct"),
        (TWO.replace('"-1"', '"-inf"'), r"urdf:3: joint 'turn' has lower=-inf and upper=2; give"),
        (TWO.replace('"1.5"', '"-1"'), r"arm.urdf:3: joint 'turn' has velocity=\"-1\"; give its"),
        (TWO.replace('"1.5"', '"nan"'), r"arm.urdf:3: joint 'turn' has velocity=\"nan\"; give its"),
        (link("a", MESH.format("0 1 1")), r'urdf:1: <mesh> has scale="0 1 1"; give .* not 0'),
        (link("a", MESH.format("nan")), r'arm.urdf:1: <mesh> has scale="nan"; give factors'),
        (TWO.replace("1 1 1", "1 0 1"), r'arm.urdf:2: <box> has size="1 0 1"; give more than 0'),
        (
            TWO.replace('type="revolute"', 'type="continuous"') + link("c")
            + joint("slide", "prismatic", "b", "c", '<mimic joint="turn"/>' + TURN),
            "joint 'slide' slides and follows .mimic. joint 'turn', which has no limits: give",
        ),
    ],
)  # fmt: skip
def test_what_is_no_urdf_is_told_with_what_to_do(tmp_path: Path, body: str, words: str) -> None:
    with pytest.raises(GeometryError, match=words) as caught:
        load_arm(describe(written(tmp_path, body), ["turn"]))
    assert str(caught.value).startswith(str(tmp_path / "arm.urdf"))


def test_a_file_called_xacro_is_one(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match=r"arm.urdf.xacro: is xacro"):
        read_urdf(written(tmp_path, TWO, "arm.urdf.xacro"))


def test_expressions_that_are_none_of_its_arm_harm_nobody(tmp_path: Path) -> None:
    plugin = '<gazebo><plugin filename="$(find somewhere)/it.so"/></gazebo>'
    assert len(read_urdf(written(tmp_path, TWO + plugin)).links) == 2


@pytest.mark.parametrize(
    ("kind", "limit"),
    [
        ("continuous", '<limit lower="nan" upper="-1" velocity="1"/>'),  # it has no ends
        ("revolute", '<limit lower="-inf" upper="inf" velocity="inf"/>'),
        ("revolute", '<limit effort="1" velocity="0"/>'),
    ],
)
def test_a_joint_may_have_no_ends(tmp_path: Path, kind: str, limit: str) -> None:
    body = link("a") + link("b", BOX) + joint("turn", kind, "a", "b", limit)
    (turn,) = movable_joints(read_urdf(written(tmp_path, body)))
    assert (turn.lower, turn.upper) == (-np.inf, np.inf)


def test_joints_that_can_be_driven_come_with_limits_and_speeds(tmp_path: Path) -> None:
    body = (
        link("a") + link("b") + link("c") + link("d") + link("e") + link("f")
        + joint("far", "continuous", "c", "d", '<limit velocity="0" effort="1"/>')
        + joint("glue", "fixed", "a", "b")
        + joint("near", "prismatic", "b", "c", '<limit lower="0" upper="0.4" velocity="0.2"/>')
        + joint("jaw", "revolute", "d", "e", '<mimic joint="far"/>')
        + joint("loose", "floating", "d", "f")
    )  # fmt: skip
    near, far = movable_joints(read_urdf(written(tmp_path, body)))
    assert (near.name, near.kind, near.lower, near.upper, near.velocity) == (
        "near", "prismatic", 0.0, 0.4, 0.2,
    )  # fmt: skip
    assert (near.parent, near.child, near.depth) == ("b", "c", 0)
    assert (far.name, far.lower, far.upper, far.velocity, far.depth) == (
        "far", -np.inf, np.inf, None, 1,
    )  # fmt: skip


def poses(arm: Arm, q: float) -> dict[str, np.ndarray]:
    theta = np.array([[float(j.value(np.array([q]))[0]) for j in arm.joints]])
    found = ForwardKinematics(arm.chain).links(theta)[0]
    return dict(zip(arm.link_names, found, strict=True))


def test_who_follows_a_follower_follows_the_driven_joint(tmp_path: Path) -> None:
    mimic = '<mimic joint="{}" multiplier="{}" offset="{}"/>' + TURN
    body = (
        TWO + link("c") + link("d") + link("e") + link("f")
        + joint("third", "revolute", "c", "d", mimic.format("second", -2, 0.25))
        + joint("second", "revolute", "b", "c", mimic.format("turn", -0.5, 0.1))
        + joint("slide", "prismatic", "d", "e", '<mimic joint="third"/><axis xyz="1 0 0"/>')
        + joint("glue", "fixed", "e", "f", '<origin xyz="1 2 3" rpy="0.1 -0.2 0.3"/>')
    )  # fmt: skip
    arm = load_arm(describe(written(tmp_path, body), ["turn"]))
    q = 0.7
    second = -0.5 * q + 0.1
    third = -2.0 * second + 0.25
    found = poses(arm, q)
    turned = Rotation.from_euler("z", [[q], [q + second], [q + second + third]]).as_matrix()
    for name, rotation in zip("bcd", turned, strict=True):
        assert found[name][:3, :3] == pytest.approx(rotation, abs=1e-12)
    assert found["e"][:3, 3] == pytest.approx(turned[2] @ [third, 0, 0], abs=1e-12)
    fixed = Rotation.from_euler("xyz", [0.1, -0.2, 0.3]).as_matrix()
    assert found["f"][:3, :3] == pytest.approx(turned[2] @ fixed, abs=1e-12)
    assert found["f"][:3, 3] == pytest.approx(turned[2] @ [third + 1, 2, 3], abs=1e-12)
    assert dict(arm.fixed_joints) == {}


def test_who_follows_an_undriven_joint_is_held_where_that_one_takes_it(tmp_path: Path) -> None:
    body = (
        TWO + link("c") + link("d")
        + joint("idle", "revolute", "b", "c", '<limit lower="0.5" upper="1"/>')
        + joint("jaw", "revolute", "c", "d", '<mimic joint="idle" multiplier="-2" offset="0.1"/>')
    )  # fmt: skip
    arm = load_arm(describe(written(tmp_path, body), ["turn"]))
    assert dict(arm.fixed_joints) == {"idle": 0.5, "jaw": -0.9}


@pytest.mark.parametrize(
    ("mimics", "words"),
    [
        ({"x": "gone"}, "joint 'x' follows .* joint 'gone', which is not there"),
        ({"x": "y", "y": "x"}, "in a loop: 'x' → 'y' → 'x'"),
        ({"x": "x"}, "in a loop: 'x' → 'x'"),
        ({"x": "loose"}, "joint 'loose', which is floating"),
        ({"x": 'turn" multiplier="inf'}, "joint 'x': mimic multiplier and offset not finite"),
    ],
)
def test_followers_of_nobody_are_named(tmp_path: Path, mimics: dict[str, str], words: str) -> None:
    body = TWO + link("c") + link("d") + link("e") + joint("loose", "floating", "b", "e")
    for (name, at), child in zip(mimics.items(), "cd", strict=False):
        body += joint(name, "revolute", "b", child, f'<mimic joint="{at}"/>')
    if len(mimics) == 1:
        body += joint("rest", "fixed", "b", "d")
    with pytest.raises(GeometryError, match=words):
        load_arm(describe(written(tmp_path, body), ["turn"]))


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_joints_that_nobody_can_drive_are_held_and_said(tmp_path: Path, kind: str) -> None:
    body = TWO + link("c", BOX) + joint("loose", kind, "b", "c", '<origin xyz="0 0 2"/>')
    arm = load_arm(describe(written(tmp_path, body), ["turn"]))
    assert poses(arm, 0.0)["c"][:3, 3].tolist() == [0.0, 0.0, 2.0]
    assert arm.fixed_joints["loose"] == 0.0
    assert f"joint 'loose' is {kind}: it is held where the URDF draws it" in arm.notes[0]
    with pytest.raises(GeometryError, match=f"joint 'loose' is {kind}, nothing to drive"):
        load_arm(describe(tmp_path / "arm.urdf", ["loose"]))


def test_what_is_only_to_be_looked_at_may_be_wrong(tmp_path: Path) -> None:
    seen = '<visual><geometry><torus/></geometry><origin xyz="?"/></visual>'
    body = TWO.replace(BOX, BOX + seen)
    assert load_arm(describe(written(tmp_path, body), ["turn"])).meshes[1] is not None
    with pytest.raises(GeometryError, match='<origin> has xyz="\\?"'):
        load_arm(describe(written(tmp_path, TWO.replace(BOX, seen)), ["turn"]))


def test_a_capsule_is_contained_and_hardly_more(tmp_path: Path) -> None:
    shape = '<collision><geometry><capsule radius="0.2" length="1"/></geometry></collision>'
    mesh = load_arm(describe(written(tmp_path, TWO.replace(BOX, shape)), ["turn"])).meshes[1]
    assert mesh is not None
    assert mesh.is_watertight()
    way = np.random.default_rng(0).normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    skin = 0.2 * way + np.array([0, 0, 0.5]) * np.sign(way)
    assert np.all(np.abs(mesh.winding(0.9999 * skin)) > 0.5)
    out = mesh.vertices - np.clip(mesh.vertices, -0.5, 0.5) * np.array([0, 0, 1])
    assert np.linalg.norm(out, axis=1).max() < 0.2 * 1.02
