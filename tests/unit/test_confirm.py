from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.collision import confirm as confirming
from rampe_guard.collision.confirm import Confirmer, LinkPoses, triangles_near
from rampe_guard.collision.mesh import box_mesh, checked_mesh
from rampe_guard.collision.tree_build import build_tree
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, Scene, Sphere
from rampe_guard.core.types import Certificate, Placement, ZoneSweep
from rampe_guard.settings import load_site
from tests.support.arms import box_triangles, describe, slider, write_stl
from tests.support.machines import describe as describe_machine
from tests.support.scenes import notched_block, pose

DEMO = Path(__file__).parents[2] / "config" / "sites" / "demo.yaml"
CUP = """<robot name="cup">
  <link name="rail"/>
  <link name="cup"><collision><geometry><mesh filename="cup.stl"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="cup"/>
    <axis xyz="1 0 0"/><limit lower="-10" upper="10"/></joint>
</robot>
"""


def cup(folder: Path) -> FclSweeper:
    """A bucket of five plates that slides along x, open to +x: 1 m wide, 0.1 m thick."""
    plates = [
        box_triangles((0.1, 1.0, 1.0), (-0.45, 0, 0)),
        *(box_triangles((0.8, 0.1, 1.0), (0.0, y, 0)) for y in (-0.45, 0.45)),
        *(box_triangles((0.8, 0.8, 0.1), (0.0, 0, z)) for z in (-0.45, 0.45)),
    ]
    write_stl(folder / "cup.stl", np.concatenate(plates))
    (folder / "cup.urdf").write_text(CUP)
    return FclSweeper(load_arm(describe(folder / "cup.urdf", ["slide"])), Scene(()))


def one(arm: FclSweeper, item: object, start: float, way: float) -> ZoneSweep:
    sweeper = FclSweeper(arm.arm, Scene((item,)))  # type: ignore[arg-type]
    return sweeper.sweep(np.array([start]), np.array([way])).zones[0]


def test_an_object_in_the_hollow_of_a_bucket_is_free_until_it_meets_the_bottom(
    tmp_path: Path,
) -> None:
    arm = cup(tmp_path)
    ball = Sphere(name="stone", margin_m=0, radius_m=0.3, center_m=(2.0, 0, 0))
    free = one(arm, ball, 0.0, 1.9)  # the ball ends 0.3 m inside, its hull long since met
    assert free.certificate is Certificate.FREE
    assert free.confirmed is None
    met = one(arm, ball, 0.0, 2.5)  # the bottom's face at 0.4 behind, the ball's at 1.7
    assert met.certificate is Certificate.CONTACT
    assert met.contact_fraction == pytest.approx(2.1 / 2.5, abs=0.001)
    assert met.confirmed is True


@pytest.mark.parametrize(
    "item",
    [
        Box(name="z", margin_m=0, size_m=(1, 1, 1), pose=pose((3, 0, 0))),
        Sphere(name="z", margin_m=0, radius_m=0.5, center_m=(3, 0, 0)),
        Cylinder(name="z", margin_m=0, radius_m=0.5, height_m=1, pose=pose((3, 0, 0))),
        Capsule(name="z", margin_m=0, radius_m=0.5, start_m=(3, 0, 0), end_m=(3, 2, 2)),
        Capsule(name="z", margin_m=0, radius_m=0.5, start_m=(3, 0, 0), end_m=(3, 0, 0)),
    ],
    ids=["box", "sphere", "cylinder", "capsule", "capsule of no length"],
)
def test_every_solid_is_confirmed(tmp_path: Path, item: object) -> None:
    arm = FclSweeper(load_arm(slider(tmp_path)), Scene(()))
    zone = one(arm, item, 0.0, 3.0)
    assert zone.contact_fraction == pytest.approx(2.4 / 3.0, abs=0.001)
    assert zone.confirmed is True


def test_meshes_are_confirmed_on_all_their_triangles(tmp_path: Path) -> None:
    arm = FclSweeper(load_arm(slider(tmp_path)), Scene(()))
    place = pose((3, 0, 0.35))
    block = notched_block(tmp_path, 1.0)
    item = Mesh(name="z", margin_m=0, file=block, scale=1.0, pose=place)
    zone = one(arm, item, 0.0, 3.0)
    assert zone.contact_fraction == pytest.approx(2.4 / 3.0, abs=0.001)
    assert zone.confirmed is True


def test_what_is_not_asked(tmp_path: Path) -> None:
    arm = FclSweeper(load_arm(slider(tmp_path)), Scene(()))
    ball = Sphere(name="z", margin_m=0, radius_m=0.5, center_m=(3, 0, 0))
    assert one(arm, replace(ball, margin_m=0.1), 0.0, 3.0).confirmed is None
    at_start = one(arm, ball, 3.0, 1.0)
    assert (at_start.contact_fraction, at_start.confirmed) == (0.0, None)
    wall = Halfspace(name="z", margin_m=0, normal=(-1.0, 0, 0), offset_m=-2.0)
    met = one(arm, wall, 0.0, 3.0)
    assert (met.certificate, met.confirmed) == (Certificate.CONTACT, None)


