"""Twenty machines through one router: ``python -m tests.benchmarks.many_machines``.

    [--machines 20] [--seconds 60] [--rates 5 15]

Each machine has a guard of its own, two processes as ``run`` starts them, with its own keys and its
own memory. They work at each of the rates for a while. Told are processor time, memory and latency
for each machine, what a step costs apart from what a guard costs that has nothing to do (a straight
line through both rates), and the router's share, so that one can reckon for other numbers.
Latency is from the time when the machine measured (its stamp) until a change of an alert is heard.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from rich.console import Console
from rich.table import Table

from tests.support import processes
from tests.support.bench_site import bench_copy
from tests.support.ears import open_session
from tests.support.ends import end_on_signals
from tests.support.gauges import Cost, cost
from tests.support.processes import Process

AT_ONCE = 2
"""Guards that start at the same time."""


class Listener:
    """Latencies of changes, and the newest heartbeat of each machine."""

    def __init__(self, endpoint: str) -> None:
        self._lock = threading.Lock()
        self.latencies_s: list[float] = []
        self.beats: dict[str, dict[str, Any]] = {}
        self.session = open_session(endpoint)
        self._subscriber = self.session.declare_subscriber("rampe/bench/*/guard/*", self._hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        now_unix_s = time.time()
        key = str(sample.key_expr)
        if not key.endswith(("/alert", "/heartbeat")):
            return
        body = json.loads(sample.payload.to_bytes())
        with self._lock:
            if key.endswith("/heartbeat"):
                self.beats[body["machine"]] = body
            elif (
                body["stamp"] is not None
                and abs(body["published_unix_s"] - body["changed_unix_s"]) < 1e-3
                and body["state"] == "unacked"
            ):
                self.latencies_s.append(now_unix_s - body["stamp"])

    def taken(self) -> list[float]:
        """Latencies since the last time [s]."""
        with self._lock:
            found, self.latencies_s = self.latencies_s, []
            return found


@dataclass(frozen=True, slots=True)
class Window:
    """What one rate cost; processor time in shares of a core.

    Attributes:
        rate_hz: of each machine.
        guard: for each machine, median and largest.
        router: of all together.
        steps_hz: steps that each guard really took, mean.
        latencies_s: of changes of alerts [s].
        loop_p99_ms: as the guards tell, median [ms].
        watching: machines that said ok or degraded.
    """

    rate_hz: float
    guard: tuple[float, float]
    router: float
    steps_hz: float
    latencies_s: list[float]
    loop_p99_ms: float
    watching: int


def spent(before: dict[int, Cost], seconds: float) -> dict[int, float]:
    """Shares of a core, by process."""
    return {pid: (cost(pid).cpu_s - was.cpu_s) / seconds for pid, was in before.items()}


def window(
    rate_hz: float, seconds: float, pusher: Process, guards: list[int], router: int, ear: Listener
) -> Window:
    """Work for a while at a rate."""
    pusher.tell(str(rate_hz))
    time.sleep(5.0)
    ear.taken()
    accepted = {name: beat["accepted"].get("actuators", 0) for name, beat in ear.beats.items()}
    began_s = time.monotonic()
    before = {pid: cost(pid) for pid in (*guards, router)}
    time.sleep(seconds)
    shares = spent(before, time.monotonic() - began_s)
    beats = dict(ear.beats)
    steps = [beats[n]["accepted"]["actuators"] - count for n, count in accepted.items()]
    each = [shares[pid] for pid in guards]
    return Window(
        rate_hz,
        (statistics.median(each), max(each)),
        shares[router],
        statistics.mean(steps) / (time.monotonic() - began_s),
        ear.taken(),
        statistics.median(b["loop_ms"]["p99"] for b in beats.values() if b["loop_ms"]),
        sum(b["status"] in ("ok", "degraded") for b in beats.values()),
    )


def show(windows: list[Window], costs: list[Cost], router: Cost, console: Console) -> None:
    """Print it, and the straight line."""
    table = Table(
        *("rate, Hz", "steps a guard, 1/s", "a guard, % of a core: median, most"),
        *("router, %", "alert after, ms: p50, p99", "loop p99, ms", "watching"),
        box=None,
    )
    for w in windows:
        p50, p99 = np.percentile(w.latencies_s, [50, 99]) * 1e3 if w.latencies_s else (0.0, 0.0)
        table.add_row(
            f"{w.rate_hz:g}",
            f"{w.steps_hz:.1f}",
            f"{100 * w.guard[0]:.1f}, {100 * w.guard[1]:.1f}",
            f"{100 * w.router:.1f}",
            f"{p50:.0f}, {p99:.0f} of {len(w.latencies_s)}",
            f"{w.loop_p99_ms:.1f}",
            str(w.watching),
        )
    console.print(table)
    slope, base = np.polyfit([w.steps_hz for w in windows], [w.guard[0] for w in windows], 1)
    own, share = (statistics.mean(x) for x in zip(*((c.own_mb, c.share_mb) for c in costs)))  # noqa: B905
    console.print(
        f"a guard with nothing to do: {100 * base:.1f} % of a core; a step: {1e3 * slope:.2f} ms of"
        f" a core; so 100 Hz would take {100 * (base + 100 * slope):.0f} %"
    )
    console.print(
        f"memory of a guard: {own:.0f} MB of its own, {share:.0f} MB with its share of what all"
        f" have in common; router: {router.own_mb:.0f} MB"
    )
    console.print(f"load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rates", type=float, nargs="+", default=[5.0, 15.0])
    args = parser.parse_args()
    end_on_signals()
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rampe-guard-")))
        names = [f"machine-{n}" for n in range(args.machines)]
        sites = [bench_copy(folder, machine=name, name=name) for name in names]
        endpoint = processes.free_endpoint()
        router = stack.enter_context(processes.router(folder, endpoint))
        ear = Listener(endpoint)
        stack.callback(ear.session.close)
        words = ["-m", "tests.support.fleet_pusher", endpoint, *map(str, sites)]
        pusher = stack.enter_context(Process(folder, "pusher", words, talk=True))
        pusher.wait_for("ready")
        pusher.tell("5")
        guards: list[Process] = []
        for number, site in enumerate(sites):
            words = ["-m", "rampe_guard", "run", str(site), "--connect", endpoint]
            guards.append(stack.enter_context(Process(folder, f"guard-{number}", words)))
            if number % AT_ONCE == AT_ONCE - 1:
                for guard in guards[-AT_ONCE:]:
                    guard.wait_for("guarding on")
        for guard in guards:
            guard.wait_for("guarding on")
        workers = [processes.guarding(guard) for guard in guards]
        print(f"{len(workers)} guards are up", flush=True)
        windows = [
            window(rate_hz, args.seconds, pusher, workers, router.pid, ear)
            for rate_hz in args.rates
        ]
        costs, of_router = [cost(pid) for pid in workers], cost(router.pid)
        show(windows, costs, of_router, Console(width=120))
        failed = [g.err for g in guards if not g.alive or "Traceback" in g.err]
    for err in failed:
        print("FAILED:", err[-1000:])
    return 1 if failed or any(w.watching < args.machines for w in windows) else 0


if __name__ == "__main__":
    sys.exit(main())
