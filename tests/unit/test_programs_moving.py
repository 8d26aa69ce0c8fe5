"""`check` and offline `replay` of a site with an object that moves."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rampe_guard.programs.checkup import checkup
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.runtime.stopping import StopFlag
from tests.support.arms import slider

SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard}
arm:
  urdf: slider.urdf
  actuators:
    - {name: slide, joint: slide, max_velocity: 1.0, limits: {lower: -2, upper: 2}}
scene: scene.yaml
log: {time: t, joystick: {slide: u}, actuators: {slide: q}}
"""
SCENE = """\
objects:
  - {name: wall, type: box, size: [1, 1, 1], pose: {xyz: [5, 0, 0]}}
  - {name: truck, type: sphere, radius_m: 1, center: [0, 0, 0], key: r/truck, max_speed: 2}
"""


@pytest.fixture
def site(tmp_path: Path) -> str:
    slider(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    return str(tmp_path / "site.yaml")


def test_check_names_the_key_and_what_is_unknown(site: str) -> None:
    console = Console(file=io.StringIO(), width=120)
    assert checkup(site, console) == 0
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "poses of truck" in text
    assert "r/truck" in text
    assert "moves: unknown without a pose newer than 1 s" in text


def test_a_log_has_no_poses_so_the_truck_is_contact_throughout(
    site: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    u = np.sin(np.arange(100) * 0.2)
    q = np.cumsum(u) * 0.05
    rows = [f"{0.05 * k:.2f},{u[k]:.4f},{q[k]:.4f}" for k in range(100)]
    (tmp_path / "log.csv").write_text("\n".join(["t,u,q", *rows]), encoding="utf-8")
    lines = replay_offline(site, str(tmp_path / "log.csv"), StopFlag(), repeats=False)
    alerts = [json.loads(line) for line in lines]
    assert "the log has no poses of truck (r/truck): it is unknown throughout" in (
        capsys.readouterr().err
    )
    told = [(a["level"], a["quality"]) for a in alerts if a["zone"] == "truck"]
    assert told == [("imminent", "degraded")]
