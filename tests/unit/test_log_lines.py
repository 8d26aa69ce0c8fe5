"""The log: one event is one line, whatever stands in it, and nobody waits for its reader."""

from __future__ import annotations

import io
import json
import logging
import os
import time
from typing import Any

import pytest

from rampe_guard.runtime.log_lines import LONGEST, Behind, JsonLines, TextLines, complaint, one_line
from rampe_guard.runtime.say import Sayer
from tests.support.processes import until

FORGED = "anna\n2026-01-01 00:00:00,000 INFO rampe_guard: status ok\x1b[2K\r\u202egnihton\x85"


class Heard(logging.Handler):
    """Keeps formatted lines."""

    def __init__(self, formatter: logging.Formatter) -> None:
        super().__init__()
        self.setFormatter(formatter)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(self.format(record))


def sayer(formatter: logging.Formatter, name: str) -> tuple[Sayer, Heard]:
    heard = Heard(formatter)
    log = logging.getLogger(name)
    log.handlers, log.propagate = [heard], False
    log.setLevel(logging.INFO)
    return Sayer(name), heard


@pytest.mark.parametrize("formatter", [TextLines(), JsonLines()])
def test_what_comes_from_the_network_cannot_forge_a_line(formatter: logging.Formatter) -> None:
    say, heard = sayer(formatter, "test.forged")
    say.info(f"acknowledged by {FORGED}", who=FORGED)
    (line,) = heard.lines
    assert len(line.splitlines()) == 1
    assert line.isprintable()
    assert "status ok" in line
    assert "\\x0a" in line


def test_text_of_any_language_stays_readable() -> None:
    assert one_line("Löffel → Wand, 挖掘机, ж") == "Löffel → Wand, 挖掘机, ж"
    assert one_line("\ud800 and \u2028") == "\\ud800 and \\u2028"
    assert len(one_line("x" * 10 * LONGEST)) < LONGEST + 30


def test_json_says_what_fields_it_was_given() -> None:
    say, heard = sayer(JsonLines(), "test.json")
    say.info("imminent: bucket", zone="wall", time_to_collision_s=0.4, link=None)
    say.warn("joystick:bad_json", "refused", reason="bad_json")
    told: list[dict[str, Any]] = [json.loads(line) for line in heard.lines]
    assert told[0]["level"] == "info"
    assert told[0]["logger"] == "test.json"
    assert told[0]["text"] == "imminent: bucket"
    assert told[0]["fields"] == {"zone": "wall", "time_to_collision_s": 0.4, "link": None}
    assert told[1]["fields"] == {"kind": "joystick:bad_json", "reason": "bad_json"}
    assert told[1]["time"].endswith("Z")
    assert "fields" not in json.loads(complaint(["no router"], "json"))
    assert complaint(["no router"]) == "rampe-guard: no router"
    assert complaint(["no\npe", "\x1b[2J"]) == "rampe-guard: no\\x0ape\n\\x1b[2J"


def test_a_traceback_stays_within_its_json_line() -> None:
    heard = Heard(JsonLines())
    log = logging.getLogger("test.traceback")
    log.handlers, log.propagate = [heard], False
    try:
        int("seven")
    except ValueError:
        log.exception("it failed")
    (line,) = heard.lines
    assert "ValueError: invalid literal" in json.loads(line)["exception"]


def test_each_kind_is_said_once_a_second_with_the_count_held_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = 100.0
    monkeypatch.setattr("rampe_guard.runtime.say.time.monotonic", lambda: now_s)
    say, heard = sayer(JsonLines(), "test.rate")
    for _ in range(5):
        say.warn("a", "this")
    say.warn("b", "that")
    now_s = 101.0
    say.warn("a", "this")
    told = [json.loads(line) for line in heard.lines]
    assert [t["text"] for t in told] == ["this", "that", "this (and 4 more like it)"]
    assert told[2]["fields"] == {"kind": "a", "held_back": 4}


def test_invented_kinds_neither_fill_the_memory_nor_the_log(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = 100.0
    monkeypatch.setattr("rampe_guard.runtime.say.time.monotonic", lambda: now_s)
    say, heard = sayer(TextLines(), "test.kinds")
    for number in range(10_000):
        say.warn(f"kind {number}", "spam")
    assert len(heard.lines) <= 257
    assert len(say._kinds) <= 257
    now_s = 102.0
    say.warn("another", "seen")  # what is quiet makes room
    assert "seen" in heard.lines[-1]


def test_a_reader_that_is_stuck_costs_lines_and_no_time() -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w", buffering=1) as out:
        handler = Behind(out)
        handler.setFormatter(TextLines())
        log = logging.getLogger("test.stuck")
        log.handlers, log.propagate = [handler], False
        began_s = time.monotonic()
        for number in range(5000):  # the pipe holds 64 KiB
            log.warning("line %05d %s", number, "x" * 100)
        assert time.monotonic() - began_s < 5.0  # a pipe that blocks would never return
        got = io.BytesIO()

        def missing() -> bool:
            got.write(os.read(reading, 1 << 16))
            return b"lines are missing here" in got.getvalue()

        until(missing, 10.0, "said how many lines are missing")
        handler.close()
    os.close(reading)
    assert got.getvalue().startswith(b"2")
    assert b"line 00000" in got.getvalue()


def test_a_line_that_cannot_be_made_ends_no_other() -> None:
    out = io.StringIO()
    handler = Behind(out)
    handler.setFormatter(TextLines())
    log = logging.getLogger("test.unmade")
    log.handlers, log.propagate = [handler], False
    log.warning("too few: %s %s", "one")  # noqa: PLE1206 - what a library may do
    log.warning("after it")
    until(lambda: "lines are missing here" in out.getvalue(), 5.0, "said that one is missing")
    handler.close()
    assert "after it" in out.getvalue()


def test_what_was_said_last_is_written_before_the_end() -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as out:
        handler = Behind(out)
        handler.setFormatter(TextLines())
        for number in range(100):
            handler.handle(logging.makeLogRecord({"msg": f"line {number}", "levelname": "INFO"}))
        handler.close()
    with os.fdopen(reading) as got:
        assert len(got.readlines()) == 100
