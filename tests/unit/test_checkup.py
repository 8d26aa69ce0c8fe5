"""`check`: what can be reached, what is not protected, and the picture."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from rampe_guard.assembly import Machine, load_machine
from rampe_guard.core.identify import Traces
from rampe_guard.errors import RampeGuardError
from rampe_guard.programs.checkup import checkup, verdict
from rampe_guard.programs.checkup_gaps import gaps, suspects
from rampe_guard.programs.checkup_live import Findings, against_clocks, against_motion
from rampe_guard.programs.checkup_picture import draw
from rampe_guard.programs.checkup_reach import POSTURES, Reach, reaches
from rampe_guard.programs.checkup_streams import Stream
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
    text = "\n".join(gaps(machine))
    assert "joint 'reach' is driven by no actuator and held at 0" in text
    assert "zone 'ground' does not guard against foot" in text
    assert "no alerts while y/on says that the machine is switched off" in text
    assert "the arm is not swept against itself" in text
    (look,) = suspects(machine, reach)
    assert look.startswith("zone 'inside' is met in 200 of 200 postures, mostly by column")


def test_the_last_line_tells_what_to_look_at(machine: Machine) -> None:
    """`inside` is legal, and met always: whoever reads only the last line learns of it."""
    out = io.StringIO()
    assert checkup(machine.site.path, Console(file=out, width=200)) == 0
    lines = out.getvalue().splitlines()
    assert lines[-1].startswith("ok: this site can be guarded, but look at the line above")
    assert sum(line.startswith("look: ") for line in lines) == 1


def _traces(sign: int, axis: int, speed: float = 0.8) -> Traces:
    """Turn and lift, each pushed by its lever from rest, 0.1 s late, at 50 Hz."""
    step_s, late, axes, position = 0.02, 5, [], []
    place = np.array([0.0, 0.6])
    for push in range(12):
        for tick in range(60):
            way = 1.0 if push // 2 % 2 else -1.0
            lever, moved = np.zeros(2), np.zeros(2)
            lever[push % 2] = way if tick < 25 else 0.0
            moved[push % 2] = way if late <= tick < 25 + late else 0.0
            said = np.zeros(2)
            said[axis], said[1 - axis] = sign * lever[0], lever[1]
            axes.append(said)
            place = place + step_s * moved * np.array([speed, 0.4])
            position.append(place)
    times = np.arange(len(axes), dtype=np.float64) * step_s
    return Traces(times, np.array(axes), times, np.array(position), ("turn", "lift"))


def test_motion_against_the_site_file_is_not_ok(machine: Machine) -> None:
    found = Findings()
    against_motion(machine.site, _traces(1, 0), found)
    assert not found.wrong
    assert verdict(0, found) == (0, "ok: this site can be guarded")
    for traces, words in (
        (_traces(-1, 0), "the site file's sign 1 should be -1"),
        (_traces(1, 1), "axis 1 moves it, and the site file says 0"),
        (_traces(1, 0, speed=1.4), "the site file's max_velocity is 0.9"),
    ):
        found = Findings()
        against_motion(machine.site, traces, found)
        assert words in "\n".join(found.wrong)
        code, last = verdict(3, found)
        assert code == 2
        assert last.startswith("not ok: machine and site file contradict each other")


def _heard(behind_s: Mapping[str, float]) -> list[Stream]:
    """Inputs whose stamps are so far behind their arrivals [s], and that may be silent for 1 s."""
    at_s = np.linspace(1e9, 1e9 + 2.0, 20, dtype=np.float64)
    return [
        Stream(name, f"y/{name}", at_s, at_s - np.float64(late_s), Counter(), 0.1, 1.0)
        for name, late_s in behind_s.items()
    ]


def test_one_clock_far_from_ours_is_looked_at(machine: Machine) -> None:
    """A guard works by it (it starts where it likes), but mostly it is a mistake."""
    found = Findings()
    streams = _heard({"joystick": 3600.0, "actuators": 3600.01, "object truck": 3600.0})
    against_clocks(streams, machine.site, found)
    assert len(found.looks) == 3
    assert "joystick: its clock is 1.0 h behind this computer's" in found.looks[0]
    code, last = verdict(0, found)
    assert code == 0
    assert last.startswith("ok: this site can be guarded, but look at the 3 lines")


@pytest.mark.parametrize(
    ("name", "behind_s", "good"),
    [
        ("joystick", 0.05, True),
        ("joystick", 3600.0, False),
        ("joystick", -3600.0, False),
        ("object truck", 0.8, True),  # poses may take a while
        ("object truck", 1.2, False),
        ("object truck", -0.4, False),  # nobody knows how old such poses are
        ("enabled", -0.4, False),
    ],
)
def test_two_clocks_are_not_ok(machine: Machine, name: str, behind_s: float, *, good: bool) -> None:
    found = Findings()
    against_clocks(_heard({"actuators": 0.0, name: behind_s}), machine.site, found)
    assert bool(found.wrong) is not good
    assert verdict(0, found)[0] == (0 if good else 2)


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
