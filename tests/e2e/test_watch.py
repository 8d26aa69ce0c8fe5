"""``rampe-guard watch`` of many machines: on a terminal, on a pipe and for scripts."""

from __future__ import annotations

import contextlib
import fcntl
import io
import json
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest
from rich.console import Console

from rampe_guard.client.items import Protection, ProtectionLost
from rampe_guard.errors import SettingsError
from rampe_guard.programs.control_room import watch_many
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import ZenohSettings
from rampe_guard.view.links import Link
from tests.support import processes
from tests.support.hearing import EVERYONE, FLEET, Hall, hall, speaker
from tests.support.messages import SILENT_JOYSTICK
from tests.support.processes import ROOT, Process, environment, until

pytestmark = pytest.mark.e2e

SCHEMA = ROOT / "config/contract/rampe.watch_line.v1.schema.json"
BELL = b"\a"


class Terminal:
    """``rampe-guard ARGS`` on a terminal of 80 by 24; all that it wrote there."""

    def __init__(self, folder: Path, args: list[str]) -> None:
        own, its = pty.openpty()
        fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        env = {**environment(folder), "TERM": "xterm-256color"}
        del env["COLUMNS"]
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "rampe_guard", *args],
            cwd=ROOT,
            env=env,
            stdin=its,
            stdout=its,
            stderr=its,
        )
        os.close(its)
        self._own = own
        self._lock = threading.Lock()
        self._written = b""
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # the other end is closed
            while more := os.read(self._own, 65536):
                with self._lock:
                    self._written += more

    def take(self) -> bytes:
        """What was written since the last look."""
        with self._lock:
            written, self._written = self._written, b""
        return written

    def wait_for(self, text: str, within_s: float = 10.0) -> None:
        until(lambda: text.encode() in self.take(), within_s, f"{text!r} on the screen")

    def close(self) -> int:
        self.popen.terminate()
        code = self.popen.wait(10.0)
        self._thread.join()
        os.close(self._own)
        return code


@dataclass
class Room:
    """A control room: guards that speak, and three ways to watch them."""

    hall: Hall
    lines: Process
    scripts: Process
    screen: Terminal

    def told(self, event: str) -> list[dict[str, Any]]:
        """JSON lines of a kind so far."""
        whole = self.scripts.out.rpartition("\n")[0]
        found = (json.loads(line) for line in whole.splitlines())
        return [line for line in found if line["event"] == event]

    def wait(
        self, event: str, wanted: Callable[[dict[str, Any]], bool] = lambda _: True
    ) -> dict[str, Any]:
        """The newest JSON line of a kind that is wanted."""
        return until(
            lambda: next((t for t in reversed(self.told(event)) if wanted(t)), None),
            10.0,
            lambda: f"the wanted {event} in\n{self.scripts.out[-2000:]}",
        )


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Room]:
    folder = tmp_path_factory.mktemp("room")
    watch = ["watch", "--base", EVERYONE, "--connect"]
    with contextlib.ExitStack() as stack:
        place = stack.enter_context(hall(folder))
        args = ["-m", "rampe_guard", *watch, place.endpoint]
        lines = stack.enter_context(Process(folder, "lines", args))
        scripts = stack.enter_context(Process(folder, "scripts", [*args, "--json"]))
        screen = Terminal(folder, [*watch, place.endpoint, "--bell"])
        made = Room(place, lines, scripts, screen)
        try:
            until(lambda: len(made.told("protection_back")) == len(FLEET), 30.0, "all machines")
            lines.wait_for("excavator-3: monitoring", 30.0)
            screen.wait_for("3 machines", 30.0)
            yield made
        finally:
            code = screen.close()
        assert code == 0
        for process in (lines, scripts):
            assert process.signal_and_wait(signal.SIGTERM) <= 2.0
            assert process.popen.returncode == 0
            assert not process.err
        validator = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text("utf-8")))
        for line in scripts.out.splitlines():
            validator.validate(json.loads(line))
        assert "\x1b" not in lines.out


def test_an_alert_is_shown_rung_for_and_told_until_someone_has_seen_it(room: Room) -> None:
    room.screen.take()
    alert = {"alert_id": "a.1", "level": "imminent", "text": "bucket → wall in 0.4 s"}
    room.hall.say(FLEET[1], alert=alert)
    room.lines.wait_for("imminent  excavator-2: bucket → wall in 0.4 s", 10.0)
    assert room.wait("alert")["machine"] == "excavator-2"
    room.screen.wait_for("IMMINENT")
    until(lambda: room.screen.take().count(BELL) >= 1, 5.0, "the bell")
    room.hall.say(FLEET[1], alert={**alert, "state": "acked", "acked_by": "ann"})
    room.lines.wait_for("(seen by ann)", 10.0)
    room.screen.wait_for("seen by ann")
    room.screen.take()
    time.sleep(0.6)
    assert BELL not in room.screen.take()
    room.hall.say(FLEET[1], alert={**alert, "level": "clear", "state": "normal"})
    room.wait("alert", lambda line: line["level"] == "clear")


