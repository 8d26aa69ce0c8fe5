"""What `run` says while it loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.arms import box_triangles, slider, write_stl
from tests.support.processes import Process, free_endpoint

pytestmark = pytest.mark.e2e
SITE = """\
site: quarry
machine: e7
zenoh: {{mode: client, connect: ["{endpoint}"]}}
keys: {{joystick: r/joystick, actuators: r/actuators, base: r/guard}}
arm:
  urdf: slider.urdf
  actuators: [{{name: slide, joint: slide, max_velocity: 1.0}}]
scene: scene.yaml
"""
SCENE = "objects: [{name: rock, type: mesh, file: rock.stl, pose: {xyz: [5, 0, 0]}}]\n"


def test_run_says_once_what_was_mended(tmp_path: Path) -> None:
    slider(tmp_path)
    box = box_triangles((1, 1, 1))
    write_stl(tmp_path / "rock.stl", np.concatenate([box, box[:1]]))
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    site = tmp_path / "site.yaml"
    site.write_text(SITE.format(endpoint=free_endpoint()), encoding="utf-8")
    with Process(tmp_path, "guard", ["-m", "rampe_guard", "run", site]) as guard:
        guard.wait_for("zones loaded")
        note = f"object 'rock': {tmp_path / 'rock.stl'}: 1 triangle given twice left out"
        assert guard.err.count(note) == 1
        assert "\r" not in guard.err