def test_an_object_that_moves_is_confirmed_where_it_was_seen_just_now(tmp_path: Path) -> None:
    ball = Sphere(
        name="z", margin_m=0, radius_m=0.5, center_m=(0, 1, 0), key="k", max_speed=1, timeout_s=1
    )
    turned = np.array([[0.0, -1, 0, 4], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])  # ball at x = 3
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((ball,)))
    for grown, confirmed in ((0.0, True), (0.2, None)):
        placed = {"z": Placement(turned, grown)}
        zone = sweeper.sweep(np.zeros(1), np.array([3.0]), placed=placed).zones[0]
        assert zone.contact_fraction == pytest.approx((2.4 - grown) / 3.0, abs=0.001)
        assert zone.confirmed is confirmed


def test_what_fcl_denies_stays_a_contact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arm = FclSweeper(load_arm(slider(tmp_path)), Scene(()))
    ball = Sphere(name="z", margin_m=0, radius_m=0.5, center_m=(3, 0, 0))
    monkeypatch.setattr(confirming, "touching", lambda _a, _b: False)
    zone = one(arm, ball, 0.0, 3.0)
    assert (zone.certificate, zone.confirmed) == (Certificate.CONTACT, False)


def test_of_a_large_mesh_the_part_about_the_contact_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5)
    mesh = checked_mesh(ball.vertices * (1, 1, 0.5), ball.faces, "ball")
    # dented, so that it is not one convex part
    mesh = replace(mesh, vertices=mesh.vertices * (1 - 0.2 * (mesh.vertices[:, :1] > 0.9)))
    tree = build_tree(mesh)
    monkeypatch.setattr(confirming, "WHOLE", len(mesh.faces))
    whole, reach = triangles_near(tree, np.zeros(3))
    assert (len(whole), reach) == (len(mesh.faces), np.inf)
    monkeypatch.setattr(confirming, "WHOLE", 500)
    monkeypatch.setattr(confirming, "PATCH", 200)
    point = np.array([-1.0, 0, 0])
    near, reach = triangles_near(tree, point)
    assert 200 <= len(near) < 1000
    away = trimesh.triangles.closest_point(whole, np.tile(point, (len(whole), 1)))
    within = np.linalg.norm(away - point, axis=1) < reach
    assert 0.0 < reach < 0.5
    assert {t.tobytes() for t in whole[within]} <= {t.tobytes() for t in near}

    cube = build_tree(box_mesh(np.array([0.2, 0.2, 0.2])))
    item = Mesh(name="m", margin_m=0, file="m.stl", scale=1.0, pose=np.eye(4))
    asked = ((-1.05, True), (-1.15, False), (0.75, True), (0.95, False), (-1.0, True))
    confirmer = Confirmer((cube,), [(item, tree)])
    for x, expected in asked:
        assert confirmer.touches(0, pose((x, 0, 0)), "m", np.array([x, 0, 0])) is expected
    # and the other way round: the link is the large mesh
    box = Box(name="b", margin_m=0, size_m=(0.2, 0.2, 0.2), pose=pose((7, 0, 0)))
    turned = Confirmer((tree,), [(box, cube)])
    for x, expected in asked:
        assert turned.touches(0, pose((7 - x, 0, 0)), "b", np.array([7.0, 0, 0])) is expected
    assert confirmer.knows("m")
    assert not confirmer.knows("self:tool")


@pytest.mark.parametrize("name", ["excavator", "six_axis"])
def test_a_link_is_posed_as_all_links_are(tmp_path: Path, name: str) -> None:
    description, _ = describe_machine(name, tmp_path)
    arm = load_arm(description)
    sweeper, poses = FclSweeper(arm, Scene(())), LinkPoses(arm.chain, arm.joints)
    limits = np.where(np.isfinite(arm.limits), arm.limits, [-3.0, 3.0])
    low, high = limits.T
    for q in np.random.default_rng(0).uniform(low, high, size=(5, len(limits))):
        expected = sweeper.link_poses(q[None])[0]
        for link in range(len(arm.link_names)):
            assert poses.pose(link, q) == pytest.approx(expected[link], abs=1e-12)


def test_contacts_of_the_excavators_bent_boom_and_bucket_are_confirmed() -> None:
    """Small objects in the middle of ways, so that links' hollows and bends are about them."""
    site = load_site(DEMO)
    arm = load_arm(site.arm)
    probe = FclSweeper(arm, Scene(()))
    rng = np.random.default_rng(4)
    low, high = np.where(np.isfinite(arm.limits), arm.limits, [-1.0, 1.0]).T
    told = {True: 0, False: 0}
    for _ in range(40):
        start, end = rng.uniform(low, high, size=(2, 4))
        link = int(rng.choice([arm.link_names.index(name) for name in ("boom", "bucket")]))
        mesh = arm.meshes[link]
        assert mesh is not None
        at = probe.link_poses((0.5 * (start + end))[None])[0, link]
        vertex = at[:3, :3] @ mesh.vertices[rng.integers(len(mesh.vertices))] + at[:3, 3]
        x, y, z = vertex.tolist()
        ball = Sphere(name="b", margin_m=0, radius_m=0.05, center_m=(x, y, z))
        zone = FclSweeper(arm, Scene((ball,)), site.sweep).sweep(start, end - start).zones[0]
        assert zone.certificate is not Certificate.FREE
        if zone.confirmed is not None:
            told[zone.confirmed] += 1
    assert told[True] >= 30
    assert told[False] <= 2  # grazes
