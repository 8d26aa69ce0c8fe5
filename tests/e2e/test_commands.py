"""The commands as a user runs them: output, exit codes, no traceback for what he can mend."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

import rampe_guard
from rampe_guard.settings import load_site
from tests.support.processes import BENCH, ROOT, Process, called, command
from tests.support.station import AT_CRATE, REST, Station

pytestmark = pytest.mark.e2e


def test_version() -> None:
    done = command("--version")
    assert (done.returncode, done.stdout) == (0, f"rampe-guard {rampe_guard.__version__}\n")


def test_schema_of_one_message_and_of_none() -> None:
    done = called("schema", "rampe.alert.v1")
    assert done.returncode == 0
    schema = json.loads(done.stdout)
    assert {"level", "zone", "link", "text"} <= set(schema["required"])
    wrong = called("schema", "rampe.alarm.v1")
    assert wrong.returncode == 2
    assert "rampe.alert.v1" in wrong.stderr  # says what there is
    assert "Traceback" not in wrong.stderr


@pytest.mark.parametrize("name", ["bench", "demo"])
def test_check_passes_the_shipped_sites(name: str) -> None:
    done = command("check", ROOT / "config" / "sites" / f"{name}.yaml")
    assert done.returncode == 0, done.stderr
    for zone in load_site(ROOT / "config" / "sites" / f"{name}.yaml").scene.objects:
        assert zone.name in done.stdout


@pytest.mark.parametrize(
    ("name", "run"), [("check", called), ("sweep", called), ("run", command), ("watch", command)]
)
def test_a_site_that_is_not_there_ends_with_2(
    name: str, run: Callable[..., CompletedProcess[str]]
) -> None:
    done = run(name, "no-such-site.yaml")
    assert done.returncode == 2
    assert "no-such-site.yaml" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_error_of_one_line_stays_one(tmp_path: Path) -> None:
    done = called("check", tmp_path / "no\npe\x1b[2J.yaml")
    assert done.returncode == 2
    assert done.stderr.startswith(
        f"rampe-guard: {tmp_path}/no\\x0ape\\x1b[2J.yaml: there is no such"
    )
    assert done.stderr.count("\n") == 1
    text = BENCH.read_text("utf-8").replace("max_velocity: 0.95", "max_velocity: fast\n      x: 1")
    broken = tmp_path / "two\nlines.yaml"
    broken.write_text(text, "utf-8")
    done = called("check", broken)  # two problems are two lines
    lines = done.stderr.splitlines()
    assert len(lines) == 2
    assert all("two\\x0alines.yaml:" in line for line in lines)


def test_a_broken_site_is_told_by_file_line_and_key(tmp_path: Path) -> None:
    text = BENCH.read_text("utf-8").replace("max_velocity: 0.95", "max_velocity: fast")
    broken = tmp_path / "broken.yaml"
    broken.write_text(text, "utf-8")
    line = 1 + text[: text.index("max_velocity: fast")].count("\n")
    done = called("check", broken)
    assert done.returncode == 2
    assert f"broken.yaml:{line}" in done.stderr
    assert "max_velocity" in done.stderr
    assert "Traceback" not in done.stderr


def test_sweep_answers_every_line() -> None:
    lines = [
        json.dumps({"start": AT_CRATE, "displacement": [-0.3, 0, 0, 0]}),
        "this is no JSON",
        json.dumps({"start": REST, "displacement": [0.1, 0, 0, 0]}),
        json.dumps({"start": [1.0], "displacement": [0.1, 0, 0, 0]}),
        '{"start": [NaN, 0, 0, 0], "displacement": [0, 0, 0, 0]}',
        json.dumps({"start": REST, "displacement": [0.4, 0, 0, 0]}),
    ]
    done = command("sweep", BENCH, stdin="\n".join(lines) + "\n")
    assert done.returncode == 0, done.stderr
    replies = [json.loads(line) for line in done.stdout.splitlines()]
    assert [r["certificate"] for r in replies] == [
        *("contact", "unknown", "free", "unknown", "unknown", "contact")
    ]
    assert replies[0]["zone"] == "crate"
    assert 0.0 < replies[0]["contact_fraction"] < 1.0
    assert replies[2]["clearance_m"] > 0.0
    assert replies[5]["zone"] == "slew-left"
    # the limit is at 1.3 rad: a closed form to compare with
    assert replies[5]["contact_fraction"] == pytest.approx((1.3 - REST[0]) / 0.4, abs=1e-6)
    for number in (2, 4, 5):
        assert f"line {number}" in replies[number - 1]["error"]


def test_watch_on_a_pipe_prints_events_as_lines(live: Station, tmp_path: Path) -> None:
    live.calm()
    args = ["-m", "rampe_guard", "watch", str(BENCH), "--connect", live.endpoint]
    with Process(tmp_path, "watch", args) as watch:
        live.press_on_crate()
        watch.wait_for("crate: ")  # it may come late: then the state tells it
        live.calm()
        watch.wait_for("crate: clear", 5.0)
        assert watch.signal_and_wait(signal.SIGTERM) <= 2.0
        assert watch.popen.returncode == 0, watch.err
        assert "imminent" in watch.out
        assert "\x1b" not in watch.out  # no colours and cursors on a pipe


def test_ack_of_nothing_ends_with_2(live: Station) -> None:
    done = command("ack", BENCH, "no-such-alert", "--who", "me", "--connect", live.endpoint)
    assert done.returncode == 2
    assert "no-such-alert" in done.stderr
    assert "Traceback" not in done.stderr


def test_ack_without_a_router_ends_with_2() -> None:
    done = called("ack", BENCH, "x", "--who", "me", "--connect", "tcp/127.0.0.1:1")
    assert done.returncode == 2
    assert "tcp/127.0.0.1:1" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "args",
    [
        ("router", "foo"),
        ("router", "tcp/127.0.0.1:99999"),
        ("dashboard", BENCH, "--port", "0", "--connect", "foo"),
    ],
)
def test_an_endpoint_that_cannot_be_ends_with_2(args: tuple[str, ...]) -> None:
    done = command(*args)
    assert done.returncode == 2
    assert args[-1] in done.stderr
    assert done.stderr.count("\n") == 1  # no traceback, and no paths of Zenoh's own
    assert "/zenoh" not in done.stderr
    assert not done.stdout
