from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import fcl
import numpy as np
import pytest

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.core.scene import Scene, SelfCollision, Sphere
from rampe_guard.core.types import Certificate, ZoneSweep
from rampe_guard.errors import GeometryError
from rampe_guard.settings import load_site
from tests.support.arms import describe
from tests.support.dense import DenseArm

if TYPE_CHECKING:
    from rampe_guard.core.arm import ArmDescription
    from rampe_guard.core.types import FloatArray

DEMO = Path(__file__).parents[2] / "config" / "sites" / "demo.yaml"
ON = SelfCollision(enabled=True)
# post, a bracket without geometry, two bars that fold, and a tip that the second bar carries
FOLDING = """<robot name="folding">
  <link name="post"><collision><origin xyz="0 0 -0.6"/>
    <geometry><box size="0.2 0.2 1"/></geometry></collision></link>
  <link name="bracket"/>
  <link name="upper"><collision><origin xyz="0.5 0 0"/>
    <geometry><box size="0.9 0.1 0.1"/></geometry></collision></link>
  <link name="fore"><collision><origin xyz="0.5 0 0"/>
    <geometry><box size="0.9 0.1 0.1"/></geometry></collision></link>
  <link name="tip"><collision><origin xyz="0.8 0 0"/>
    <geometry><sphere radius="0.08"/></geometry></collision></link>
  <joint name="mount" type="fixed"><parent link="post"/><child link="bracket"/></joint>
  <joint name="turn" type="revolute"><parent link="bracket"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
  <joint name="fold" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="1 0 0"/><axis xyz="0 1 0"/><limit lower="-3.1" upper="3.1"/></joint>
  <joint name="carry" type="fixed"><parent link="fore"/><child link="tip"/></joint>
</robot>
"""


def folding(folder: Path) -> ArmDescription:
    (folder / "folding.urdf").write_text(FOLDING)
    return describe(folder / "folding.urdf", ["turn", "fold"])


def swept(sweeper: FclSweeper, start: FloatArray, displacement: FloatArray) -> dict[str, ZoneSweep]:
    zones = sweeper.sweep(start, displacement, clearance=False).zones
    return {zone.zone: zone for zone in zones}


def first_touch(
    arm: DenseArm, pair: tuple[str, str], start: FloatArray, way: FloatArray
) -> float | None:
    """First of samples 1 mm apart at which two links touch."""
    fractions = arm.samples(start, way)
    poses = arm.poses(start + fractions[:, None] * way)
    bodies = [arm.body(name) for name in pair]
    for k, fraction in enumerate(fractions.tolist()):
        one, other = (
            [piece.place_solid(poses[name][k]) for piece in body.pieces]
            for name, body in zip(pair, bodies, strict=True)
        )
        for a in one:
            for b in other:
                if fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()):
                    return float(fraction)
    return None


def test_neighbours_and_links_of_one_frame_are_no_pairs(tmp_path: Path) -> None:
    sweeper = FclSweeper(load_arm(folding(tmp_path)), Scene(()), self_collision=ON)
    # upper is the post's neighbour though a bracket is between them; tip and fore are one
    assert sweeper.zones == ("self:post", "self:upper")
    assert sweeper.always_touching == ()
    zones = swept(sweeper, np.array([0.0, 2.0]), np.array([0.0, 1.1]))
    assert zones["self:upper"].link == "tip"  # upper and fore are neighbours


def test_it_is_off_unless_asked_for(tmp_path: Path) -> None:
    arm = load_arm(folding(tmp_path))
    assert FclSweeper(arm, Scene(())).zones == ()
    assert FclSweeper(arm, Scene(()), None, SelfCollision()).zones == ()


def test_its_zones_come_after_those_of_the_scene(tmp_path: Path) -> None:
    ball = Sphere(name="ball", margin_m=0, radius_m=0.1, center_m=(9, 9, 9))
    sweeper = FclSweeper(load_arm(folding(tmp_path)), Scene((ball,)), None, ON)
    assert sweeper.zones == ("ball", "self:post", "self:upper")
    asked = sweeper.sweep(np.zeros(2), np.zeros(2), only=frozenset({"self:upper"}))
    assert [zone.zone for zone in asked.zones] == ["self:upper"]


@pytest.mark.parametrize("seed", range(12))
def test_a_folding_arm_against_dense_sampling(tmp_path: Path, seed: int) -> None:
    description = folding(tmp_path)
    arm, dense = load_arm(description), DenseArm(description)
    sweeper = FclSweeper(arm, Scene(()), None, ON)
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(arm.limits[:, 0], arm.limits[:, 1], size=(2, 2))
    way = end - start
    zones = swept(sweeper, start, way)
    for near, far in (("post", ("fore", "tip")), ("upper", ("tip",))):
        touches = [first_touch(dense, (near, link), start, way) for link in far]
        expected = min((t for t in touches if t is not None), default=None)
        zone = zones[f"self:{near}"]
        if expected is None:
            # a graze between two samples is a contact that they do not see
            assert zone.certificate is Certificate.FREE or _grazes(dense, near, far, start, way)
        else:
            assert zone.certificate is Certificate.CONTACT
            assert zone.contact_fraction is not None
            assert zone.contact_fraction <= expected
            moved = 2.0 * float(np.abs(way).sum())  # no point is farther than 2 m from a joint
            assert (expected - zone.contact_fraction) * moved <= 0.01


