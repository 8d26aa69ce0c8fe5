from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.collision import load_arm
from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.drive import CylinderDrive, DirectDrive, joint_scalar
from rampe_guard.errors import GeometryError
from tests.support.arms import box_triangles, describe, pendulum, six_axis, slider, write_stl

ZX200 = Path(__file__).parents[3] / "shared" / "data" / "robots" / "zx200" / "urdf" / "zx200.urdf"


def _write(folder: Path, body: str) -> Path:
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="arm">{body}</robot>')
    return path


BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
TURN = (
    '<joint name="turn" type="revolute"><parent link="a"/><child link="b"/>'
    '<axis xyz="0 0 2"/><limit lower="-1" upper="2"/></joint>'
)


def test_six_axis_arm(tmp_path: Path) -> None:
    arm = load_arm(six_axis(tmp_path))
    assert arm.link_names == ("base", "shoulder", "upper", "fore", "wrist_1", "wrist_2", "tool")
    assert arm.joint_names == tuple(f"j{i}" for i in range(1, 7))
    assert all(mesh is not None for mesh in arm.meshes)
    assert arm.limits[0].tolist() == [-3.0, 3.0]
    assert arm.limits[5].tolist() == [-np.inf, np.inf]
    assert arm.proven[0] == pytest.approx([-3.6, 3.6])
    assert dict(arm.fixed_joints) == {}


def test_undriven_joints_are_held_and_reported(tmp_path: Path) -> None:
    body = (
        f'<link name="a"/><link name="b">{BOX}</link><link name="c">{BOX}</link>{TURN}'
        '<joint name="idle" type="revolute"><parent link="b"/><child link="c"/>'
        '<origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="0.5" upper="2"/></joint>'
    )
    arm = load_arm(describe(_write(tmp_path, body), ["turn"]))
    assert dict(arm.fixed_joints) == {"idle": 0.5}
    held = arm.chain.link_origin[arm.link_names.index("c")]
    assert held[:2, :2] == pytest.approx(
        np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    )
    assert np.linalg.norm(arm.chain.axis[0]) == pytest.approx(1.0)


def test_mimic_joints_follow(tmp_path: Path) -> None:
    body = (
        f'<link name="a"/><link name="b">{BOX}</link><link name="c">{BOX}</link>{TURN}'
        '<joint name="jaw" type="revolute"><parent link="b"/><child link="c"/>'
        '<mimic joint="turn" multiplier="-2" offset="0.1"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9"/></joint>'
    )
    arm = load_arm(describe(_write(tmp_path, body), ["turn"]))
    assert arm.joint_names == ("turn", "jaw")
    assert arm.joints[1].scalar(0.3) == pytest.approx(-0.5)
    assert arm.joints[1].value(np.array([0.3])) == pytest.approx([-0.5])


def test_limits_come_through_the_drive(tmp_path: Path) -> None:
    drive = CylinderDrive(0.8, 2.3, 1.7, -1.4)
    ends = [joint_scalar(drive, q) for q in (0.1, 1.0)]
    description = pendulum(tmp_path, drive)
    path = Path(description.urdf)
    text = path.read_text().replace('lower="-3" upper="3"', f'lower="{ends[0]}" upper="{ends[1]}"')
    path.write_text(text)
    assert load_arm(description).limits[0] == pytest.approx([0.1, 1.0], abs=1e-9)
    given = replace(description, limits=((0.2, None),))
    assert load_arm(given).limits[0] == pytest.approx([0.2, 1.0], abs=1e-9)


@pytest.mark.parametrize("style", ["beside", "in the folder", "above"])
def test_package_paths_are_found(tmp_path: Path, style: str) -> None:
    package = tmp_path / "my_arm"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    write_stl(package / "meshes" / "b.stl", box_triangles((1, 1, 1)))
    folder = {"beside": tmp_path, "in the folder": package, "above": package / "urdf"}[style]
    mesh = MESH.format("package://my_arm/meshes/b.stl")
    body = f'<link name="a"/><link name="b">{mesh}</link>{TURN}'
    arm = load_arm(describe(_write(folder, body), ["turn"]))
    assert arm.meshes[1] is not None


