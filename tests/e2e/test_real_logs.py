"""A person's recorded work: live and offline tell the same, and bad logs are told apart."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.ears import Ears
from tests.support.processes import BENCH, ROOT, command, until

LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"
SECONDS = 12.0
"""Of the log: in them the arm comes to the ceiling, the crate and the slew limit."""

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.private_data,
    pytest.mark.skipif(not LOGS.is_dir(), reason="no private logs at ../shared/data"),
]


@pytest.fixture(scope="module")
def start_of_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first seconds of a run, as a log of its own."""
    path = tmp_path_factory.mktemp("log") / "start.csv"
    lines = (LOGS / "operator3_run1.csv").read_text("utf-8").splitlines(keepends=True)
    body = itertools.takewhile(lambda line: float(line.split(",")[0]) < SECONDS, lines[1:])
    path.write_text(lines[0] + "".join(body), "utf-8")
    return path


@pytest.fixture(scope="module")
def offline(start_of_run: Path) -> str:
    """What offline replay prints of it."""
    done = command("replay", BENCH, start_of_run, "--repeats")
    assert done.returncode == 0, done.stderr
    return done.stdout


def changes(alerts: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Levels of each zone, one entry for each change."""
    found: dict[str, list[str]] = {}
    for alert in alerts:
        if alert["zone"] is not None:
            levels = found.setdefault(alert["zone"], ["clear"])
            if levels[-1] != alert["level"]:
                levels.append(alert["level"])
    return found


def test_live_tells_what_offline_replay_tells(
    start_of_run: Path, offline: str, tmp_path: Path
) -> None:
    expected = changes([json.loads(line) for line in offline.splitlines()])
    assert {"crate", "ceiling", "slew-left"} <= set(expected)

    endpoint = processes.free_endpoint()
    with (
        processes.router(tmp_path, endpoint),
        Ears(endpoint, load_site(BENCH).keys.base) as ears,
        processes.guard(tmp_path, BENCH, endpoint),
    ):
        # in real time: how long an alert stays is reckoned in seconds of the guard's own clock
        live = command("replay", BENCH, start_of_run, "--live", "--connect", endpoint)
        assert live.returncode == 0, live.stderr

        def heard() -> dict[str, list[str]]:
            return changes([h.body for h in ears.since(0.0, "alert")])

        until(lambda: heard() == expected, 3.0, lambda: f"{expected}; heard {heard()}")


def test_offline_replay_is_the_same_to_the_byte(start_of_run: Path, offline: str) -> None:
    again = command("replay", BENCH, start_of_run, "--repeats")
    assert offline
    assert again.stdout == offline


def test_swapped_columns_are_refused_by_name() -> None:
    done = command("replay", BENCH, LOGS / "trap_columns_swapped.csv")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "column 'Boom Cmd'" in done.stderr
    assert "swapped" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_cut_last_line_is_one_warning(tmp_path: Path) -> None:
    lines = (LOGS / "operator3_run1.csv").read_bytes().splitlines(keepends=True)
    path = tmp_path / "tail.csv"
    path.write_bytes(lines[0] + b"".join(lines[-100:]))
    done = command("replay", BENCH, path)
    assert done.returncode == 0, done.stderr
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning:")]
    assert len(warnings) == 1
    assert f"tail.csv:{101}" in warnings[0]
