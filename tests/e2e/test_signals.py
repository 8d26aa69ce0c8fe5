"""SIGTERM and SIGINT end the daemon soon and cleanly, whatever it is doing."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.processes import BENCH, DEMO, Process, descendants, living

pytestmark = pytest.mark.e2e

END_S = 2.0

both = pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])


@both
def test_ends_while_guarding(tmp_path: Path, number: signal.Signals) -> None:
    endpoint = processes.free_endpoint()
    with (
        processes.router(tmp_path, endpoint),
        processes.guard(tmp_path, BENCH, endpoint) as guard,
    ):
        family = descendants(guard.pid)
        assert guard.signal_and_wait(number) <= END_S
        assert guard.popen.returncode == 0
        assert guard.err.rstrip().endswith("stopped")
        assert "Traceback" not in guard.err
        assert not living(family)


@both
def test_ends_while_it_looks_for_a_router(tmp_path: Path, number: signal.Signals) -> None:
    endpoint = processes.free_endpoint()
    args = ["-m", "rampe_guard", "run", str(BENCH), "--connect", endpoint]
    with Process(tmp_path, "guard", args) as guard:
        guard.wait_for(f"no Zenoh router at {endpoint}")
        assert guard.signal_and_wait(number) <= END_S
        assert guard.popen.returncode == 0
        assert "Traceback" not in guard.err


def test_ends_while_it_loads(tmp_path: Path) -> None:
    args = ["-m", "rampe_guard", "run", str(DEMO)]  # the larger one: it takes seconds
    with Process(tmp_path, "guard", args) as guard:
        time.sleep(0.7)
        assert guard.signal_and_wait(signal.SIGTERM) <= END_S
        assert guard.popen.returncode == 0
        assert "zones loaded" not in guard.err, "it had loaded already: this showed nothing"
        assert "Traceback" not in guard.err
