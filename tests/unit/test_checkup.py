"""`check`: what can be reached, what is not protected, and the picture."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from rampe_guard.assembly import Machine, load_machine
from rampe_guard.errors import RampeGuardError
from rampe_guard.programs.checkup import checkup
from rampe_guard.programs.checkup_gaps import gaps
from rampe_guard.programs.checkup_picture import draw
from rampe_guard.programs.checkup_reach import POSTURES, Reach, reaches
from rampe_guard.settings import load_site
from tests.support import small_arm

SITE = """
site: yard
machine: arm
keys: {joystick: y/j, actuators: y/a, base: y/guard, enabled: y/on}
arm:
  urdf: small_arm.urdf
  actuators:
    - {name: turn, joint: turn, max_velocity: 0.9}
    - {name: lift, joint: lift, max_velocity: 0.5}
scene: scene.yaml
"""
SCENE = """
objects:
  - {name: far, type: sphere, radius_m: 0.5, center: [0, 9, 0]}
  - {name: near, type: box, size: [0.1, 4, 0.1], pose: {xyz: [0.9, 0, 0.6]}}
  - {name: behind, type: box, size: [0.3, 0.3, 0.3], pose: {xyz: [-1.2, 0, 0.6]}}
  - {name: inside, type: sphere, radius_m: 0.05, center: [0, 0, 0.4]}
  - {name: ground, type: halfspace, normal: [0, 0, 1], offset_m: -0.1, ignore_links: [foot]}
  - {name: truck, type: box, size: [1, 1, 1], key: y/truck, max_speed: 1}
  - {name: stop, type: actuator_limit, actuator: turn, above: 1.0}
  - {name: never, type: actuator_limit, actuator: lift, above: 1.5}
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    folder = tmp_path_factory.mktemp("checkup")
    small_arm.write_urdf(folder)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "site.yaml").write_text(SITE)
    return load_machine(load_site(folder / "site.yaml"))


@pytest.fixture(scope="module")
def reach(machine: Machine) -> dict[str, Reach]:
    return reaches(machine)


def test_what_cannot_be_reached_is_proven(reach: dict[str, Reach]) -> None:
    """`behind` is within the reach of the arm, but not of the turn, which ends at 143 degrees."""
    never = {name for name, one in reach.items() if one.unreachable}
    assert never == {"far", "behind", "never", "ground"}
    assert reach["far"].words == "never (proven)"


def test_what_is_met_now_and_then_or_always(reach: dict[str, Reach]) -> None:
    assert reach["inside"].always
    assert reach["inside"].inside == POSTURES
    assert reach["inside"].links.most_common(1)[0][0] == "column"
    assert 0 < reach["near"].inside < POSTURES
    assert not reach["near"].always
    assert reach["stop"].inside == pytest.approx(0.3 * POSTURES, rel=0.3)  # 1.5 of 5 rad
    assert reach["truck"].words == "-"  # nobody said where it is


def test_no_posture_is_met_where_it_was_proven_impossible(machine: Machine) -> None:
    """On a grid of its own, which the proof has never seen."""
    low, high = machine.arm.limits.T
    never = {name for name, one in reaches(machine).items() if one.unreachable}
    for share in np.stack(np.meshgrid(*[np.linspace(0, 1, 12)] * 2), -1).reshape(-1, 2):
        told = machine.sweeper.sweep(low + share * (high - low), np.zeros(2))
        assert not {zone.zone for zone in told.zones if zone.inside} & never


def test_what_is_not_protected_is_said(machine: Machine, reach: dict[str, Reach]) -> None:
    text = "\n".join(gaps(machine, reach))
    assert "joint 'reach' is driven by no actuator and held at 0" in text
    assert "zone 'ground' does not guard against foot" in text
    assert "zone 'inside' is met in 200 of 200 postures, mostly by column" in text
    assert "no alerts while y/on says that the machine is switched off" in text
    assert "the arm is not swept against itself" in text
    assert "ignores every link" not in text


def test_a_picture_shows_arm_and_zones(machine: Machine, tmp_path: Path) -> None:
    file = tmp_path / "arm.png"
    console = Console(file=io.StringIO(), width=120)
    assert checkup(machine.site.path, console, str(file)) == 0
    with Image.open(file) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape[1] > 1500
    dark = (np.abs(pixels - [0x30, 0x47, 0x5E]) < 40).all(axis=2)
    red = (pixels[..., 0] > pixels[..., 1] + 60) & (pixels[..., 0] > pixels[..., 2] + 40)
    for view in np.array_split(np.arange(pixels.shape[1]), 3):
        assert dark[:, view].sum() > 500
        assert red[:, view].sum() > 500


@pytest.mark.parametrize("name", ["arm.nothing", "no/folder/arm.png"])
def test_a_picture_that_cannot_be_written(machine: Machine, tmp_path: Path, name: str) -> None:
    with pytest.raises(RampeGuardError, match="cannot be written"):
        draw(machine, np.zeros(2), str(tmp_path / name))