def _grazes(
    dense: DenseArm, near: str, far: tuple[str, ...], start: FloatArray, way: FloatArray
) -> bool:
    """Whether links come nearer to each other than 2 mm."""
    fractions = dense.samples(start, way)
    poses = dense.poses(start + fractions[:, None] * way)
    body = dense.body(near)
    for link in far:
        other = dense.body(link)
        for k in range(len(fractions)):
            for a in body.pieces:
                for b in other.pieces:
                    one, two = a.place(poses[near][k]), b.place(poses[link][k])
                    result = fcl.DistanceResult()
                    gap = fcl.distance(one, two, fcl.DistanceRequest(), result) - b.radius
                    if gap <= 0.002:
                        return True
    return False


def test_the_folding_arm_has_both_answers(tmp_path: Path) -> None:
    sweeper = FclSweeper(load_arm(folding(tmp_path)), Scene(()), None, ON)
    back = swept(sweeper, np.array([0.0, 0.5]), np.array([0.5, 1.0]))
    assert {zone.certificate for zone in back.values()} == {Certificate.FREE}
    folded = swept(sweeper, np.array([0.0, 1.0]), np.array([0.0, 2.1]))["self:upper"]
    assert folded.certificate is Certificate.CONTACT
    # the ball of 8 cm, 0.8 m from the joint, meets the face 5 cm above it
    at = (np.pi - np.arcsin(0.13 / 0.8) - 1.0) / 2.1
    assert folded.contact_fraction == pytest.approx(at, abs=0.002)


def test_the_margin_of_the_block_counts(tmp_path: Path) -> None:
    arm = load_arm(folding(tmp_path))
    wide = FclSweeper(arm, Scene(()), None, SelfCollision(enabled=True, margin_m=0.2))
    zone = swept(wide, np.array([0.0, 1.0]), np.array([0.0, 2.1]))["self:upper"]
    at = (np.pi - np.arcsin(0.33 / 0.8) - 1.0) / 2.1
    assert zone.margin_m == 0.2
    assert zone.contact_fraction == pytest.approx(at, abs=0.002)


def test_allowed_pairs_are_left_out(tmp_path: Path) -> None:
    asked = SelfCollision(enabled=True, allow=(("tip", "upper"), ("tip", "post")))
    sweeper = FclSweeper(load_arm(folding(tmp_path)), Scene(()), None, asked)
    assert sweeper.zones == ("self:post",)
    zone = swept(sweeper, np.array([0.0, 1.0]), np.array([0.0, 2.1]))["self:post"]
    assert zone.link in {None, "fore"}


@pytest.mark.parametrize("enabled", [True, False])
def test_unknown_names_are_refused(tmp_path: Path, enabled: bool) -> None:
    asked = SelfCollision(enabled=enabled, allow=(("upper", "forearm"),))
    words = "allows link 'forearm' to touch; the arm has post, bracket, upper, fore, tip"
    with pytest.raises(GeometryError, match=words):
        FclSweeper(load_arm(folding(tmp_path)), Scene(()), None, asked)


def test_pairs_that_always_touch_are_found(tmp_path: Path) -> None:
    """A ring on the post that the fore bar's tip cannot leave, once round it and once inside."""
    for size in ("9 9 0.05", "9 9 9"):
        text = FOLDING.replace("0.2 0.2 1", size).replace('xyz="0 0 -0.6"', 'xyz="0 0 0"')
        (tmp_path / "folding.urdf").write_text(text.replace('xyz="0 1 0"', 'xyz="0 0 1"'))
        arm = load_arm(describe(tmp_path / "folding.urdf", ["turn", "fold"]))
        sweeper = FclSweeper(arm, Scene(()), None, ON)
        assert sweeper.always_touching == (("post", "fore"), ("post", "tip"))
        assert sweeper.zones == ("self:upper",)


def test_the_excavator_is_clear_of_itself_in_the_middle_and_can_hit_its_tracks() -> None:
    site = load_site(DEMO)
    arm = load_arm(site.arm)
    sweeper = FclSweeper(arm, Scene(()), site.sweep, ON)
    assert set(sweeper.always_touching) == {
        ("boom", "boom_rod"),
        ("boom", "stick_barrel"),
        ("stick", "bucket_barrel"),
        ("rocker", "coupler"),
    }
    limits = np.where(np.isfinite(arm.limits), arm.limits, 0.0)
    middle = limits.mean(axis=1)
    zones = swept(sweeper, middle, np.zeros(4))
    assert {zone.certificate for zone in zones.values()} == {Certificate.FREE}
    # swung over a track, stick and bucket in: the bucket comes down on it
    way = np.array([0.8, 0.6, 1.34, 0.48]) - middle
    tracks = swept(sweeper, middle, way)["self:undercarriage"]
    touch = first_touch(DenseArm(site.arm), ("undercarriage", "bucket"), middle, way)
    assert touch is not None
    assert (tracks.certificate, tracks.link) == (Certificate.CONTACT, "bucket")
    assert tracks.contact_fraction is not None
    assert touch - 0.002 <= tracks.contact_fraction <= touch
