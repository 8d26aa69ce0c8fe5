"""Work recorded beside a real guard: killed, rotated, on a full disk; and replayed as it was live.

One stretch of work is recorded by three recorders at once: one is killed in the middle of it, one
finds its disk full for a while, one is left alone.
"""

from __future__ import annotations

import json
import resource
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from rampe_guard.collision import load_arm
from rampe_guard.errors import LogError
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.recording import McapLog, McapReading
from rampe_guard.recording.compare import changes, compare
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.contract import Contract
from tests.support.ears import Ears, open_session
from tests.support.processes import Process, command
from tests.support.recorded_work import machine, recorders, work, write_site
from tests.support.tap import Tap

pytestmark = pytest.mark.e2e

_NAMES = ("whole.mcap", "killed.mcap", "full.mcap")
_ROOM = 40_000
"""Bytes that a file may have while the disk is full: less than any beginning."""


@dataclass
class Recorded:
    """What the recorders left behind, and what they said."""

    folder: Path
    site: Path
    endpoint: str
    killed_ns: int
    whole: Process
    full: Process
    beats: list[dict[str, Any]]

    def log(self, name: str) -> McapLog:
        site = load_site(self.site)
        return McapLog(site, McapReading(self.folder / name), load_arm(site.arm).limits)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorded]:
    folder = tmp_path_factory.mktemp("recorded")
    site_path = write_site(folder, absolute=True)
    site = load_site(site_path)
    endpoint = processes.free_endpoint()
    with (
        processes.router(folder, endpoint),
        Ears(endpoint, site.keys.base) as ears,
        recorders(folder, site_path, endpoint, *_NAMES) as (whole, killed, full),
    ):
        killed_ns = 0

        def between() -> None:
            nonlocal killed_ns
            killed.popen.kill()
            killed_ns = time.time_ns()
            ears.wait("recorder", lambda b: b["status"] == "degraded", 5.0, full_s)
            resource.prlimit(full.pid, resource.RLIMIT_FSIZE, (2**40, 2**40))

        with machine(folder, site_path, endpoint, site, [whole, killed, full]) as made:
            full_s = time.monotonic()
            resource.prlimit(full.pid, resource.RLIMIT_FSIZE, (_ROOM, 2**40))
            work(*made, between)
        full.popen.terminate()
        assert whole.signal_and_wait(signal.SIGTERM) < 3.0
        full.popen.wait(3.0)
        beats = [h.body for h in ears.all() if h.topic == "recorder"]
        yield Recorded(folder, site_path, endpoint, killed_ns, whole, full, beats)


def test_what_is_left_alone_is_whole(recorded: Recorded) -> None:
    assert recorded.whole.popen.returncode == 0, recorded.whole.err
    reading = McapReading(recorded.folder / "whole.mcap")
    assert reading.warnings == ()
    assert f"{reading.counts.total()} messages" in recorded.whole.out
    assert "none lost" in recorded.whole.out
    base = "rampe/bench/excavator"
    for name in ("joystick", "actuators", "enabled", "guard/alert", "guard/prediction"):
        assert reading.counts[f"{base}/{name}"] > 0
    assert reading.counts["rampe/bench/*/joystick"] == 1
    said = [json.loads(m.payload)["alive"] for m in reading.messages() if _is(m, "stick/alive")]
    assert [alive for alive, _ in groupby(said)] == said
    assert said[said.index(True) :][:3] == [True, False, True]
    numbers = [json.loads(m.payload)["seq"] for m in reading.messages() if _is(m, "guard/alert")]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _is(message: Any, end: str) -> bool:
    return bool(message.channel.topic.endswith(end))


