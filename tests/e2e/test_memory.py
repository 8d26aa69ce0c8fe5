"""What an operator taught outlives the guard, is shown, exported and forgotten when he says so."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rampe_guard.runtime.store import situations_file
from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.ears import Ears, Heard
from tests.support.processes import BENCH, DEMO, ROOT, Process, called, command, environment, until
from tests.support.rig import Rig
from tests.support.station import HANDS_OFF

pytestmark = pytest.mark.e2e

SAVE_EVERY_S = 0.2
END_S = 2.0
WORK = (1.05, 0.065, 0.08, 0.03)


@dataclass
class Workplace:
    """A router, ears and a machine at the bench; guards come and go."""

    folder: Path
    site_path: Path
    endpoint: str
    rig: Rig
    ears: Ears

    @property
    def state(self) -> Path:
        return self.folder / "state"

    def model(self, operator: str = "operator") -> Path:
        return self.state / "bench" / "bench-excavator" / f"{operator}.npz"

    def guard(self, *more: str) -> Process:
        """A guard that sees its machine."""
        guard = processes.guard(self.folder, self.site_path, self.endpoint, *more)
        start_s = time.monotonic()
        self.ears.wait("heartbeat", lambda b: b["status"] != "not_monitoring", 20.0, start_s)
        return guard

    def swing(self, times: int) -> Heard:
        """Swing up and down; returns the newest primitive that was learned."""
        for _ in range(times):
            for lever, there in ((0.4, lambda: self.rig.position[0] >= 1.15), (-0.4, self._down)):
                start_s = time.monotonic()
                self.rig.levers = (lever, 0.0, 0.0, 0.0)
                until(there, 20.0, f"swing with the lever at {lever}")
                self.rig.levers = HANDS_OFF
                learned = self.ears.wait("prediction", _learned, 5.0, start_s)
        return learned

    def _down(self) -> bool:
        return self.rig.position[0] <= 1.02

    def saved(self, occurrences: int, operator: str = "operator") -> None:
        """Wait until a model of so many primitives is on the disk."""

        def there() -> bool:
            return _header(self.model(operator)).get("occurrences") == occurrences

        until(there, 10.0, f"{occurrences} primitives in {self.model(operator)}")


def _learned(body: dict[str, Any]) -> bool:
    return bool(body["event"] == "ended" and body["learned"])


def _header(path: Path) -> dict[str, Any]:
    """As any program with numpy can read it."""
    if not path.exists():
        return {}
    with np.load(path, allow_pickle=False) as arrays:
        header: dict[str, Any] = json.loads(arrays["header"].tobytes())
        return header


@pytest.fixture
def workplace(tmp_path: Path) -> Iterator[Workplace]:
    text = BENCH.read_text("utf-8")
    for old, new in (
        ("../../geometry", str(ROOT / "geometry")),
        ("../scenes", str(ROOT / "config" / "scenes")),
    ):
        text = text.replace(old, new)
    site_path = tmp_path / "bench.yaml"
    site_path.write_text(f"{text}\nmemory: {{save_every_s: {SAVE_EVERY_S}}}\n", "utf-8")
    site = load_site(site_path)
    endpoint = processes.free_endpoint()
    with (
        processes.router(tmp_path, endpoint),
        Ears(endpoint, site.keys.base) as ears,
        Rig(endpoint, site, WORK) as rig,
    ):
        yield Workplace(tmp_path, site_path, endpoint, rig, ears)


def test_what_was_learned_outlives_the_guard_and_goes_when_told(workplace: Workplace) -> None:
    site = workplace.site_path
    args = (site, "--operator", "Anna")
    nothing = called("model", "show", site, state=workplace.state)
    assert nothing.returncode == 2
    assert "nothing is kept of operator 'operator' yet" in nothing.stderr
    with workplace.guard() as guard:
        assert f"nothing learned yet, there is no {workplace.model()}" in guard.err
        workplace.swing(2)
        workplace.saved(4)  # in time
        last = workplace.swing(1).body["category"]
        assert guard.signal_and_wait(signal.SIGTERM) <= END_S
        assert guard.popen.returncode == 0
        assert _header(workplace.model())["occurrences"] == 6  # and in the end
    situations = situations_file(workplace.model()).path
    remembered = _header(situations)["occurrences"]
    assert remembered > 10

    with workplace.guard() as guard:
        assert f"6 primitives of 2 categories known from {workplace.model()}" in guard.err
        assert f"{remembered} situations of 0.0 h of work known from {situations}" in guard.err
        start_s = time.monotonic()
        beat = workplace.ears.wait("heartbeat", lambda b: b["memory"] is not None, 5.0, start_s)
        assert beat.body["memory"]["situations"] >= remembered
        workplace.rig.levers = (0.4 * last[0], 0.0, 0.0, 0.0)
        first = workplace.ears.wait("prediction", lambda b: b["event"] == "started", 5.0, start_s)
        workplace.rig.levers = HANDS_OFF
        assert first.body["observations"] == 3  # known before it did anything in this run
        assert first.body["mean"]["swing"] * last[0] > 0.0
        workplace.ears.wait("prediction", _learned, 5.0, start_s)
        workplace.saved(7)
        shown = called("model", "show", site, state=workplace.state)  # also while it runs
        assert shown.returncode == 0, shown.stderr
        assert "7 primitives of 2 categories" in shown.stdout
        assert str(workplace.model()) in shown.stdout.replace("\n", "").replace(" ", "")
        held = called("model", "reset", site, state=workplace.state)
        assert held.returncode == 2
        assert f"is held by a running guard, process {processes.guarding(guard)}" in held.stderr
        assert workplace.model().exists()
        processes.kill_guard(guard)  # it cannot save now, nor give the lock back

    with workplace.guard("--operator", "Anna") as guard:
        assert "operator 'Anna': nothing learned yet" in guard.err
        guard.signal_and_wait(signal.SIGINT)
    assert called("model", "show", *args, state=workplace.state).returncode == 2

    exported = called("model", "export", site, state=workplace.state)
    model = json.loads(exported.stdout)
    assert model["situations"]["count"] >= remembered  # the kill took only what was new
    assert model["header"]["occurrences"] == sum(r["occurrences"] for r in model["categories"]) == 7
    assert {tuple(r["category"]) for r in model["categories"]} == {(1, 0, 0, 0), (-1, 0, 0, 0)}
    for row in model["categories"]:
        assert row["mean_displacement"]["swing"] * row["category"][0] > 0.0
    _forget(workplace)


def _forget(workplace: Workplace) -> None:
    site = workplace.site_path
    forgotten = called("model", "reset", site, state=workplace.state)
    assert forgotten.returncode == 0, forgotten.stderr
    assert f"deleted {workplace.model()}" in forgotten.stdout
    left = [path.name for path in workplace.model().parent.iterdir()]
    assert [name for name in left if name.startswith("operator")] == []
    for action in ("show", "export"):
        gone = called("model", action, site, state=workplace.state)
        assert (gone.returncode, gone.stdout) == (2, "")
        assert "Traceback" not in gone.stderr


def test_a_guard_that_is_killed_loses_only_what_was_not_saved(workplace: Workplace) -> None:
    with workplace.guard() as guard:
        workplace.swing(1)
        workplace.saved(2)
        processes.kill_guard(guard)
    with workplace.guard() as guard:
        assert "2 primitives of 2 categories known" in guard.err


def test_a_spoilt_model_is_set_aside_and_the_guard_works(workplace: Workplace) -> None:
    with workplace.guard() as guard:
        workplace.swing(1)
        guard.signal_and_wait(signal.SIGTERM)
    spoilt = workplace.model().read_bytes()[:-40]
    workplace.model().write_bytes(spoilt)
    shown = called("model", "show", workplace.site_path, state=workplace.state)
    assert shown.returncode == 2
    assert "it is damaged or no model file" in shown.stderr
    with workplace.guard() as guard:
        aside = workplace.model().with_name("operator.npz.refused-1")
        assert aside.read_bytes() == spoilt
        assert guard.err.count("operator.npz is not used: it is damaged") == 1
        assert "rename it back, or delete it" in guard.err
        workplace.swing(1)
        workplace.saved(2)
        assert guard.alive
        assert "Traceback" not in guard.err
    assert aside.read_bytes() == spoilt
    forgotten = called("model", "reset", workplace.site_path, state=workplace.state)
    assert forgotten.returncode == 0
    assert not aside.exists()  # forgotten means all of it


def test_a_folder_that_cannot_be_written_degrades_and_is_told(workplace: Workplace) -> None:
    workplace.state.write_bytes(b"a file where the folder should be")
    with workplace.guard() as guard:
        beat = workplace.ears.wait("heartbeat", lambda b: b["reasons"] != [], 10.0, 0.0)
        beat = workplace.ears.wait(
            "heartbeat", lambda b: b["status"] == "degraded", 10.0, beat.at_s
        )
        reason, alerts = beat.body["reasons"]
        assert alerts["code"] == "alerts_not_kept"
        assert reason["code"] == "model_not_kept"
        assert "Not a directory" in reason["text"]
        workplace.swing(1)
        assert guard.signal_and_wait(signal.SIGTERM) <= END_S
        assert guard.popen.returncode == 0
        assert guard.err.count("WARNING rampe_guard: what is learned is not kept") == 1
        assert "status degraded: what is learned is not kept" in guard.err
        assert "Traceback" not in guard.err


def test_reset_at_a_terminal_wants_yes(workplace: Workplace) -> None:
    with workplace.guard() as guard:
        workplace.swing(1)
        guard.signal_and_wait(signal.SIGTERM)
    near, far = pty.openpty()
    try:
        reset = [sys.executable, "-m", "rampe_guard", "model", "reset", str(workplace.site_path)]
        for more, code in (([], 2), (["--yes"], 0)):
            done = subprocess.run(
                [*reset, *more],
                stdin=far,
                capture_output=True,
                cwd=ROOT,
                encoding="utf-8",
                timeout=60,
                check=False,
                env=environment(workplace.state),
            )
            assert done.returncode == code, done.stderr
            assert workplace.model().exists() is (code == 2)
            assert ("give --yes to do it" in done.stderr) is (code == 2)
    finally:
        os.close(near)
        os.close(far)


def test_offline_replay_neither_uses_nor_keeps_a_model(tmp_path: Path) -> None:
    log = tmp_path / "start.csv"
    lines = (ROOT / "tests" / "replay" / "quarry.csv").read_text("utf-8").splitlines(keepends=True)
    log.write_text("".join(lines[:60]), "utf-8")
    state = tmp_path / "state"
    done = command("replay", DEMO, log, state=state)
    assert done.returncode == 0, done.stderr
    assert not state.exists()


def test_a_name_that_is_none_ends_with_2() -> None:
    for run, args in (
        (command, ("run",)),
        (called, ("model", "show")),
        (called, ("model", "reset")),
    ):
        done = run(*args, BENCH, "--operator", " ")
        assert done.returncode == 2
        assert "operator ' ' is no name" in done.stderr
        assert "Traceback" not in done.stderr
