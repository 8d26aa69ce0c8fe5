"""How many logs an hour: ``python -m tests.benchmarks.fleet [--logs LOG…]``.

Evaluates a fleet of two operators (the same logs twice) with 1 and with 2 processes, sees that
the reports are the same, and prints logs and hours of work per hour, and what a fleet would cost.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from rampe_guard.cli import main as rampe_guard
from rampe_guard.evaluate.stages import machine_of
from rampe_guard.recording import open_log
from tests.support.bench_log import write_log
from tests.support.processes import BENCH

JOBS = (1, 2)


def work_s(site: str, logs: list[str]) -> float:
    """How long the logs are [s]."""
    machine = machine_of(site)
    opened = [open_log(machine.site, log, machine.arm.limits) for log in logs]
    return sum(float(log.time_s[-1] - log.time_s[0]) for log in opened)


def main() -> int:
    """Evaluate with each number of processes and print; 1 if the reports differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--site", default=str(BENCH))
    parser.add_argument("--logs", nargs="+", help="of one operator; made up without")
    args = parser.parse_args()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ[name] = "1"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        logs = args.logs or [str(write_log(folder / f"{k}.csv", 8, seed=k)) for k in range(3)]
        logs = [str(Path(log).absolute()) for log in logs]
        listed = ", ".join(f"'{log}'" for log in logs)
        fleet = folder / "fleet.yaml"
        site = Path(args.site).absolute()
        fleet.write_text(
            "sequences:\n"
            + "".join(f"  - {{name: {n}, site: '{site}', logs: [{listed}]}}\n" for n in "ab"),
            "utf-8",
        )
        hours = 2 * work_s(str(site), logs) / 3600.0
        table = Table("processes", "s", "logs an hour", "hours of work an hour", box=None)
        spent: list[float] = []
        reports = []
        for jobs in JOBS:
            out = folder / str(jobs)
            began_s = time.perf_counter()
            given = ["evaluate", "--fleet", str(fleet), "--jobs", str(jobs), "--out", str(out)]
            if rampe_guard(given):
                return 2
            spent.append(time.perf_counter() - began_s)
            rate = 3600.0 / spent[-1]
            table.add_row(
                str(jobs), f"{spent[-1]:.1f}", f"{2 * len(logs) * rate:.0f}", f"{hours * rate:.0f}"
            )
            reports.append([(out / n / "report.json").read_bytes() for n in "ab"])
    console = Console()
    console.print(table)
    console.print(f"2 processes are {spent[0] / spent[1]:.2f} times as fast as 1")
    console.print(f"the reports are the same: {reports[0] == reports[1]}")
    return int(reports[0] != reports[1])


if __name__ == "__main__":
    sys.exit(main())