def test_replayed_alone_the_alerts_are_those_of_the_guard(
    recorded: Recorded, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(recorded.folder / "whole.mcap")
    lines = list(replay_offline(None, path, StopFlag(), repeats=True, compare=True))
    log = recorded.log("whole.mcap")
    live = changes(_told(log, (json.loads(p) for _, p in log.published("alert"))))
    zones = {z.zone: z for z in compare(live, changes(_told(log, map(json.loads, lines))))}
    for name in ("crate", "cart", "system"):  # slew-left is approached just so, and hardly so
        assert zones[name].same >= (4 if name == "system" else 2)  # two kinds of silence
        assert (zones[name].only_live, zones[name].only_replay) == ((), ()), name
    told = capsys.readouterr().err
    assert "changes of level, live and replayed" in told
    assert "Objects that move are not scored: cart." in told


def _told(log: McapLog, alerts: Any) -> list[tuple[float, str | None, str]]:
    """Time [s], zone and level; without what the guard said of silence before the recording."""
    told = [(a["published_unix_s"] - log.epoch_s, a["zone"], a["level"]) for a in alerts]
    begun_s = next(log.positions())[0] + 1.0
    return [(at_s, zone, level) for at_s, zone, level in told if zone or at_s > begun_s]


def test_a_killed_recorder_leaves_all_but_its_last_second(
    recorded: Recorded, capsys: pytest.CaptureFixture[str]
) -> None:
    reading = McapReading(recorded.folder / "killed.mcap")
    assert "was not finished" in reading.warnings[0]
    assert 0 <= recorded.killed_ns - reading.last_ns < 2.5e9  # one, where the cores are free
    whole = [m.payload for m in McapReading(recorded.folder / "whole.mcap").messages()]
    inputs = [m.payload for m in reading.messages() if _is(m, "/actuators")]
    assert inputs == [p for p in whole if p in set(inputs)]
    assert _first(None, reading.path) > reading.first_ns / 1e9  # it can be replayed
    assert "killed.mcap: was not finished" in capsys.readouterr().err


def test_a_full_disk_is_told_and_loses_nothing_if_it_passes(
    recorded: Recorded, contract: Contract
) -> None:
    for beat in recorded.beats:
        contract.check(beat)
    degraded = [b for b in recorded.beats if b["status"] == "degraded"]
    assert degraded
    assert all("nothing can be written" in b["reason"] for b in degraded)
    assert recorded.beats[-1]["status"] == "recording"
    assert "degraded: nothing can be written" in recorded.full.err
    assert "recording again" in recorded.full.err
    assert recorded.full.popen.returncode == 0, recorded.full.err
    files = [recorded.folder / "full.mcap", recorded.folder / "full-0002.mcap"]
    assert "none lost" in recorded.full.out
    got = [payload for path in files for payload in _held(path)]
    whole = McapReading(recorded.folder / "whole.mcap")
    wanted = [m.payload for m in whole.messages() if _is(m, "/actuators")]
    assert [p for p in got if p in set(wanted)] == wanted


def _held(path: Path) -> list[bytes]:
    """What is in a file, of which the full disk may have kept all but its beginning away."""
    try:
        return [message.payload for message in McapReading(path).messages()]
    except LogError as error:
        assert "holds no message" in str(error)  # noqa: PT017 - or the test fails
        return []


def test_of_nothing_that_was_recorded_the_exit_code_tells(tmp_path: Path) -> None:
    site_path = write_site(tmp_path, absolute=True)
    key, endpoint = load_site(site_path).keys.joystick, processes.free_endpoint()
    out = tmp_path / "never.mcap"
    args = ["-m", "rampe_guard", "record", str(site_path), str(out), "--for", "2"]
    with (
        processes.router(tmp_path, endpoint),
        open_session(endpoint) as session,
        Process(tmp_path, "record", [*args, "--connect", endpoint]) as recorder,
    ):
        resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (_ROOM, 2**40))
        deadline_s = time.monotonic() + 30.0
        while recorder.alive and time.monotonic() < deadline_s:
            session.put(key, b'{"axes": [0.0]}')
            time.sleep(0.02)
        assert recorder.popen.wait(5.0) == 2
        assert "nothing was recorded: 0 messages" in recorder.err
        assert "messages LOST" in recorder.err


def test_what_is_no_file_is_not_written_beside(tmp_path: Path) -> None:
    site_path = write_site(tmp_path, absolute=True)
    done = command("record", site_path, "/dev/null")
    assert (done.returncode, done.stdout) == (2, "")
    assert "/dev/null: is no file" in done.stderr


def test_a_site_with_a_wider_margin_is_warned_earlier(recorded: Recorded) -> None:
    scene = recorded.folder / "scenes" / "cart.yaml"
    text = scene.read_text("utf-8")
    wider = recorded.folder / "wider"
    (wider / "scenes").mkdir(parents=True)
    (wider / "sites").mkdir()
    (wider / "scenes" / "cart.yaml").write_text(text.replace("margin_m: 0.02", "margin_m: 0.06"))
    site = wider / "sites" / "bench.yaml"
    site.write_text(recorded.site.read_text("utf-8"))
    path = str(recorded.folder / "killed.mcap")
    narrow, wide = (_first(where, path) for where in (None, str(site)))
    assert wide < narrow


def _first(site: str | None, path: str) -> float:
    lines = replay_offline(site, path, StopFlag(), repeats=False)
    raised = [a for a in map(json.loads, lines) if a["zone"] == "crate"]
    return float(raised[0]["published_unix_s"])


def test_played_live_it_is_the_same_bytes_on_the_same_keys(recorded: Recorded) -> None:
    log = recorded.log("killed.mcap")
    path = recorded.folder / "killed.mcap"
    with Tap(recorded.endpoint, "rampe/bench") as tap:
        args = ("--live", "--speed", "3", "--connect", recorded.endpoint)
        done = command("replay", path, *args)
        assert done.returncode == 0, done.stderr
        put = [(key, payload) for _, key, payload in log.posts()]
        assert f"{len(put)} messages sent" in done.stderr
        time.sleep(0.2)
        heard = [(key, payload) for key, payload, _ in tap._heard]
    for end in ("/joystick", "/actuators", "/pose"):
        sent = [payload for key, payload in put if key.endswith(end)]
        came = [payload for key, payload in heard if key.endswith(end)]
        left = iter(sent)
        assert all(payload in left for payload in came), end  # these, in this order
        assert len(came) > 0.9 * len(sent) > 0, end  # a busy machine may drop a few
