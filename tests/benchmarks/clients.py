"""How soon a client that comes late knows all, and whether a hundred at once are served.

    python -m tests.benchmarks.clients [--joins 50] [--clients 100] [--processes 10]

A router, a real guard of the bench site with an imminent alert, and its machine run beside it,
all on loopback. First one client after another joins and leaves. Then all join at once, from a
few processes, and hear the alert end and come again.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from rampe_guard.client import Alert, Alerts, Item, MessagesLost, Protection
from tests.support.processes import Process, until
from tests.support.station import Station, station


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--joins", type=int, default=50)
    parser.add_argument("--clients", type=int, default=100)
    parser.add_argument("--processes", type=int, default=10)
    parser.add_argument("--be", nargs=3, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.be:
        listen(args.be[0], args.be[1], int(args.be[2]))
        return 0
    with tempfile.TemporaryDirectory() as name, station(Path(name)) as live:
        live.calm()
        live.press_on_crate()
        late(live, args.joins)
        return crowd(live, Path(name), args.clients, args.processes)


def late(live: Station, joins: int) -> None:
    """One after another."""
    known_ms = []
    for _ in range(joins):
        began_s = time.perf_counter()
        with Alerts(live.endpoint, live.site.keys.base) as alerts:
            known_ms.append((time.perf_counter() - began_s) * 1e3)
            machine = alerts.machines[live.site.keys.base]
            assert machine.protection is Protection.MONITORING
            assert any(alert.zone == "crate" for alert in machine.active)
            assert not machine.behind
    say("one joins, session and whole state", known_ms)


def crowd(live: Station, folder: Path, clients: int, processes: int) -> int:
    """All at once; returns 1 if one of them missed anything."""
    before = loop_p99_ms(live)
    share = [clients // processes + (i < clients % processes) for i in range(processes)]
    args = ["-m", "tests.benchmarks.clients", "--be", live.endpoint, live.site.keys.base]
    groups = [Process(folder, f"g{i}", [*args, str(n)], talk=True) for i, n in enumerate(share)]
    try:
        for group in groups:
            group.wait_for("ready")
        for group in groups:
            group.tell("go")
        for group in groups:
            group.wait_for('"joined_ms"', 120.0)
        time.sleep(3.0)
        live.calm()
        live.press_on_crate()
        time.sleep(1.0)
        during = loop_p99_ms(live)
        for group in groups:
            group.tell("end")
            until(lambda group=group: not group.alive, 60.0, "its end")  # type: ignore[misc]
        joined = [ms for group in groups for ms in told(group, "joined_ms")]
        heard = [set(map(tuple, h)) for group in groups for h in told(group, "heard")]
        lost = sum(told(group, "lost") for group in groups)
    finally:
        for group in groups:
            group.close()
    say(f"{len(joined)} join at once, session and whole state", joined)
    wanted = {("crate", "clear"), ("crate", "imminent")}
    served = sum(wanted <= h for h in heard)
    print(f"heard the alert end and come again: {served} of {clients}; messages lost: {lost}")
    print(
        f"guard's loop, p99 over its last seconds: {before:.1f} ms before, {during:.1f} ms with all"
    )
    return int(served != clients or len(joined) != clients)


def listen(endpoint: str, base: str, count: int) -> None:
    """Be ``count`` clients, each with a session and a thread of its own."""
    print("ready", flush=True)
    sys.stdin.readline()
    joined_ms: list[float] = []
    heard: list[list[Item]] = [[] for _ in range(count)]
    over = threading.Event()
    all_in = threading.Barrier(count + 1)

    def one(mine: list[Item]) -> None:
        began_s = time.perf_counter()
        with Alerts(endpoint, base, timeout_s=30.0) as alerts:
            known = alerts.machines[base]
            if known.heartbeat is not None and known.alerts:
                joined_ms.append((time.perf_counter() - began_s) * 1e3)
            all_in.wait(120.0)
            while not over.is_set():
                item = alerts.get(timeout_s=0.2)
                mine.extend([] if item is None else [item])

    threads = [threading.Thread(target=one, args=(mine,)) for mine in heard]
    for thread in threads:
        thread.start()
    all_in.wait(120.0)
    print(json.dumps({"joined_ms": joined_ms}), flush=True)
    sys.stdin.readline()
    over.set()
    for thread in threads:
        thread.join()
    alerts = [[(i.zone, i.level) for i in mine if isinstance(i, Alert)] for mine in heard]
    lost = sum(i.count for mine in heard for i in mine if isinstance(i, MessagesLost))
    print(json.dumps({"heard": alerts, "lost": lost}), flush=True)


def told(group: Process, name: str) -> Any:
    """A value that a group of clients has printed."""
    lines = [json.loads(line) for line in group.out.splitlines() if line.startswith("{")]
    return next((line[name] for line in lines if name in line), [])


def loop_p99_ms(live: Station) -> float:
    """By the guard's own account."""
    beat = live.ears.wait("heartbeat", lambda b: b["loop_ms"] is not None, 5.0, time.monotonic())
    return float(beat.body["loop_ms"]["p99"])


def say(what: str, times_ms: list[float]) -> None:
    p50, p99 = np.percentile(times_ms, [50.0, 99.0])
    print(f"{what}: p50 {p50:.1f} ms, p99 {p99:.1f} ms, longest {max(times_ms):.1f} ms")


if __name__ == "__main__":
    sys.exit(main())
