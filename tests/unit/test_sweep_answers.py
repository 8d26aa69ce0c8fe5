"""What a sweep answers besides contact: clearance, unknown, limits, any path, repeatability."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.drive import CylinderDrive
from rampe_guard.core.scene import ActuatorLimit, Box, Scene, Sphere
from rampe_guard.core.types import AnyPath, Certificate, SweepResult
from tests.support.arms import gantry, pendulum, six_axis, slider
from tests.support.scenes import pose, random_motion, random_scene

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.types import FloatArray

WALL = Box(name="wall", margin_m=0.2, size_m=(1, 4, 4), pose=pose((3, 0, 0)))


def test_clearances_of_each_zone_within_the_tolerance(tmp_path: Path) -> None:
    ball = Sphere(name="ball", margin_m=0.0, radius_m=0.5, center_m=(1.0, 2.0, 0.0))
    config = SweepConfig(clearance_tolerance_m=0.01)
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((WALL, ball)), config)
    wall, other = sweeper.sweep(np.array([-1.0]), np.array([2.5])).zones
    assert wall.clearance_m == pytest.approx(2.5 - 1.5 - 0.1 - 0.2, abs=0.01)
    assert wall.clearance_now_m == pytest.approx(2.5 + 1.0 - 0.1 - 0.2, abs=0.01)
    # the cube passes below the ball: its top at y = 0.1, the ball's bottom at 1.5
    assert other.clearance_m == pytest.approx(1.4, abs=0.0101)
    assert (other.clearance_m or 0.0) <= 1.4
    corner = np.hypot(1.9, 1.9) - 0.5
    assert other.clearance_now_m == pytest.approx(corner, abs=0.01)
    assert (wall.margin_m, other.margin_m) == (0.2, 0.0)


def test_without_clearance_the_certificates_are_the_same(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    arm = load_arm(six_axis(tmp_path))
    sweeper = FclSweeper(arm, Scene(tuple(random_scene(rng, tmp_path, 1.0))))
    for _ in range(5):
        start, displacement = random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.3)
        full = sweeper.sweep(start, displacement)
        quick = sweeper.sweep(start, displacement, clearance=False)
        for a, b in zip(full.zones, quick.zones, strict=True):
            assert a.certificate is b.certificate
            assert a.contact_fraction == pytest.approx(b.contact_fraction, abs=1e-3)
            if a.certificate is Certificate.FREE:
                assert b.clearance_m is not None
                assert a.clearance_m is not None
                assert b.clearance_m <= a.clearance_m + SweepConfig().clearance_tolerance_m


def test_wider_margins_are_those_of_a_scene_with_wider_margins(tmp_path: Path) -> None:
    wide = replace(WALL, margin_m=WALL.margin_m + 0.3)
    arm = load_arm(slider(tmp_path))
    sweeper, other = FclSweeper(arm, Scene((WALL,))), FclSweeper(arm, Scene((wide,)))
    seen = set()
    for start, way in ((-1.0, 2.5), (-1.0, 3.0), (1.0, 0.5), (2.0, -1.0), (2.3, -1.0), (-1.0, 4.0)):
        motion = np.array([start]), np.array([way])
        for sharp in (True, False):
            (a,) = sweeper.sweep(*motion, clearance=sharp, wider_m=0.3).zones
            (b,) = other.sweep(*motion, clearance=sharp).zones
            seen.add(a.certificate)
            assert (a.certificate, a.contact_fraction) == (b.certificate, b.contact_fraction)
            assert a.closing is b.closing
            assert a.margin_m == WALL.margin_m
            assert a.clearance_now_m == pytest.approx((b.clearance_now_m or 0.0) + 0.3)
    assert seen == {Certificate.FREE, Certificate.CONTACT}


def _timeless(result: SweepResult) -> SweepResult:
    return replace(result, elapsed_ms=None)


def test_the_same_call_gives_the_same_answer_whatever_came_before(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    arm = load_arm(six_axis(tmp_path))
    scene = Scene(tuple(random_scene(rng, tmp_path, 0.9)))
    sweeper = FclSweeper(arm, scene)
    motions = [random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.3) for _ in range(6)]
    once = [_timeless(sweeper.sweep(*motion)) for motion in motions]
    again = [_timeless(FclSweeper(arm, scene).sweep(*motion)) for motion in motions]
    assert once == again


def test_what_the_last_sweep_left_changes_no_verdict(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    arm = load_arm(six_axis(tmp_path))
    scene = Scene(tuple(random_scene(rng, tmp_path, 0.9)))
    sweeper, config = FclSweeper(arm, scene), SweepConfig()
    start, displacement = random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.3)
    for step in range(20):  # each begins where the last one nearly did, and uses its directions
        here = start + 0.004 * step * displacement
        reused = sweeper.sweep(here, displacement)
        fresh = FclSweeper(arm, scene).sweep(here, displacement)
        for a, b in zip(reused.zones, fresh.zones, strict=True):
            assert a.certificate is b.certificate
            assert a.contact_fraction == pytest.approx(b.contact_fraction, abs=1e-3)
            if a.clearance_m is not None:
                assert a.clearance_m == pytest.approx(
                    b.clearance_m, abs=config.clearance_tolerance_m
                )


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", [0, 1])
def test_unfit_numbers_are_unknown_never_free(tmp_path: Path, bad: float, where: int) -> None:
    limit = ActuatorLimit(name="end", actuator=0, above=100.0)
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((WALL, limit)))
    values = [np.zeros(1), np.zeros(1)]
    values[where][0] = bad
    result = sweeper.sweep(*values, any_path=True)
    assert {zone.certificate for zone in result.zones} == {Certificate.UNKNOWN}
    assert result.any_path is AnyPath.UNKNOWN
    assert all(zone.closing and zone.clearance_m is None for zone in result.zones)


@pytest.mark.parametrize("shape", [(2,), (1, 1), ()])
def test_wrong_length_is_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((WALL,)))
    with pytest.raises(ValueError, match="1 actuators"):
        sweeper.sweep(np.zeros(shape), np.zeros(1))
    with pytest.raises(ValueError, match="1 actuators"):
        sweeper.sweep(np.zeros(1), np.zeros(shape))


def test_beyond_what_a_linkage_can_do_is_unknown_from_there(tmp_path: Path) -> None:
    drive = CylinderDrive(0.8, 2.3, 1.7, -1.4)
    far = Sphere(name="far", margin_m=0, radius_m=0.1, center_m=(50, 0, 0))
    arm = load_arm(pendulum(tmp_path, drive, (0.0, 1.2)))
    sweeper = FclSweeper(arm, Scene((far,)))
    (zone,) = sweeper.sweep(np.array([0.5]), np.array([2.0])).zones
    assert zone.certificate is Certificate.UNKNOWN
    assert zone.contact_fraction == pytest.approx((arm.proven[0, 1] - 0.5) / 2.0)
    (zone,) = sweeper.sweep(np.array([5.0]), np.array([0.1])).zones
    assert (zone.certificate, zone.contact_fraction) == (Certificate.UNKNOWN, 0.0)


def test_a_contact_before_the_end_of_what_is_known_is_a_contact(tmp_path: Path) -> None:
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((WALL,)))
    (zone,) = sweeper.sweep(np.array([0.0]), np.array([30.0])).zones
    assert zone.certificate is Certificate.CONTACT
    assert zone.contact_fraction == pytest.approx(2.2 / 30, abs=1e-4)


def _budget(folder: Path, queries: int, start: FloatArray, displacement: FloatArray) -> SweepResult:
    rng = np.random.default_rng(4)
    config = SweepConfig(max_queries=queries)
    scene = Scene(tuple(random_scene(rng, folder, 0.8)))
    return FclSweeper(load_arm(six_axis(folder)), scene, config).sweep(start, displacement)


def test_a_spent_budget_is_unknown_and_never_contradicts_the_truth(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    start, displacement = random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.4)
    truth = _budget(tmp_path, 100_000, start, displacement)
    kinds = set()
    for queries in (0, 1, 5, 20, 40, 80):
        result = _budget(tmp_path, queries, start, displacement)
        assert result.queries <= queries
        for a, b in zip(result.zones, truth.zones, strict=True):
            kinds.add(a.certificate)
            if a.certificate is Certificate.FREE:
                assert b.certificate is Certificate.FREE
            else:
                assert a.contact_fraction is not None
            if b.contact_fraction is not None:
                assert a.contact_fraction is not None
                assert a.contact_fraction <= b.contact_fraction + 1e-12
            if a.certificate is Certificate.UNKNOWN:
                assert a.clearance_m is None
    assert Certificate.UNKNOWN in kinds


@pytest.mark.parametrize(
    ("start", "displacement", "certificate", "fraction", "clearance", "closing"),
    [
        (0.0, 2.0, Certificate.CONTACT, 0.5, 0.0, True),
        (0.0, 0.6, Certificate.FREE, None, 0.4, True),
        (0.0, -0.6, Certificate.FREE, None, 1.0, False),
        (0.0, -4.0, Certificate.CONTACT, 0.5, 0.0, False),
        (1.5, -1.0, Certificate.CONTACT, 0.0, 0.0, False),
        (1.0, 0.0, Certificate.CONTACT, 0.0, 0.0, False),
        (0.5, 0.0, Certificate.FREE, None, 0.5, False),
    ],
)
def test_actuator_limits_in_closed_form(
    tmp_path: Path,
    start: float,
    displacement: float,
    certificate: Certificate,
    fraction: float | None,
    clearance: float,
    closing: bool,
) -> None:
    limit = ActuatorLimit(name="end", actuator=0, above=1.0, below=-2.0)
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((limit,)))
    (zone,) = sweeper.sweep(np.array([start]), np.array([displacement])).zones
    assert zone.certificate is certificate
    assert zone.contact_fraction == fraction
    assert zone.clearance_m == pytest.approx(clearance)
    assert zone.clearance_now_m == pytest.approx(min(1.0 - start, start + 2.0))
    assert zone.closing == closing
    assert (zone.link, zone.contact_point_m) == (None, None)


@pytest.mark.parametrize(
    ("center", "answer"),
    [
        ((2.0, 0.0, 0.0), AnyPath.POSSIBLE),  # x first, then y
        ((0.0, 2.0, 0.0), AnyPath.POSSIBLE),
        ((1.0, 1.0, 0.0), AnyPath.POSSIBLE),  # the straight way itself
        ((2.5, 0.0, 0.0), AnyPath.FREE),
        ((-0.5, 1.0, 0.0), AnyPath.FREE),
        ((1.0, 1.0, 0.5), AnyPath.FREE),
    ],
)
def test_any_monotone_way(
    tmp_path: Path, center: tuple[float, float, float], answer: AnyPath
) -> None:
    ball = Sphere(name="ball", margin_m=0.0, radius_m=0.3, center_m=center)
    sweeper = FclSweeper(load_arm(gantry(tmp_path)), Scene((ball,)))
    result = sweeper.sweep(np.zeros(2), np.array([2.0, 2.0]), any_path=True)
    assert result.any_path is answer
    assert sweeper.sweep(np.zeros(2), np.array([2.0, 2.0])).any_path is None


def test_any_path_is_unknown_when_the_budget_ends(tmp_path: Path) -> None:
    ball = Sphere(name="ball", margin_m=0.0, radius_m=0.3, center_m=(2.401, 0.0, 0.0))
    config = SweepConfig(max_queries=12)
    sweeper = FclSweeper(load_arm(gantry(tmp_path)), Scene((ball,)), config)
    result = sweeper.sweep(np.zeros(2), np.array([2.0, 2.0]), any_path=True, clearance=False)
    assert result.certificate is Certificate.FREE
    assert result.any_path is AnyPath.UNKNOWN


def test_ignored_links_may_touch(tmp_path: Path) -> None:
    wall = replace(WALL, ignore_links=("tool",))
    sweeper = FclSweeper(load_arm(slider(tmp_path)), Scene((wall,)))
    (zone,) = sweeper.sweep(np.zeros(1), np.array([5.0])).zones
    assert zone.certificate is Certificate.FREE


def test_a_scene_without_objects(tmp_path: Path) -> None:
    result = FclSweeper(load_arm(slider(tmp_path)), Scene(())).sweep(np.zeros(1), np.ones(1))
    assert result.zones == ()
    assert result.certificate is Certificate.FREE
