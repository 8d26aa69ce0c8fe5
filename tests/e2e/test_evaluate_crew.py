"""Whoever does the work of `evaluate`, the reports are the same: processes, or a Dask cluster."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rampe_guard.cli import main
from tests.support.bench_log import write_log
from tests.support.depth import NIGHTLY, depth
from tests.support.processes import BENCH

pytestmark = pytest.mark.e2e
FILES = ("report.json", "report.html", "prediction.json")


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """A Dask scheduler with one worker, on free ports of loopback: its address."""
    started = []
    try:
        log = (folder / "scheduler.log").open("wb")
        own = ("--no-dashboard", "--host", "127.0.0.1")
        dask = (sys.executable, "-m", "distributed.cli.dask_scheduler")
        address_file = folder / "scheduler.json"
        started.append(
            subprocess.Popen(
                [*dask, *own, "--port", "0", "--scheduler-file", str(address_file)],
                stderr=log,
                cwd=folder,
            )
        )
        started.append(
            subprocess.Popen(
                [
                    *(sys.executable, "-m", "distributed.cli.dask_worker", "--no-nanny", *own),
                    *("--nthreads", "1", "--scheduler-file", str(address_file)),
                ],
                stderr=log,
                cwd=folder,
            )
        )
        log.close()
        yield _address(folder / "scheduler.log", started[0])
    finally:
        for process in reversed(started):  # a worker without its scheduler would look for it
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:  # its manners are not what is tested here
                process.kill()
                process.wait()


def _address(log: Path, scheduler: subprocess.Popen[bytes]) -> str:
    """What the scheduler says that it listens on."""
    for _ in range(600):
        told = re.search(r"Scheduler at:\s+(tcp://127\.0\.0\.1:\d+)", log.read_text("utf-8"))
        if told is not None:
            return told[1]
        try:
            scheduler.wait(0.05)
        except subprocess.TimeoutExpired:
            continue
        break
    raise AssertionError(log.read_text("utf-8"))


def test_whoever_does_the_work_the_reports_are_the_same(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    logs = [write_log(tmp_path / f"day{k}.csv", 1, seed=k) for k in range(1, depth(1, 2) + 1)]
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(
        f"sequences:\n  - {{name: {BENCH.stem}, site: {BENCH}, logs: ['day*.csv']}}\n", "utf-8"
    )

    def evaluated(name: str, *args: str | Path) -> dict[str, bytes]:
        out = tmp_path / name
        assert main(["evaluate", *map(str, args), "--out", str(out)]) == 0
        assert "times as fast" in capfd.readouterr().err
        return {file: path.read_bytes() for file in FILES for path in out.rglob(file)}

    with cluster(tmp_path) as address:
        there = evaluated("there", "--fleet", fleet, "--scheduler", address)
    assert set(there) == set(FILES)
    assert there == evaluated("processes", BENCH, *logs, "--jobs", "2")
    if NIGHTLY:
        assert there == evaluated("here", BENCH, *logs, "--jobs", "1")
    summary = json.loads((tmp_path / "there" / "fleet.json").read_text("utf-8"))
    assert summary[BENCH.stem]["operating_point"]["crossings"] > 0
