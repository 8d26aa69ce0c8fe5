"""How early, how often in vain, on a real operator: ``python -m tests.benchmarks.foresight``.

Runs `evaluate` on the recordings beside the checkout (``../shared/data/excavator_logs``), each
run judged with only the runs before it known, against walls at the 10 % and 90 % quantiles of
all positions, and prints its figures against what they have to reach; with ``--geometry`` against
solid walls, ceiling and crates, beside each baseline at every false-alarm rate of the curve.
"""

from __future__ import annotations

import argparse
import json
import math
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
from tests.support.room_site import write_room_site
from tests.support.wall_site import write_wall_site

LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"
RUNS = "operator3_run*.csv"

Point = dict[str, Any]


FALSE, ON = "false_per_min_per_zone", "alarmed_share"
STEPS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
"""False alarms a minute and zone at which forecasters are held against each other."""
SHARES = (0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4)
"""Shares of the time alarmed at which they are."""


def best(curve: Sequence[Point], lead: str, most: float, cost: str = FALSE) -> float:
    """Best coverage at no more of a cost; nan where it cannot be had so cheaply."""
    return max((p[lead] for p in curve if p[cost] <= most), default=float("nan"))


def curves(report: dict[str, Any]) -> dict[str, list[Point]]:
    """Every forecaster over all its settings."""
    found = {name: of["curve"] for name, of in report["trade_offs"].items()}
    return found | {
        name: of["curve"]
        for name, of in report["forecasts"].items()
        if name.startswith("guard") or name in {"stopping", "rampe_primitive", "running_mean"}
    }


def missed_crossings(report: dict[str, Any]) -> tuple[int, int]:
    """Crossings without any published alert: later than a log's first second, and within it.

    What is touched while the first samples arrive, no forecaster can warn of.
    """
    leads = iter(report["published"]["caution"]["leads_s"])
    late = early = 0
    for log in report["logs"]:
        for zone in log["zones"].values():
            for entered, _ in zone["contacts"]:
                since_s = entered - log["start_s"]
                if since_s > 0.0 and next(leads) is None:
                    late += since_s > 1.0
                    early += since_s <= 1.0
    return late, early


def rows(report: dict[str, Any]) -> list[tuple[str, float, str, float, float, float]]:
    """What, the guard's figure, how it stands to the bar, the bar, sparing, constant velocity."""
    guard = report["forecasts"]["guard"]["curve"]
    sparing = report["forecasts"]["guard_sparing"]["curve"]
    velocity = report["trade_offs"]["constant_velocity"]["curve"]
    nan = float("nan")
    found = []
    for most, lead, words, bar in (
        (2.0, "warned_1_0_s", "warned ≥ 1.0 s at ≤ 2.0 false", 0.65),
        (2.0, "warned_0_5_s", "warned ≥ 0.5 s at ≤ 2.0 false", 0.75),
        (1.0, "warned_1_0_s", "warned ≥ 1.0 s at ≤ 1.0 false", 0.45),
    ):
        mine, spared, plain = (best(curve, lead, most) for curve in (guard, sparing, velocity))
        found.append((words, mine, "≥", bar, spared, plain))
    missed, early = missed_crossings(report)
    words = f"crossings without any alert before ({early} more in a log's first second)"
    found.append((words, float(missed), "≤", 0.0, nan, nan))
    for of in report["reliability"]:
        words = f"calibration error within {of['horizon_s']:g} s"
        found.append((words, of["calibration_error"], "≤", 0.05, nan, nan))
        told = f"  the same where at least 2 % was said ({of['answers_told']} answers)"
        found.append((told, of["calibration_error_told"], "≤", 0.05, nan, nan))
    return found


def compared(report: dict[str, Any], cost: str, steps: Sequence[float], title: str) -> Table:
    """Coverage a second ahead of all forecasters at equal costs."""
    table = Table(title, box=None)
    for most in steps:
        table.add_column(f"{most:g}", justify="right")
    for name, curve in curves(report).items():
        shares = [best(curve, "warned_1_0_s", most, cost) for most in steps]
        table.add_row(name, *("" if math.isnan(share) else f"{share:.0%}" for share in shares))
    return table


def ahead_of(report: dict[str, Any], cost: str) -> list[str]:
    """Settings of baselines that no setting of the guard equals at no more of a cost."""
    guard = report["forecasts"]["guard"]["curve"]
    better = []
    for name, curve in curves(report).items():
        points = [] if name.startswith("guard") else curve
        for point in points:
            mine = best(guard, "warned_1_0_s", point[cost], cost)
            if not mine >= point["warned_1_0_s"]:  # nan where the guard cannot be so cheap
                better.append(
                    f"{name} {point['threshold'] or 0.0:g}: {point['warned_1_0_s']:.0%} at"
                    f" {point[FALSE]:.2f} false, alarmed {point[ON]:.0%} of the time"
                    f" (guard {'cannot' if math.isnan(mine) else f'{mine:.0%}'})"
                )
    return better


def main() -> int:
    """Evaluate and print; 1 if a bar is not reached."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", help="keep the report in this folder")
    parser.add_argument("--site", help="another site file than the walls")
    parser.add_argument("--geometry", action="store_true", help="solid walls, ceiling, crates")
    parser.add_argument("--jobs", default="0", help="processes; as many as there are cores")
    args = parser.parse_args()
    logs = sorted(map(str, LOGS.glob(RUNS)))
    if not logs:
        print(f"skipped: no recordings {RUNS} in {LOGS}")
        return 0
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        make = write_room_site if args.geometry else write_wall_site
        site = args.site or str(make(Path(folder), logs))
        out = args.out or folder
        jobs = [] if args.jobs == "0" else ["--jobs", args.jobs]
        began_s = time.perf_counter()
        if rampe_guard(["evaluate", site, *logs, "--out", out, *jobs]):
            return 2
        spent_s = time.perf_counter() - began_s
        report = json.loads((Path(out) / "report.json").read_text("utf-8"))
    console = Console(width=max(console.width, 110))
    table = Table("figure", "guard", "bar", "sparing", "constant velocity", "", box=None)
    figures = rows(report)
    nan = float("nan")
    figures.append(
        ("times as fast as it was done", report["duration_s"] / spent_s, "≥", 20.0, nan, nan)
    )
    failed = False
    for words, value, sign, bar, *others in figures:
        reached = value >= bar if sign == "≥" else value <= bar
        failed |= not reached
        shown = ("" if math.isnan(other) else f"{other:.2f}" for other in others)
        digits = 3 if "calibration" in words or "same" in words else 2
        last = "" if reached else "MISSED"
        mine = "never" if math.isnan(value) else f"{value:.{digits}f}"
        table.add_row(words, mine, f"{sign} {bar:g}", *shown, last)
    console.print(table)
    console.print()
    console.print(compared(report, FALSE, STEPS, "warned ≥ 1 s at ≤ … false a minute and zone"))
    console.print()
    console.print(compared(report, ON, SHARES, "warned ≥ 1 s, alarmed ≤ … of the time"))
    for cost, words in ((FALSE, "false alarms"), (ON, "of the time alarmed")):
        points = ahead_of(report, cost)
        console.print(f"\n{len(points)} settings of baselines warn of more at no more {words}")
        for point in points[:: max(1, len(points) // 12)]:
            console.print(f"  {point}")
        failed |= args.geometry and bool(points)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
