"""A guard that crashes, or computes wrongly, is told on the wire and started anew."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.contract import Contract
from tests.support.ears import Ears
from tests.support.processes import BENCH, START_S, Process, living_pid
from tests.support.rig import Rig
from tests.support.station import REST

pytestmark = pytest.mark.e2e

TOLD_S = 2.0 + 1.0
"""The canary is tried every two seconds."""


@pytest.fixture
def place(tmp_path: Path) -> Iterator[tuple[str, Ears]]:
    """An endpoint with a router and a machine at rest, and what a guard says there."""
    site, endpoint = load_site(BENCH), processes.free_endpoint()
    with (
        processes.router(tmp_path, endpoint),
        Ears(endpoint, site.keys.base) as ears,
        Rig(endpoint, site, REST),
    ):
        yield endpoint, ears


def false_guard(spoilt: Path, endpoint: str) -> list[str]:
    module = "tests.support.false_guard"
    return ["-m", module, str(spoilt), "run", str(BENCH), "--connect", endpoint]


def test_a_crash_is_told_by_name_until_acknowledged_and_guarded_again(
    tmp_path: Path, place: tuple[str, Ears], contract: Contract
) -> None:
    endpoint, ears = place
    with processes.guard(tmp_path, BENCH, endpoint) as guard:
        first = ears.wait("heartbeat", lambda b: b["status"] == "ok", 20.0, 0.0).body
        contract.check(first)
        assert first["canary"]["result"] == "ok"
        assert 0.0 <= first["canary"]["age_s"] < TOLD_S
        worker = processes.guarding(guard)
        crashed_s = time.monotonic()
        os.kill(worker, signal.SIGSEGV)
        beat = ears.wait(
            "heartbeat",
            lambda b: b["boot_id"] != first["boot_id"] and b["status"] == "ok",
            START_S,
            crashed_s,
        )
        assert processes.guarding(guard) != worker
        told = ears.wait("alert", lambda b: b["source"] == "system", 2.0, crashed_s).body
        contract.check(told)
        assert (told["level"], told["state"]) == ("caution", "unacked")
        assert told["text"] == "guard restarted after a crash (SIGSEGV)"
        # it stays until somebody has seen it
        later = ears.wait("alert", lambda b: b["source"] == "system", 5.0, beat.at_s + 2.0)
        assert (later.body["level"], later.body["state"]) == ("caution", "unacked")
        done = processes.command(
            *("ack", BENCH, later.body["alert_id"], "--who", "tester", "--connect", endpoint)
        )
        assert done.returncode == 0, done.stderr
        ears.wait(
            "alert",
            lambda b: b["source"] == "system" and b["level"] == "clear" and b["state"] == "normal",
            5.0,
            later.at_s,
        )
        assert guard.signal_and_wait(signal.SIGTERM) <= 2.0
        assert guard.popen.returncode == 0
        line = r"rampe-guard: the guard died of SIGSEGV; it is started anew in 0.1 s"
        assert len(re.findall(line, guard.err)) == 1
        assert "Fatal Python error: Segmentation fault" in guard.err  # where it was


def test_a_guard_whose_supervisor_is_killed_ends(tmp_path: Path, place: tuple[str, Ears]) -> None:
    endpoint, _ = place
    with processes.guard(tmp_path, BENCH, endpoint) as guard:
        worker = processes.guarding(guard)
        guard.popen.kill()
        guard.popen.wait()
        processes.until(lambda: not living_pid(worker), 5.0, f"the end of process {worker}")
        assert guard.err.rstrip().endswith("stopped")  # cleanly


def test_a_machine_that_computes_wrongly_says_so_and_starts_anew(
    tmp_path: Path, place: tuple[str, Ears], contract: Contract
) -> None:
    endpoint, ears = place
    spoilt = tmp_path / "spoilt"
    program = false_guard(spoilt, endpoint)
    with Process(tmp_path, "guard", program) as guard:
        guard.wait_for("guarding on")
        first = ears.wait("heartbeat", lambda b: b["status"] == "ok", 20.0, 0.0).body
        spoilt_s = time.monotonic()
        spoilt.touch()
        beat = ears.wait(
            "heartbeat", lambda b: b["status"] == "not_monitoring", TOLD_S, spoilt_s
        ).body
        contract.check(beat)
        assert beat["canary"]["result"] == "failed"
        assert [r["code"] for r in beat["reasons"]] == ["canary_failed"]
        assert beat["reasons"][0]["text"] == "canary failed: FCL collide called the hit apart"
        alert = ears.wait("alert", lambda b: b["source"] == "system", 1.0, spoilt_s).body
        contract.check(alert)
        assert (alert["level"], alert["state"]) == ("warning", "unacked")
        assert alert["text"].startswith("NOT MONITORING: canary failed: FCL collide")

        guard.wait_for("ended: the canary failed")
        assert "ended with exit code 3; it is started anew" in _soon(guard)
        again = ears.wait(
            "heartbeat", lambda b: b["boot_id"] != first["boot_id"], START_S, spoilt_s
        )
        assert again.body["status"] == "not_monitoring"  # it tries before it guards
        spoilt.unlink()
        ears.wait("heartbeat", lambda b: b["status"] == "ok", START_S, again.at_s)
        told = ears.wait(
            "alert", lambda b: b["level"] == "caution" and b["zone"] is None, 5.0, again.at_s
        )
        assert told.body["text"] == "guard restarted after a failed canary"
        guard.signal_and_wait(signal.SIGTERM)
        assert guard.popen.returncode == 0
        assert "Traceback" not in guard.err


def test_without_a_supervisor_it_is_one_process_that_ends_with_the_code(
    tmp_path: Path, place: tuple[str, Ears]
) -> None:
    endpoint, ears = place
    spoilt = tmp_path / "spoilt"
    spoilt.touch()
    program = false_guard(spoilt, endpoint)
    with Process(tmp_path, "guard", [*program, "--no-supervisor"]) as guard:
        guard.wait_for("guarding on")
        assert not processes.children(guard)
        ears.wait("heartbeat", lambda b: b["status"] == "not_monitoring", 5.0, 0.0)
        assert guard.popen.wait(10.0) == 3
    heard = [h.body for h in ears.all() if h.topic == "heartbeat"]
    assert {b["status"] for b in heard} == {"not_monitoring"}  # never a moment of trust


def _soon(guard: Process) -> str:
    """The log, once the supervisor has had its say."""
    guard.wait_for("started anew")
    return guard.err