def test_visual_stands_in_where_there_is_no_collision_and_scale_counts(tmp_path: Path) -> None:
    write_stl(tmp_path / "b.stl", box_triangles((1, 1, 1)))
    shape = '<visual><geometry><mesh filename="b.stl" scale="2 1 -1"/></geometry></visual>'
    body = f'<link name="a"/><link name="b">{shape}</link>{TURN}'
    mesh = load_arm(describe(_write(tmp_path, body), ["turn"])).meshes[1]
    assert mesh is not None
    assert np.ptp(mesh.vertices, axis=0).tolist() == [2.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<link name="a"/>', "no joint 'turn'; it has none"),
        (f'<link name="a"/><link name="b"/>{TURN}', "no link has .*geometry"),
        (f'<link name="a"/>{TURN}', "names no link 'b'"),
        (f'<link name="a"/><link name="b">{BOX}</link><link name="c"/>{TURN}', "one root link"),
        (
            f'<link name="a"/><link name="b">{BOX}</link>{TURN.replace("0 0 2", "0 0 0")}',
            "axis",
        ),
        (
            f'<link name="a"/><link name="b">{BOX}</link>{TURN.replace("revolute", "fixed")}',
            "is fixed, nothing to drive",
        ),
        (
            f'<link name="a"/><link name="b">{BOX.replace("1 1 1", "1 -1 1")}</link>{TURN}',
            r'arm.urdf:1: <box> has size="1 -1 1"; give more than 0',
        ),
        (
            f'<link name="a"/><link name="b">{MESH.format("gone.stl")}</link>{TURN}',
            "gone.stl: no such mesh",
        ),
        (
            f'<link name="a"/><link name="b">{MESH.format("package://p/m.stl")}</link>{TURN}',
            "package://p/m.stl",
        ),
    ],
)
def test_faults_of_a_urdf_are_named(tmp_path: Path, body: str, words: str) -> None:
    path = _write(tmp_path, body)
    with pytest.raises(GeometryError, match=words) as caught:
        load_arm(describe(path, ["turn"]))
    assert "arm.urdf" in str(caught.value) or "gone.stl" in str(caught.value)


def test_files_that_are_no_urdf(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="no such URDF"):
        load_arm(describe(tmp_path / "none.urdf", ["turn"]))
    for text in ("", "<robot", "not xml"):
        path = tmp_path / "broken.urdf"
        path.write_text(text)
        with pytest.raises(GeometryError, match="not well-formed XML"):
            load_arm(describe(path, ["turn"]))


def test_drives_that_do_not_fit_are_named(tmp_path: Path) -> None:
    folding = CylinderDrive(3.0, 1.66, 2.0, corner="base")
    with pytest.raises(GeometryError, match=r"pendulum.urdf.*joint 'turn'.*monotone"):
        load_arm(pendulum(tmp_path, folding, (0.0, 1.0)))
    with pytest.raises(GeometryError, match="limits 1 to 0"):
        load_arm(pendulum(tmp_path, DirectDrive(), (1.0, 0.0)))
    with pytest.raises(GeometryError, match="slides without limits"):
        load_arm(replace(slider(tmp_path), limits=((-np.inf, np.inf),)))
    twice = slider(tmp_path)
    twice = replace(twice, joints=(*twice.joints, JointDrive("slide", 0, DirectDrive())))
    with pytest.raises(GeometryError, match="driven twice"):
        load_arm(twice)


def test_meshes_of_links_keep_their_notes_and_millimetres_are_refused(tmp_path: Path) -> None:
    box = box_triangles((1, 1, 1))
    write_stl(tmp_path / "b.stl", np.concatenate([box[1:], box[-1:]]))
    body = f'<link name="a"/><link name="b">{MESH.format("b.stl")}</link>{TURN}'
    arm = load_arm(describe(_write(tmp_path, body), ["turn"]))
    assert arm.notes == (
        f"{tmp_path / 'b.stl'}: 1 triangle given twice left out",
        f"{tmp_path / 'arm.urdf'}: link 'b': it is not closed: a surface without an inside",
    )
    assert arm.parents == (-1, 0)
    write_stl(tmp_path / "b.stl", 1e3 * box)
    with pytest.raises(GeometryError, match=r"link 'b': .*b\.stl: is 1000 m long.*millimetre"):
        load_arm(describe(_write(tmp_path, body), ["turn"]))


@pytest.mark.skipif(not ZX200.exists(), reason="the public excavator model is not beside us")
@pytest.mark.private_data
def test_a_public_excavator_model_loads() -> None:
    joints = ("swing_joint", "boom_joint", "arm_joint", "bucket_joint")
    arm = load_arm(
        ArmDescription(
            urdf=str(ZX200),
            base_pose=np.eye(4),
            joints=tuple(JointDrive(name, i, DirectDrive()) for i, name in enumerate(joints)),
            limits=((None, None),) * 4,
        )
    )
    assert arm.limits[1] == pytest.approx([-1.137, -0.1])
    assert dict(arm.fixed_joints) == {"bucket_end_joint": 0.0}
    assert sum(len(mesh.faces) for mesh in arm.meshes if mesh is not None) > 32_000
