"""How early, how often in vain, on a real operator: ``python -m tests.benchmarks.foresight``.

Runs `evaluate` on the recordings beside the checkout (``../shared/data/excavator_logs``), each
run judged with only the runs before it known, against walls at the 10 % and 90 % quantiles of
all positions, and prints its figures against what they have to reach.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from rampe_guard.cli import main as rampe_guard
from tests.support.processes import ROOT
from tests.support.wall_site import write_wall_site

LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"
RUNS = "operator3_run*.csv"

Point = dict[str, Any]


def best(curve: Sequence[Point], lead: str, most_false: float) -> float:
    """Best coverage at no more false alarms per minute and zone; 0 without any."""
    return max((p[lead] for p in curve if p["false_per_min_per_zone"] <= most_false), default=0.0)


def rows(report: dict[str, Any]) -> list[tuple[str, float, str, float, float]]:
    """What, the guard's figure, how it must stand to the bar, the bar, constant velocity's."""
    guard = report["forecasts"]["guard"]["curve"]
    velocity = report["trade_offs"]["constant_velocity"]["curve"]
    found = []
    for most, lead, words, bar in (
        (2.0, "warned_1_0_s", "warned ≥ 1.0 s at ≤ 2.0 false", 0.65),
        (2.0, "warned_0_5_s", "warned ≥ 0.5 s at ≤ 2.0 false", 0.75),
        (1.0, "warned_1_0_s", "warned ≥ 1.0 s at ≤ 1.0 false", 0.45),
    ):
        found.append((words, best(guard, lead, most), "≥", bar, best(velocity, lead, most)))
    missed = max(sum(lead is None for lead in report["published"]["caution"]["leads_s"]), 0)
    found.append(("crossings without any alert before", float(missed), "≤", 0.0, float("nan")))
    for of in report["reliability"]:
        words = f"calibration error within {of['horizon_s']:g} s"
        found.append((words, of["calibration_error"], "≤", 0.05, float("nan")))
    return found


def ahead_of(report: dict[str, Any], name: str) -> list[str]:
    """Settings of a baseline that no setting of the guard equals at no more false alarms."""
    guard = report["forecasts"]["guard"]["curve"]
    better = []
    for point in report["trade_offs"][name]["curve"]:
        rate, share = point["false_per_min_per_zone"], point["warned_1_0_s"]
        if best(guard, "warned_1_0_s", rate) < share:
            better.append(
                f"{point['threshold']:g}: {share:.0%} at {rate:.2f}, alarmed"
                f" {point['alarmed_share']:.0%} of the time"
            )
    return better


def main() -> int:
    """Evaluate and print; 1 if a bar is not reached."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", help="keep the report in this folder")
    parser.add_argument("--site", help="another site file than the walls")
    args = parser.parse_args()
    logs = sorted(map(str, LOGS.glob(RUNS)))
    if not logs:
        print(f"skipped: no recordings {RUNS} in {LOGS}")
        return 0
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        site = args.site or str(write_wall_site(Path(folder), logs))
        out = args.out or folder
        began_s = time.perf_counter()
        if rampe_guard(["evaluate", site, *logs, "--out", out]):
            return 2
        spent_s = time.perf_counter() - began_s
        report = json.loads((Path(out) / "report.json").read_text("utf-8"))
    table = Table("figure", "guard", "bar", "constant velocity", "", box=None)
    figures = rows(report)
    figures.append(("times as fast as it was done", report["duration_s"] / spent_s, "≥", 20.0, 0.0))
    failed = False
    for words, value, sign, bar, other in figures:
        reached = value >= bar if sign == "≥" else value <= bar
        failed |= not reached
        shown = f"{other:.2f}" if other == other and other else ""  # noqa: PLR0124 - not nan
        table.add_row(words, f"{value:.2f}", f"{sign} {bar:g}", shown, "" if reached else "MISSED")
    console.print(table)
    for name in report["trade_offs"]:
        points = ahead_of(report, name)
        if points:
            console.print(
                f"{name}: at {len(points)} of its settings more is warned at no more false alarms,"
                f" such as {points[-1]}"
            )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
