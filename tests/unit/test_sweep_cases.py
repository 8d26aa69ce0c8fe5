"""Motions that fool samplers and solvers, each with an answer known by hand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.collision.zones import build_zone
from rampe_guard.core.drive import CylinderDrive, Drive, FourBarDrive, joint_scalar
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, Scene, Sphere
from rampe_guard.core.types import Certificate, FloatArray, ZoneSweep
from rampe_guard.errors import GeometryError
from tests.support.arms import box_triangles, pendulum, slider, write_stl
from tests.support.scenes import pose

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.arm import ArmDescription
    from rampe_guard.core.scene import SceneObject

TOLERANCE_M = 0.0002


def sweep_one(
    arm: ArmDescription, item: SceneObject, start: float, displacement: float
) -> ZoneSweep:
    sweeper = FclSweeper(load_arm(arm), Scene((item,)))
    return sweeper.sweep(np.array([start]), np.array([displacement])).zones[0]


def assert_contact_at(zone: ZoneSweep, fraction: float, length_m: float) -> None:
    """Contact not later than the true fraction, and earlier by 1 mm of motion at most."""
    assert zone.certificate is Certificate.CONTACT
    assert zone.contact_fraction is not None
    assert zone.contact_fraction <= fraction + 1e-9
    assert zone.contact_fraction * length_m >= fraction * length_m - 0.001
    assert zone.clearance_m == 0.0


def test_contact_hidden_in_the_middle_of_a_motion(tmp_path: Path) -> None:
    """A 10 cm cube passes a needle tip; 4 m before it and 4 m after it all is free."""
    needle = Capsule(
        name="needle", margin_m=0, radius_m=0.001, start_m=(0, 0, 1.0), end_m=(0, 0, 0.045)
    )
    zone = sweep_one(slider(tmp_path, "0.1 0.1 0.1"), needle, -4.0, 8.0)
    assert_contact_at(zone, (4.0 - 0.051) / 8.0, 8.0)
    assert zone.link == "tool"
    assert zone.contact_point_m == pytest.approx((0.0, 0.0, 0.047), abs=0.005)


def test_the_needle_just_out_of_reach_is_free(tmp_path: Path) -> None:
    needle = Capsule(
        name="needle", margin_m=0, radius_m=0.001, start_m=(0, 0, 1.0), end_m=(0, 0, 0.052)
    )
    zone = sweep_one(slider(tmp_path, "0.1 0.1 0.1"), needle, -4.0, 8.0)
    assert zone.certificate is Certificate.FREE
    assert zone.clearance_m is not None
    assert zone.clearance_m <= 0.001
    assert zone.contact_fraction is None


def test_thin_cable_across_a_long_swing(tmp_path: Path) -> None:
    angle = 0.9
    x, y = 0.8 * math.cos(angle), 0.8 * math.sin(angle)
    cable = Capsule(name="c", margin_m=0, radius_m=0.005, start_m=(x, y, -2), end_m=(x, y, 2))
    zone = sweep_one(pendulum(tmp_path), cable, -1.5, 3.0)
    # the rod's flank is 5 cm from its axis, the cable's skin 5 mm from its core
    true = angle - math.asin(0.055 / 0.8)
    assert_contact_at(zone, (true + 1.5) / 3.0, 3.0)


def test_sheet_of_two_millimetres(tmp_path: Path) -> None:
    sheet = Box(name="s", margin_m=0, size_m=(0.002, 4.0, 4.0), pose=pose((1.0, 0, 0)))
    zone = sweep_one(slider(tmp_path), sheet, -3.0, 8.0)
    assert_contact_at(zone, (4.0 - 0.101) / 8.0, 8.0)


def test_start_in_contact(tmp_path: Path) -> None:
    ball = Sphere(name="b", margin_m=0, radius_m=0.3, center_m=(0.35, 0.1, 0))
    zone = sweep_one(slider(tmp_path), ball, 0.0, 1.0)
    assert zone.certificate is Certificate.CONTACT
    assert zone.contact_fraction == 0.0
    assert zone.clearance_now_m == 0.0
    assert zone.closing


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder", "capsule", "halfspace", "mesh"])
def test_link_wholly_inside_an_obstacle(tmp_path: Path, kind: str) -> None:
    items: dict[str, SceneObject] = {
        "box": Box(name="o", margin_m=0, size_m=(5, 5, 5), pose=np.eye(4)),
        "sphere": Sphere(name="o", margin_m=0, radius_m=3, center_m=(0, 0, 0)),
        "cylinder": Cylinder(name="o", margin_m=0, radius_m=3, height_m=5, pose=np.eye(4)),
        "capsule": Capsule(name="o", margin_m=0, radius_m=2, start_m=(-1, 0, 0), end_m=(1, 0, 0)),
        "halfspace": Halfspace(name="o", margin_m=0, normal=(0, 0, 1), offset_m=2.0),
        "mesh": Mesh(
            name="o",
            margin_m=0,
            file=str(write_stl(tmp_path / "big.stl", box_triangles((5, 5, 5)))),
            scale=1.0,
            pose=np.eye(4),
        ),
    }
    zone = sweep_one(slider(tmp_path), items[kind], 0.0, 0.5)
    assert zone.certificate is Certificate.CONTACT
    assert zone.contact_fraction == 0.0


def test_obstacle_wholly_inside_a_link(tmp_path: Path) -> None:
    pebble = Sphere(name="p", margin_m=0, radius_m=0.01, center_m=(0, 0, 0))
    zone = sweep_one(slider(tmp_path, "2 2 2"), pebble, 0.0, 0.1)
    assert zone.certificate is Certificate.CONTACT
    assert zone.contact_fraction == 0.0


def damaged(kind: str) -> FloatArray:
    box = box_triangles((5, 5, 5))
    if kind == "a triangle is missing":
        return box[1:]
    if kind == "a sheet":
        return box[:2]
    return np.concatenate([box, box[:, ::-1]])


@pytest.mark.parametrize(
    "kind",
    [
        "a triangle is missing",
        "a sheet",
        "a skin and its mirror image",
    ],
)
def test_a_mesh_whose_inside_cannot_be_known_is_refused(tmp_path: Path, kind: str) -> None:
    """The link would be inside, touch nothing, and be called free."""
    file = str(write_stl(tmp_path / "open.stl", damaged(kind)))
    item = Mesh(name="pit", margin_m=0, file=file, scale=1.0, pose=np.eye(4))
    with pytest.raises(
        GeometryError, match=r"object 'pit': .*open\.stl: 1 of 1 parts are not closed"
    ):
        sweep_one(slider(tmp_path), item, 0.0, 1.0)


def test_a_mesh_with_a_triangle_turned_over_is_mended_and_solid(tmp_path: Path) -> None:
    box = box_triangles((5, 5, 5))
    file = str(write_stl(tmp_path / "m.stl", np.concatenate([box[:1, ::-1], box[1:]])))
    item = Mesh(name="pit", margin_m=0, file=file, scale=1.0, pose=np.eye(4))
    zone = sweep_one(slider(tmp_path), item, 0.0, 1.0)
    assert (zone.certificate, zone.contact_fraction) == (Certificate.CONTACT, 0.0)
    built = build_zone(item, ("rail", "tool"))
    assert built.notes == (
        f"object 'pit': {file}: 1 triangle turned over to face as their neighbours do",
    )


def test_an_open_mesh_is_a_surface_without_an_inside(tmp_path: Path) -> None:
    """The link stands below the sheet, in what a closed mesh would call its inside."""
    file = str(write_stl(tmp_path / "open.stl", damaged("a triangle is missing")))
    item = Mesh(name="pit", margin_m=0, file=file, scale=1.0, pose=np.eye(4), open=True)
    assert sweep_one(slider(tmp_path), item, 0.0, 1.0).certificate is Certificate.FREE
    # its face at x = 2.5 is met by the cube's at 0.1
    assert_contact_at(sweep_one(slider(tmp_path), item, 0.0, 5.0), 2.4 / 5.0, 5.0)
    assert build_zone(item, ("rail", "tool")).notes == ()


def test_a_closed_mesh_that_is_called_open_gets_a_word(tmp_path: Path) -> None:
    file = str(write_stl(tmp_path / "m.stl", box_triangles((1, 1, 1))))
    item = Mesh(name="hall", margin_m=0, file=file, scale=1.0, pose=np.eye(4), open=True)
    (note,) = build_zone(item, ("tool",)).notes
    assert note == f"object 'hall': {file}: is closed, yet 'open' takes its inside for free space"


def test_boxes_that_touch_along_an_edge_are_closed_and_solid(tmp_path: Path) -> None:
    """One box round the link, another that shares its edge: the merged edge is walked twice."""
    around, beside = box_triangles((5, 5, 5)), box_triangles((5, 5, 5), (5, 5, 0))
    file = str(write_stl(tmp_path / "two.stl", np.concatenate([around, beside])))
    item = Mesh(name="two", margin_m=0, file=file, scale=1.0, pose=np.eye(4))
    zone = sweep_one(slider(tmp_path), item, 0.0, 1.0)
    assert (zone.certificate, zone.contact_fraction) == (Certificate.CONTACT, 0.0)


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder", "capsule", "halfspace", "mesh"])
def test_margin_is_kept_round_every_shape(tmp_path: Path, kind: str) -> None:
    """Each shape begins at x = 2; with 0.5 m of margin the cube's face at 0.1 stops 0.5 before."""
    flat = pose((3, 0, 0))
    items: dict[str, SceneObject] = {
        "box": Box(name="o", margin_m=0.5, size_m=(2, 2, 2), pose=flat),
        "sphere": Sphere(name="o", margin_m=0.5, radius_m=1, center_m=(3, 0, 0)),
        "cylinder": Cylinder(name="o", margin_m=0.5, radius_m=1, height_m=2, pose=flat),
        "capsule": Capsule(name="o", margin_m=0.5, radius_m=1, start_m=(3, 0, -1), end_m=(3, 0, 1)),
        "halfspace": Halfspace(name="o", margin_m=0.5, normal=(-1, 0, 0), offset_m=-2.0),
        "mesh": Mesh(
            name="o",
            margin_m=0.5,
            file=str(write_stl(tmp_path / "cube.stl", box_triangles((1, 1, 1)))),
            scale=2.0,
            pose=flat,
        ),
    }
    zone = sweep_one(slider(tmp_path), items[kind], 0.0, 4.0)
    assert_contact_at(zone, 1.4 / 4.0, 4.0)
    assert zone.clearance_now_m == pytest.approx(1.4, abs=0.05)
    assert (zone.clearance_now_m or 0.0) <= 1.4
    short = sweep_one(slider(tmp_path), items[kind], 0.0, 1.0)
    assert short.certificate is Certificate.FREE
    assert short.clearance_m == pytest.approx(0.4, abs=0.05)
    assert (short.clearance_m or 0.0) <= 0.4


