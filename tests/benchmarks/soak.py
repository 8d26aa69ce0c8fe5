"""Hours of work with faults at random: ``python -m tests.benchmarks.soak [--hours 2]``.

A router, a supervised guard of the bench site, a scripted machine at 100 Hz and a viewer run as
processes of their own. The machine works, and again and again pushes against the crate. At random
moments something breaks (`tests.support.faults`), half of the time while the arm pushes. Every
minute is noted what the guard costs. In the end: a table, and a verdict, which is the exit code:

* the loop's p99 is flat: its last third at most 1.25 times its first, or 0.3 ms above it;
* memory of its own grows by less than 1 MB an hour after warm-up, what is remembered of the
  work not counted (it is bounded: 200 bytes a situation);
* no push without its alert, never anything less shown, and no loss of protection but in a fault.

The guard is killed only in the first fifth of the time and in the last tenth: in between one
process must last. Warm-up is the first half hour of it, or the first quarter of a shorter soak:
until then buffers and caches have met all that the work brings.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from tests.support.bench_site import bench_copy
from tests.support.ends import end_on_signals
from tests.support.faults import FAULTS, Fault, Outcome, suffer
from tests.support.gauges import cost
from tests.support.ground import Ground, proving_ground

SITUATION_MB = 200 / 1024**2
LONGEST_GAP_S, SHORTEST_GAP_S = 40.0, 8.0
FLAT, FLAT_MS = 1.25, 0.3
GROWTH_MB_H = 1.0
WARM_UP_S = 1800.0
SETTINGS = (
    "next: {situations: 10000}",
    "memory: {save_every_s: 30}",
)


@dataclass(frozen=True, slots=True)
class Sample:
    """One look at the guard.

    Attributes:
        at_s: since the start [s].
        boot: which run of the guard.
        p50_ms: median of its loop [ms].
        p99_ms: of its loop [ms].
        own_mb: memory of its own [MB].
        cpu_share: of one core since the look before.
        situations: remembered.
        load: of this machine.
    """

    at_s: float
    boot: str
    p50_ms: float
    p99_ms: float
    own_mb: float
    cpu_share: float
    situations: int
    load: float


class Soak:
    """One run.

    Args:
        ground: all that runs.
        seconds: how long [s].
        seed: of all that is left to chance.
        every_s: time between two looks [s].
    """

    def __init__(self, ground: Ground, seconds: float, seed: int, every_s: float) -> None:
        self._ground, self._seconds = ground, seconds
        self._rng = random.Random(seed)
        self._every_s = every_s
        self._start_s = time.monotonic()
        self._due_s = 0.0
        self._before: tuple[int, float, float] | None = None
        self.samples: list[Sample] = []
        self.outcomes: list[Outcome] = []
        self._waiting: list[Fault] = []

    @property
    def passed_s(self) -> float:
        """Time since the start [s]."""
        return time.monotonic() - self._start_s

    def run(self) -> None:
        """To the end of the time."""
        self._start_s = time.monotonic()
        while self.passed_s < self._seconds:
            self._work(self._rng.uniform(SHORTEST_GAP_S, LONGEST_GAP_S))
            fault = self._next()
            if self.passed_s + fault.seconds + 10.0 > self._seconds:
                break
            held = self._rng.random() < 0.5
            outcome = suffer(self._ground, fault, self._rng, held=held)
            self.outcomes.append(outcome)
            if outcome.broken:
                print(f"{self.passed_s:.0f} s: {fault.name}: {outcome.broken}", flush=True)
        self._work(max(self._seconds - self.passed_s, 0.0))

    def _work(self, seconds: float) -> None:
        end_s = min(self.passed_s + seconds, self._seconds)
        while self.passed_s < end_s:
            self._ground.pause(min(1.0, max(end_s - self.passed_s, 0.01)))
            if self.passed_s >= self._due_s:
                self._due_s += self._every_s
                self._look()

    def _next(self) -> Fault:
        """Each once in every round; the guard is killed only where it may be."""
        share = self.passed_s / self._seconds
        kill = share < 0.2 or share > 0.9
        while True:
            if not self._waiting:
                self._waiting = list(FAULTS)
                self._rng.shuffle(self._waiting)
            fault = self._waiting.pop()
            if kill or "SIGKILL" not in fault.name:
                return fault

    def _look(self) -> None:
        pid, at_s = self._ground.worker, self.passed_s
        beat = self._ground.witness.beats.newest
        with contextlib.suppress(OSError):
            now = cost(pid)
            before, self._before = self._before, (pid, at_s, now.cpu_s)
            if before is None or before[0] != pid or not beat["loop_ms"]:
                return
            self.samples.append(
                Sample(
                    at_s=at_s,
                    boot=beat["boot_id"],
                    p50_ms=beat["loop_ms"]["p50"],
                    p99_ms=beat["loop_ms"]["p99"],
                    own_mb=now.own_mb,
                    cpu_share=(now.cpu_s - before[2]) / (at_s - before[1]),
                    situations=(beat["memory"] or {}).get("situations", 0),
                    load=os.getloadavg()[0],
                )
            )


def longest_life(samples: Sequence[Sample]) -> list[Sample]:
    """Of the run of the guard that lasted longest, without its warm-up."""
    lives: dict[str, list[Sample]] = {}
    for sample in samples:
        lives.setdefault(sample.boot, []).append(sample)
    life = max(lives.values(), key=lambda life: life[-1].at_s - life[0].at_s, default=[])
    if not life:
        return []
    begins_s = life[0].at_s + min(WARM_UP_S, 0.25 * (samples[-1].at_s - samples[0].at_s))
    return [sample for sample in life if sample.at_s >= begins_s]


def slope(xs: Sequence[float], ys: Sequence[float]) -> float:
    """The median slope of all pairs (Theil and Sen): no outlier moves it."""
    x, y = np.array(xs), np.array(ys)
    i, j = np.triu_indices(len(x), 1)
    return float(np.median((y[j] - y[i]) / (x[j] - x[i]))) if len(x) > 1 else 0.0


def judge(ground: Ground, soak: Soak) -> dict[str, Any]:
    """All figures, and what was not kept."""
    life, verdict, beats = longest_life(soak.samples), ground.verdict, ground.witness.beats
    p99 = [s.p99_ms for s in life]
    third = max(len(life) // 3, 1)
    first, last = (statistics.median(x) if x else 0.0 for x in (p99[:third], p99[-third:]))
    hours = [s.at_s / 3600.0 for s in life]
    growth = slope(hours, [s.own_mb - s.situations * SITUATION_MB for s in life])
    failed = [f"{o.fault.name}: {o.broken}" for o in soak.outcomes if o.broken]
    failed += [f"a push without alert at {at:.1f} s" for at in verdict.missed]
    failed += [f"protection lost {a:.1f} to {b:.1f} s" for a, b in verdict.unexplained]
    if verdict.wrong_s:
        failed.append(f"less than the alert was shown for {verdict.wrong_s:.2f} s")
        failed += verdict.notes
    if last > FLAT * first and last > first + FLAT_MS:
        failed.append(f"p99 rose from {first:.2f} to {last:.2f} ms")
    if growth > GROWTH_MB_H:
        failed.append(f"memory grew by {growth:.2f} MB an hour")
    return {
        "hours": soak.passed_s / 3600.0,
        "pushes": verdict.pushes,
        "warned": verdict.warned,
        "known_unwatched": verdict.unwatched,
        "missed": len(verdict.missed),
        "wrong_s": verdict.wrong_s,
        "lead_median_s": statistics.median(verdict.leads_s) if verdict.leads_s else None,
        "faults": len(soak.outcomes),
        "losses_of_protection": len(verdict.lost),
        "unexplained": len(verdict.unexplained),
        "heartbeats": beats.count,
        "heartbeats_missing": beats.missing,
        "alerts_missing": ground.witness.missing_alerts,
        "longest_life_h": hours[-1] - hours[0] if hours else 0.0,
        "p50_ms": statistics.median(s.p50_ms for s in life) if life else None,
        "p99_ms": statistics.median(p99) if p99 else None,
        "p99_first_third_ms": first,
        "p99_last_third_ms": last,
        "cpu_share": statistics.median(s.cpu_share for s in life) if life else None,
        "own_mb": life[-1].own_mb if life else None,
        "growth_mb_h": growth,
        "growth_with_situations_mb_h": slope(hours, [s.own_mb for s in life]),
        "load": statistics.median(s.load for s in life) if life else None,
        "failed": failed,
    }


def show(report: dict[str, Any], outcomes: Sequence[Outcome], console: Console) -> None:
    """Print it."""
    table = Table("fault", "times", "back, median [s]", "worst [s]", "broken", box=None)
    for fault in FAULTS:
        of_it = [o for o in outcomes if o.fault is fault]
        back = [o.back_s for o in of_it]
        if of_it:
            broken = str(sum(bool(o.broken) for o in of_it))
            median = f"{statistics.median(back):.2f}"
            table.add_row(fault.name, str(len(of_it)), median, f"{max(back):.2f}", broken)
    console.print(table)
    for name, value in report.items():
        if name != "failed":
            console.print(f"{name:>28}  {f'{value:.3g}' if isinstance(value, float) else value}")
    for line in report["failed"]:
        console.print(f"NOT KEPT: {line}", markup=False)
    console.print("all kept" if not report["failed"] else "")


def soak(
    folder: Path, seconds: float, seed: int, every_s: float, rate_hz: float = 100.0
) -> tuple[dict[str, Any], Soak]:
    """Run it; the report and all that was noted."""
    site = bench_copy(folder, *SETTINGS)
    with proving_ground(folder, site, rate_hz=rate_hz, seed=seed) as ground:
        running = Soak(ground, seconds, seed, every_s)
        with contextlib.suppress(KeyboardInterrupt):
            running.run()
        return judge(ground, running), running


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--minutes", type=float, help="instead of hours")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write all figures there")
    parser.add_argument("--keep", type=Path, help="a folder for the logs of all processes")
    args = parser.parse_args()
    seconds = args.hours * 3600.0 if args.minutes is None else args.minutes * 60.0
    end_on_signals()
    with contextlib.ExitStack() as stack:
        folder = args.keep or Path(
            stack.enter_context(tempfile.TemporaryDirectory(prefix="rampe-guard-"))
        )
        folder.mkdir(parents=True, exist_ok=True)
        every_s = min(60.0, max(seconds / 60.0, 5.0))
        report, running = soak(folder, seconds, args.seed, every_s)
    show(report, running.outcomes, Console(width=110))
    if args.json is not None:
        outcomes = [
            {"fault": o.fault.name, "held": o.held, "back_s": o.back_s, "lost_s": o.lost_s}
            for o in running.outcomes
        ]
        samples = [asdict(s) for s in running.samples]
        whole = {**report, "outcomes": outcomes, "samples": samples}
        args.json.write_text(json.dumps(whole, indent=1, default=str), "utf-8")
    return 1 if report["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