def test_a_shelved_alert_is_shown_and_silent(room: Room) -> None:
    room.screen.take()
    until_s = time.time() + 20.0
    shelved = {"inhibit": "shelved", "shelved_by": "ann", "shelved_until_unix_s": until_s}
    room.hall.say(FLEET[0], alert={"alert_id": "s.1", **shelved})
    room.screen.wait_for("shelved by ann")
    time.sleep(0.6)
    assert BELL not in room.screen.take()
    room.hall.say(FLEET[0], alert={"alert_id": "s.1", "level": "clear", "state": "normal"})
    room.wait("alert", lambda line: line["alert_id"] == "s.1" and line["level"] == "clear")


def test_not_monitoring_is_one_line_and_a_banner(room: Room) -> None:
    room.screen.take()
    reasons = [{"code": SILENT_JOYSTICK.code, "text": SILENT_JOYSTICK.text}]
    room.hall.say(FLEET[2], beat={"status": "not_monitoring", "reasons": reasons})
    said = {"alert_id": "n.1", "zone": None, "link": None, "source": "system"}
    room.hall.say(FLEET[2], alert={**said, "text": "NOT MONITORING: joystick silent"})
    room.screen.wait_for("NOT PROTECTED: excavator-3")
    until(lambda: BELL in room.screen.take(), 5.0, "the bell")
    assert room.wait("protection_lost")["protection"] == "not_monitoring"
    room.hall.say(FLEET[2], beat={"status": "ok", "reasons": []})
    room.hall.say(FLEET[2], alert={**said, "level": "clear", "state": "normal", "text": "again"})
    room.wait("alert", lambda line: line["alert_id"] == "n.1" and line["state"] == "normal")
    assert room.lines.out.count("NOT MONITORING") == 1


def test_lost_messages_are_told(room: Room) -> None:
    room.hall.say(FLEET[0], alert={"alert_id": "l.1"})
    room.wait("alert", lambda line: line["alert_id"] == "l.1")
    room.hall.say(FLEET[0], lose=3)
    room.wait("messages_lost", lambda line: line["key"] == f"{FLEET[0]}/alert")
    room.lines.wait_for("messages of alert lost", 10.0)
    room.hall.say(FLEET[0], alert={"alert_id": "l.1", "level": "clear", "state": "normal"})


def test_guards_that_die_are_unavailable_within_seconds_and_come_back(room: Room) -> None:
    before = len(room.told("protection_lost"))
    room.screen.take()
    killed_s = time.time()
    room.hall.speaker.popen.kill()
    room.hall.speaker.popen.wait()
    room.screen.wait_for("UNAVAILABLE")
    until(lambda: len(room.told("protection_lost")) == before + len(FLEET), 10.0, "all lost")
    for line in room.told("protection_lost")[before:]:
        assert line["protection"] == "unavailable"
        assert line["told_unix_s"] - killed_s < 3.0  # 1.5 s, and room for a busy machine
    with speaker(room.hall.folder, room.hall.endpoint) as voice:
        for base in FLEET:  # another run of a guard says so
            voice.tell(json.dumps({"base": base, "beat": {"boot_id": "boot-2"}}))
        until(lambda: len(room.told("guard_restarted")) == len(FLEET), 10.0, "all back")
        until(lambda: b"3 monitoring" in room.screen.take(), 10.0, "all on the screen")


@pytest.mark.parametrize(
    ("bases", "bell", "reason"),
    [((), False, "nothing to watch"), (("rampe//x",), False, "rampe//x"), (("a",), True, "--bell")],
)
def test_what_cannot_be_watched_is_refused(
    bases: tuple[str, ...], *, bell: bool, reason: str
) -> None:
    console = Console(file=io.StringIO())
    with pytest.raises(SettingsError, match=re.escape(reason)):
        watch_many((), bases, Network(), console, StopFlag(), bell=bell, as_json=False)


def test_a_network_that_is_not_there_reads_as_no_protection_and_is_told_once() -> None:
    endpoint = processes.free_endpoint()
    with Link(ZenohSettings(None, "client", (endpoint,)), FLEET[:1]) as link:
        until(lambda: link.problem, 10.0, "what is wrong with the network")
        assert endpoint in str(link.problem)
        (machine,) = link.machines()
        assert machine.protection is Protection.UNAVAILABLE
        time.sleep(1.6)  # it tries again
        assert [type(item) for item in link.take()] == [ProtectionLost]
