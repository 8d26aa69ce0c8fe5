from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rampe_guard import kernel_cache
from rampe_guard.assembly import load_machine
from rampe_guard.collision.shape_cache import ENVIRONMENT
from rampe_guard.programs.checkup import checkup
from rampe_guard.runtime import loading
from rampe_guard.runtime.loading import COMPILING, BuildLine, StatusLine, load_telling
from rampe_guard.settings import load_site
from tests.support.arms import box_triangles, fork_triangles, six_axis, write_stl

SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard}
arm:
  urdf: six_axis.urdf
  actuators:
    - {name: a, joint: j1, max_velocity: 1.0}
    - {name: b, joint: j2, max_velocity: 1.0}
    - {name: c, joint: j3, max_velocity: 1.0}
scene: scene.yaml
self_collision: {enabled: true, margin_m: 0.01, allow: [[shoulder, fore]]}
"""
SCENE = """\
objects:
  - {name: rock, type: mesh, file: rock.stl, pose: {xyz: [5, 0, 0]}}
"""


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def site(tmp_path: Path) -> str:
    six_axis(tmp_path)
    box = box_triangles((1, 1, 1))
    write_stl(tmp_path / "rock.stl", np.concatenate([box, box[:1]]))
    fork = fork_triangles()
    write_stl(tmp_path / "fork.stl", np.concatenate([fork, fork[:1]]))
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    return str(tmp_path / "site.yaml")


def test_on_a_terminal_one_line_is_overwritten_and_cleared() -> None:
    out, clock, said = Terminal(), Clock(), list[str]()
    line = BuildLine(out, said.append, clock)
    line("reading terrain.stl", 0.0)
    clock.now_s += 0.25
    line("wrapping terrain.stl", 0.4)
    line("wrapping terrain.stl", 0.41)  # too soon to be seen
    clock.now_s += 0.25
    line("wrapping terrain.stl", 0.6)
    line("built terrain.stl", 1.0)
    shown = ["wrapping terrain.stl: 40 %", "wrapping terrain.stl: 60 %", ""]
    assert out.getvalue() == "".join(f"\r\x1b[K{text}" for text in shown)
    line("wrapping small.stl", 0.5)
    line("built small.stl", 1.0)
    assert out.getvalue().count("\r") == 3
    assert said == []


def test_on_a_pipe_there_is_a_sentence_for_each_mesh_that_takes_long() -> None:
    out, clock, said = io.StringIO(), Clock(), list[str]()
    line = BuildLine(out, said.append, clock)
    for name, step_s in (("small.stl", 0.1), ("terrain.stl", 1.5), ("heap.stl", 1.1)):
        line(f"reading {name}", 0.0)
        for tenth in range(1, 5):
            clock.now_s += step_s
            line(f"wrapping {name}", 0.1 * tenth)
        line(f"built {name}", 1.0)
    assert out.getvalue() == ""
    assert [text.partition(";")[0] for text in said] == [
        "wrapping terrain.stl: 20 %",
        "wrapping heap.stl: 20 %",
    ]


@pytest.mark.parametrize("terminal", [True, False])
def test_work_that_takes_long_is_told_at_once_or_now_and_then(*, terminal: bool) -> None:
    out, clock, said = Terminal() if terminal else io.StringIO(), Clock(), list[str]()
    line = StatusLine(out, said.append, clock, again_s=10.0)
    line.show("reading", at_once=True)
    for step in range(15):
        clock.now_s += 1.5
        line.show(f"step {step}")
    line.clear()
    if terminal:
        assert out.getvalue().startswith("\r\x1b[Kreading\r\x1b[Kstep 0\r")
        assert out.getvalue().endswith("step 14\r\x1b[K")
        assert said == []
    else:
        assert out.getvalue() == ""
        assert said == ["step 1", "step 8"]


def test_compiling_is_said_where_no_kernels_are_kept(
    site: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(loading, "load_machine", lambda _site, _progress: None)
    for kept in (True, False):
        monkeypatch.setattr(kernel_cache, "kept", lambda kept=kept: kept)
        load_telling(load_site(site), said.append)
    assert said == [COMPILING]
    program = "from rampe_guard import kernel_cache; print(kernel_cache.kept())"
    answer = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "none")},
        check=True,
        capture_output=True,
        text=True,
    )
    assert answer.stdout == "False\n"


def test_after_a_sweep_there_are_kernels_and_processes_share_them(site: str) -> None:
    load_telling(load_site(site))
    assert kernel_cache.kept()
    program = "from rampe_guard import kernel_cache; print(kernel_cache.kept())"
    answer = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    assert answer.stdout == "True\n"
    assert "pytest" in os.environ[ENVIRONMENT]


def test_the_whole_of_a_mesh_being_wrapped_is_told(site: str) -> None:
    told: list[tuple[str, float]] = []
    folder = Path(site).parent
    os.environ[ENVIRONMENT], before = str(folder / "cache"), os.environ[ENVIRONMENT]
    try:
        for _ in range(2):
            load_machine(load_site(site), lambda what, share: told.append((what, share)))
    finally:
        os.environ[ENVIRONMENT] = before
    words = [what for what, _ in told]
    assert "wrapping rock.stl" in words
    assert "wrapping link tool" in words
    assert "kept from before rock.stl" in words
    assert "kept from before link tool" in words
    assert all(0.0 <= share <= 1.0 for _, share in told)


def test_check_prints_notes_and_what_the_arm_may_hit_of_itself(site: str) -> None:
    folder = Path(site).parent
    urdf = folder / "six_axis.urdf"  # with a base so large that no link can leave it
    urdf.write_text(urdf.read_text().replace('radius="0.08" length="0.1"', 'radius="3" length="9"'))
    console = Console(file=io.StringIO(), width=200)
    assert checkup(site, console) == 0
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert f"note: {folder / 'fork.stl'}: 1 triangle given twice left out" in text
    assert f"note: object 'rock': {folder / 'rock.stl'}: 1 triangle given twice left out" in text
    said = "note: links that always touch are not swept: base and upper, base and fore, base and"
    assert said in text
    own = [line.split() for line in text.splitlines() if line.startswith("self:")]
    assert [words[0] for words in own] == ["self:shoulder", "self:upper"]
    assert all(words[1:6] == ["the", "arm", "itself", "0.01", "m"] for words in own)


def test_check_says_once_that_shapes_cannot_be_kept(
    site: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Path(site).parent / "file"
    file.touch()
    monkeypatch.setenv(ENVIRONMENT, str(file))
    console = Console(file=io.StringIO(), width=200)
    assert checkup(site, console) == 0
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert text.count("cannot be kept") == 1
