"""Two routers, one of which dies: ``python -m tests.benchmarks.failover [--times 10]``.

Guard, machine and viewer know both routers, which are linked; the viewer prefers the other one.
The arm pushes against the crate. The first router is killed, and later comes back; then the second,
and so on. Measured is how long it takes until the alert is shown as good again, and judged as in
`tests.support.ground`: never may anything less be shown than the alert, or that nobody watches.
"""

from __future__ import annotations

import argparse
import os
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

from tests.support.bench_site import bench_copy
from tests.support.ends import end_on_signals
from tests.support.faults import Fault, Outcome, suffer
from tests.support.ground import Ground, proving_ground

APART_S = 3.0


def router_dies(number: int) -> Fault:
    """The router of that number is killed, and is not needed any more."""

    def act(ground: Ground, _: random.Random, _seconds: float) -> float:
        ground.routers[number].popen.kill()
        ground.routers[number].popen.wait()
        return time.monotonic()

    promise = "alerts flow through the other within 2 s"
    return Fault(f"router {number + 1} of 2 dies", promise, act, 0.0, back_s=2.0)


def one(ground: Ground, number: int, rng: random.Random, slow: float = 1.0) -> Outcome:
    """It dies, and comes back once all is well again."""
    outcome = suffer(ground, router_dies(number), rng, held=True, slow=slow)
    ground.restart_router(number)
    ground.pause(APART_S)
    return outcome


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=10)
    args = parser.parse_args()
    end_on_signals()
    rng = random.Random(1)
    with tempfile.TemporaryDirectory(prefix="rampe-guard-") as name:
        folder = Path(name)
        with proving_ground(folder, bench_copy(folder), routers=2) as ground:
            outcomes = [one(ground, number % 2, rng) for number in range(args.times)]
            verdict = ground.verdict
    back = [outcome.back_s for outcome in outcomes]
    print(f"load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(
        f"{len(back)} routers died: alerts flowed again after {statistics.median(back):.2f} s"
        f" (at most {max(back):.2f} s); wrongly clear {verdict.wrong_s:.2f} s,"
        f" unexplained losses {len(verdict.unexplained)}"
    )
    for line in verdict.notes:
        print("wrong:", line)
    broken = [outcome.broken for outcome in outcomes if outcome.broken]
    for line in broken:
        print("BROKEN:", line)
    return 1 if broken or verdict.unexplained or verdict.missed else 0


if __name__ == "__main__":
    sys.exit(main())
