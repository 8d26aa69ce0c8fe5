"""``rampe-guard notify`` with real commands, a real HTTP server that fails first, and a player."""

from __future__ import annotations

import json
import signal
import threading
import wave
from collections.abc import Iterator
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.support.hearing import EVERYONE, FLEET, Hall, hall
from tests.support.processes import Process, command, until

pytestmark = pytest.mark.e2e

SCRIPT = 'read -r json; printf "%s\\n" "$2|$3|$RAMPE_STATE|$RAMPE_OVER|$json" >> "$1"\n'
PLAYER = 'printf "%s\\n" "$2" >> "$1"; exec sleep 60\n'
FAILURES = 2


class Phone:
    """A server that answers 503 twice and then takes what comes."""

    def __init__(self) -> None:
        self.refused = 0
        self.got: list[dict[str, Any]] = []
        phone = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if phone.refused < FAILURES:
                    phone.refused += 1
                    self.send_response(503)
                else:
                    assert self.headers["Content-Type"] == "application/json"
                    phone.got.append(json.loads(body))
                    self.send_response(204)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/alerts"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()


@dataclass
class Room:
    """Guards that speak, `notify`, and whom it tells."""

    hall: Hall
    notify: Process
    phone: Phone
    log: Path
    played: Path

    def lines(self) -> list[str]:
        """What the command was told, a line each."""
        return self.log.read_text().splitlines() if self.log.exists() else []

    def wait_line(self, start: str) -> str:
        def found() -> str | None:
            return next((line for line in self.lines() if line.startswith(start)), None)

        return until(found, 10.0, lambda: f"{start!r} in {self.lines()}; {self.notify.err}")


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Room]:
    folder = tmp_path_factory.mktemp("notify")
    phone, log, played = Phone(), folder / "log", folder / "played"
    (folder / "tell.sh").write_text(SCRIPT)
    (folder / "play.sh").write_text(PLAYER)
    with pytest.MonkeyPatch.context() as patch, hall(folder) as made:
        patch.setenv("NO_PROXY", "127.0.0.1")
        args = ["-m", "rampe_guard", "notify", "--connect", made.endpoint, "--base", EVERYONE]
        args += ["--command", f"sh {folder}/tell.sh {log} {{level}} {{text}}", "--timeout", "0.5"]
        args += ["--command", "sleep 60", "--post", phone.url]
        args += ["--sound", f"sh {folder}/play.sh {played}"]
        with Process(folder, "notify", args) as notify:
            notify.wait_for("excavator-3: clear: monitoring")
            yield Room(made, notify, phone, log, played)
    phone.server.shutdown()
    phone.server.server_close()


def test_an_alert_is_told_to_all_though_one_is_dead_and_one_fails_first(room: Room) -> None:
    room.hall.say(alert={"alert_id": "a.1", "text": "bucket → wall; $(reboot) in 1.4 s"})
    line = room.wait_line("warning|")
    level, text, state, over, body = line.split("|", 4)
    assert (level, text) == ("warning", "bucket → wall; $(reboot) in 1.4 s")
    assert (state, over) == ("unacked", "false")
    assert json.loads(body)["alert_id"] == "a.1"
    until(lambda: room.phone.got, 10.0, lambda: f"a post; {room.notify.err}")
    assert room.phone.refused == FAILURES
    assert room.phone.got[0]["event"] == "alert"
    assert room.phone.got[0]["base"] == FLEET[0]
    assert "answered 503; not told yet: bucket" in room.notify.err
    room.notify.wait_for("sleep: not done within 0.5 s", 10.0)
    until(lambda: room.played.exists() and room.played.read_text(), 10.0, "a sound")
    played = room.played.read_text().splitlines()[0]
    with wave.open(played) as sound:
        assert sound.getnframes() > 0
    assert played.endswith("warning.wav")

    room.hall.say(alert={"alert_id": "a.1", "level": "clear", "state": "normal", "text": "free"})
    assert room.wait_line("clear|free|normal|true|")
    until(lambda: len(room.phone.got) == 2, 10.0, lambda: f"an end; {room.phone.got}")
    assert room.phone.got[1]["over"] is True


def test_what_is_below_the_level_is_not_told_and_a_graver_sound_interrupts(room: Room) -> None:
    before = room.lines()
    room.hall.say(alert={"alert_id": "b.1", "level": "caution", "text": "caution"})
    room.hall.say(alert={"alert_id": "b.1", "level": "imminent", "text": "imminent"})
    room.wait_line("imminent|imminent|")
    assert not [line for line in room.lines() if line.startswith("caution")]
    # the player of the test plays for a minute: only an interruption lets it play another
    until(lambda: "imminent.wav" in room.played.read_text(), 5.0, "the grave sound")
    room.hall.say(alert={"alert_id": "b.1", "level": "caution", "text": "better"})
    room.wait_line("caution|better|unacked|true|")  # the end, for whom warning is the least
    room.hall.say(alert={"alert_id": "b.1", "level": "clear", "state": "normal"})
    room.hall.say(alert={"alert_id": "b.2", "level": "warning", "text": "again"})
    room.wait_line("warning|again|")
    assert len(room.lines()) == len(before) + 3
    room.hall.say(alert={"alert_id": "b.2", "level": "clear", "state": "normal", "text": "end"})
    room.wait_line("clear|end|")


def test_lost_protection_is_told_and_nothing_is_called_clear_for_it(room: Room) -> None:
    room.hall.say(alert={"alert_id": "c.1", "zone": "crate", "text": "crate"})
    room.wait_line("warning|crate|")
    room.hall.speaker.signal_and_wait(signal.SIGKILL)
    lost: list[str] = []

    def all_told() -> bool:
        lost[:] = [line for line in room.lines() if '"event": "protection_lost"' in line]
        return len(lost) == len(FLEET)

    until(all_told, 10.0, lambda: f"losses in {room.lines()}")
    assert all(line.startswith("warning|PROTECTION UNAVAILABLE: ") for line in lost)
    until(lambda: "unprotected.wav" in room.played.read_text(), 5.0, "its sound")
    crate = [line for line in room.lines() if '"zone": "crate"' in line]
    assert len(crate) == 1


def test_it_ends_soon_though_a_target_hangs(room: Room) -> None:
    """The last test of the module."""
    assert room.notify.signal_and_wait(signal.SIGTERM) < 2.0
    assert room.notify.popen.returncode == 0
    assert "Traceback" not in room.notify.err


def test_what_cannot_be_is_said_at_once() -> None:
    done = command("notify", "--base", "a/b", "--command", "echo {colour}")
    assert done.returncode == 2
    assert "no field {colour}" in done.stderr
    assert "Traceback" not in done.stderr
