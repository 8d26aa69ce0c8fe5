"""``rampe-guard demo`` as a newcomer runs it, but on a pipe."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.processes import Identity, Process, living, until, watched_family

pytestmark = pytest.mark.e2e

END_S = 5.0
PARTS = 5
"""The demo itself, router, guard and its supervisor, operator."""


def wait_to_end(demo: Process, note: Callable[[], set[Identity]], within_s: float) -> None:
    deadline = time.monotonic() + within_s
    while demo.alive:
        note()
        assert time.monotonic() < deadline, f"the demo runs on:\n{demo.out}\n{demo.err}"
        time.sleep(0.1)


def test_one_cycle_to_its_summary(tmp_path: Path) -> None:
    args = ["-m", "rampe_guard", "demo", "--cycles", "1"]
    with Process(tmp_path, "demo", args) as demo, watched_family(demo) as note:
        wait_to_end(demo, note, 90.0)
        assert demo.popen.returncode == 0, demo.err
        assert len(note()) >= PARTS
        assert not living(note())
        assert "lead min" in demo.out
        assert "power-line" in demo.out
        assert "1 cycle" in demo.out
        assert not (tmp_path / "state").exists()  # a simulated operator is not remembered
        assert "Traceback" not in demo.err


@pytest.mark.parametrize("loading", [True, False], ids=["loading", "watching"])
def test_ctrl_c_ends_it_and_all_its_parts(tmp_path: Path, *, loading: bool) -> None:
    args = ["-m", "rampe_guard", "demo"]
    with Process(tmp_path, "demo", args) as demo, watched_family(demo) as note:
        until(lambda: len(note()) >= PARTS, 40.0, "all parts of the demo")
        if not loading:
            demo.wait_for("watching")
        assert demo.signal_and_wait(signal.SIGINT) <= END_S
        assert demo.popen.returncode == 0, demo.err
        assert not living(note())
        assert ("lead min" in demo.out) is not loading
        assert "Traceback" not in demo.err
