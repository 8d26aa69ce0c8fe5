"""The oracle itself: it agrees with plain sampling and closed forms, and catches every lie."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.config import SweepConfig
from rampe_guard.core.drive import joint_value
from rampe_guard.core.scene import Box, Cylinder
from rampe_guard.core.types import Certificate, SweepResult, ZoneSweep
from rampe_guard.settings import load_site
from tests.support.arms import slider
from tests.support.compare import Referee
from tests.support.dense import DenseArm, first_contacts
from tests.support.hard_cases import make_batch
from tests.support.linkages import joint_from_actuator
from tests.support.machines import machine
from tests.support.motion import Motion
from tests.support.obstacles import ERROR_M, Obstacle
from tests.support.scenes import pose
from tests.support.search import STEP_M, ZoneTruth

SITES = Path(__file__).parents[2] / "config" / "sites"


@pytest.mark.parametrize("site", ["demo", "bench"])
def test_pins_in_the_plane_give_the_angles_of_the_formulas(site: str) -> None:
    arm = load_site(SITES / f"{site}.yaml").arm
    for joint in arm.joints:
        lower, upper = arm.limits[joint.actuator]
        q = np.linspace(-1.0 if lower is None else lower, 1.0 if upper is None else upper, 101)
        placed = [joint_from_actuator(joint.drive, value) for value in q.tolist()]
        assert np.allclose(placed, joint_value(joint.drive, q), atol=1e-12)


def test_a_search_that_skips_finds_what_sampling_without_skips_finds(tmp_path: Path) -> None:
    tried, _ = machine("six_axis", tmp_path)
    arm, met, free = tried.dense, 0, 0
    for seed, kind in enumerate(("middle", "thin")):
        made = make_batch(tried, kind, np.random.default_rng(seed), tmp_path, motions=2)
        for start, displacement in made.motions:
            motion = Motion(arm, start, displacement)
            plain = first_contacts(arm, list(made.items), start, displacement)
            for item, found in zip(made.items, plain, strict=True):
                truth = ZoneTruth(arm, motion, Obstacle(item))
                near, sure = truth.first(ERROR_M), truth.first(0.0)
                if truth.contained(0.0):
                    continue
                if near is None:
                    free += 1
                    assert found is None, item
                elif found is not None and sure is not None:
                    met += 1
                    assert near.fraction <= found.fraction
                    assert motion.moved(sure.link, sure.fraction, found.fraction) <= STEP_M
    assert met >= 3
    assert free >= 3


def _slide(folder: Path, margin: float = 0.0) -> tuple[DenseArm, list[Obstacle]]:
    """A box of 0.2 m on a rail: a post beside its way, 5 cm off, and a wall 1 m ahead."""
    wall = Box(name="wall", margin_m=margin, size_m=(0.2, 1.0, 1.0), pose=pose((1.2, 0, 0)))
    post = Cylinder(
        name="post", margin_m=margin, radius_m=0.1, height_m=1.0, pose=pose((0.5, 0.25, 0.0))
    )
    return DenseArm(slider(folder)), [Obstacle(wall), Obstacle(post)]


@pytest.mark.parametrize("margin", [0.0, 0.02])
def test_closed_forms_of_a_box_on_a_rail(tmp_path: Path, margin: float) -> None:
    arm, (wall, post) = _slide(tmp_path, margin)
    motion = Motion(arm, np.zeros(1), np.array([2.0]))
    truth = ZoneTruth(arm, motion, wall)
    first, last = truth.first(margin), truth.first(margin, backwards=True)
    assert first is not None
    assert last is not None
    assert first.fraction == pytest.approx(0.5 - margin / 2, abs=1e-6)
    assert last.fraction == pytest.approx(0.7 + margin / 2, abs=1e-6)
    beside = ZoneTruth(arm, motion, post)
    assert beside.minimum(1e-4).distance == pytest.approx(0.05, abs=3e-5)
    assert beside.least(0.06).distance == pytest.approx(0.05, abs=3e-5)
    assert beside.first(0.049) is None


def _claim(zone: str, **changes: object) -> ZoneSweep:
    honest = ZoneSweep(zone, Certificate.FREE, None, "tool", None, 0.04, 0.3, closing=True)
    return replace(honest, **changes)  # type: ignore[arg-type]


def _contact(zone: str, fraction: float) -> ZoneSweep:
    kind = Certificate.CONTACT
    return _claim(zone, certificate=kind, contact_fraction=fraction, clearance_m=0.0)


HONEST = (_contact("wall", 0.5 - 0.00005), _claim("post"))
"""Called 0.1 mm early; 5 cm beside, said to be 4."""


def _faults(folder: Path, *zones: ZoneSweep, backwards: bool = False) -> list[str]:
    arm, obstacles = _slide(folder)
    referee = Referee(arm, obstacles, np.zeros(1), np.array([2.0]), SweepConfig())
    verdicts = referee.judge(SweepResult(zones=zones), backwards=backwards)
    return sorted({fault for verdict in verdicts for fault in verdict.faults})


def test_an_honest_sweep_has_no_faults(tmp_path: Path) -> None:
    assert _faults(tmp_path, *HONEST) == []
    back = replace(HONEST[0], contact_fraction=0.3 - 0.00005)
    assert _faults(tmp_path, back, HONEST[1], backwards=True) == []


@pytest.mark.parametrize(
    ("zone", "fault"),
    [
        (_claim("wall"), "missed"),
        (_contact("wall", 0.5001), "late"),
        (_contact("wall", 0.4995), "early"),
        (_contact("post", 0.3), "false"),
        (_claim("post", clearance_m=0.0501), "clearance"),
        (_claim("post", clearance_m=-0.01), "loose"),
        (_claim("post", clearance_now_m=0.5), "now"),
        (_claim("wall", certificate=Certificate.UNKNOWN, contact_fraction=0.0), "unknown"),
    ],
)
def test_every_kind_of_lie_is_caught(tmp_path: Path, zone: ZoneSweep, fault: str) -> None:
    zones = [zone if zone.zone == honest.zone else honest for honest in HONEST]
    assert fault in _faults(tmp_path, *zones)
