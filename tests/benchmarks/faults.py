"""Every fault, again and again: ``python -m tests.benchmarks.faults [--times 5] [--only WORD]``.

Router, supervised guard, scripted machine at 100 Hz, viewer, and a judge (`tests.support.ground`).
Each fault of `tests.support.faults` comes so many times, the router's death 50 times and a thousand
scenes, every other
time while the arm pushes against the crate. Prints the table of the README: fault, promise, and
what was measured. The exit code is 1 if a promise was broken.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import statistics
import sys
import tempfile
from pathlib import Path

from tests.support.bench_site import bench_copy
from tests.support.ends import end_on_signals
from tests.support.faults import FAULTS, Fault, Outcome, router_killed, suffer
from tests.support.faults_inside import INSIDE, scenes_put
from tests.support.ground import proving_ground

ROUTER_DEATHS = 50
SCENES = 1000


def times(fault: Fault, usual: int) -> int:
    """How often it comes."""
    if fault.act is router_killed and usual > 1:
        return ROUTER_DEATHS
    return 1 if "scenes" in fault.name else usual


def row(fault: Fault, outcomes: list[Outcome]) -> str:
    """A line of the table."""
    back = [outcome.back_s for outcome in outcomes]
    lost = [outcome.lost_s for outcome in outcomes]
    wrong_s = sum(outcome.wrong_s for outcome in outcomes)
    measured = f"back in {statistics.median(back):.2f} s (at most {max(back):.2f})"
    if not fault.blinds:
        measured = f"protection lost for {max(lost):.2f} s"
    measured += f"; wrongly clear {wrong_s:.2f} s"
    return f"| {fault.name}, {len(outcomes)} times | {fault.promise} | {measured} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--only", default="", help="faults with this word in their name")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    end_on_signals()
    rng, broken = random.Random(args.seed), []
    rows = ["| fault | promise | measured |", "|---|---|---|"]
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rampe-guard-")))
        site = bench_copy(folder, "memory: {save_every_s: 1}")
        ground = stack.enter_context(
            proving_ground(folder, site, seed=args.seed, clock=folder / "clock")
        )
        ground.pause(10.0)
        for fault in (*FAULTS, *INSIDE, scenes_put(SCENES if args.times > 1 else 20)):
            if args.only not in fault.name:
                continue
            outcomes = []
            for number in range(times(fault, args.times)):
                if "SIGKILL" in fault.name:  # one that dies young is started after a while only
                    ground.pause(10.0)
                outcome = suffer(ground, fault, rng, held=number % 2 == 0)
                outcomes.append(outcome)
                if outcome.broken:
                    broken.append(f"{fault.name}: {outcome.broken}")
                ground.pause(1.0)
            rows.append(row(fault, outcomes))
            print(rows[-1], flush=True)
        verdict = ground.verdict
        broken += [f"protection lost {b - a:.2f} s, unexplained" for a, b in verdict.unexplained]
        broken += [f"a push without alert at {at:.1f} s" for at in verdict.missed]
    print(f"\nload of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
    print("\n".join(rows))
    print(
        f"\n{verdict.pushes} pushes against the crate: {verdict.warned} shown as imminent in time,"
        f" {verdict.unwatched} while it was shown that nobody watches, {len(verdict.missed)} missed"
    )
    for line in (*broken, *verdict.notes):
        print("BROKEN:", line)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