@pytest.mark.parametrize(
    ("drive", "lower", "upper"),
    [
        (CylinderDrive(0.8, 2.3, 1.7, -1.4), 0.0, 1.2),
        (
            FourBarDrive(2.148921, 0.62, 1.66, 3.0974, 0.45, 0.62, 0.6, 0.46, 1.5, -1),
            0.0,
            0.96,
        ),
    ],
)
def test_linkages_stop_at_the_stroke_where_the_rod_touches(
    tmp_path: Path, drive: Drive, lower: float, upper: float
) -> None:
    touching = 0.5 * (lower + upper)
    first, last = joint_scalar(drive, lower), joint_scalar(drive, upper)
    ahead = 1.0 if last > first else -1.0
    angle = joint_scalar(drive, touching) + ahead * math.asin(0.08 / 0.9)
    ball = Sphere(
        name="b",
        margin_m=0,
        radius_m=0.03,
        center_m=(0.9 * math.cos(angle), 0.9 * math.sin(angle), 0.0),
    )
    arm = pendulum(tmp_path, drive, (lower, upper))
    zone = sweep_one(arm, ball, lower, upper - lower)
    assert_contact_at(zone, 0.5, abs(last - first))
    back = sweep_one(arm, ball, touching - 0.2, lower - (touching - 0.2))
    assert back.certificate is Certificate.FREE
    assert not back.closing


def test_moving_out_of_a_margin_is_not_closing(tmp_path: Path) -> None:
    wall = Box(name="w", margin_m=0.5, size_m=(1, 4, 4), pose=pose((0.9, 0, 0)))
    arm = slider(tmp_path)
    away = sweep_one(arm, wall, 0.0, -1.0)
    assert away.certificate is Certificate.CONTACT
    assert away.contact_fraction == 0.0
    assert not away.closing
    assert away.clearance_now_m == pytest.approx(0.3 - 0.5, abs=2 * TOLERANCE_M)
    assert sweep_one(arm, wall, 0.0, 0.1).closing
    assert not sweep_one(arm, wall, 0.0, 0.0).closing
    assert not sweep_one(arm, wall, -3.0, -1.0).closing
    assert sweep_one(arm, wall, -3.0, 0.5).closing


def test_inside_a_solid_every_motion_closes_until_it_is_shown_to_open(tmp_path: Path) -> None:
    wall = Box(name="w", margin_m=0.1, size_m=(1, 4, 4), pose=pose((0.55, 0, 0)))
    arm = slider(tmp_path)
    assert sweep_one(arm, wall, 0.0, -1.0).closing
    assert not sweep_one(arm, wall, 0.0, 0.0).closing
