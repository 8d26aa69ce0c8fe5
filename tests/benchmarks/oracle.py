"""The sweep against an oracle of its own, on motions constructed to be hard.

Run it from the project's root, all of it (hours on one core) or one case again::

    python tests/benchmarks/oracle.py --motions 5000 --jobs 2
    python tests/benchmarks/oracle.py --arms zx200 --seed 0 --case 1234

A motion is swept forwards, backwards and without sharp clearances, and each answer is held, zone
by zone, against distances of the exact meshes (tests/support/search.py). Exit code 1 if any
promise is broken:

    missed     said free, touches
    false      said contact, never comes within twice the tolerance
    late       touches before the fraction called
    early      called by more than the tolerance of motion before it touches
    clearance  said more than is there           loose  said less by more than its tolerance
    now        said more than is there at the start
    place      the link named is not near where it is said to touch
    unknown    the budget did not suffice
    any_path   "free" refuted by a way, or "possible" by its own witness

In the table: `called` zones called contact, `other` the faults from clearance on, `unlike` zones
called otherwise backwards (right only within twice the tolerance of a touch), `early` the worst
motion before a touch, `over` and `under` how far clearances lay above and below the measured.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from rampe_guard.core.config import SweepConfig  # noqa: E402
from tests.support.hard_cases import KINDS, PER_BATCH, Machine  # noqa: E402
from tests.support.machines import NAMES, AbsentError, machine  # noqa: E402
from tests.support.oracle_run import Tally, batches, kind_of, run_batch  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rampe_guard.collision.urdf import Arm

FAULTS = (
    "missed", "false", "late", "early",
    "clearance", "loose", "now", "place", "unknown", "any_path",
)  # fmt: skip
HEAD = (
    "arm        kind     motions  called  missed   false    late   early   other  unlike"
    "  early mm   over mm  under mm  witness mm  median ms"
)
TOLD = 5
"""Stories of each kind of fault that are printed."""

_machines: dict[str, tuple[Machine, Arm]] = {}


def work(name: str, batch: int, options: argparse.Namespace, folder: str) -> Tally:
    """One batch; an arm is loaded once by each process."""
    config = SweepConfig()
    if options.sharp is not None:
        config = replace(config, clearance_tolerance_m=options.sharp)
    if name not in _machines:
        _machines[name] = machine(name, Path(folder))
    with tempfile.TemporaryDirectory(dir=folder) as own:
        return run_batch(
            *_machines[name], options.seed, batch, Path(own), only=options.case, config=config
        )


def row(name: str, kind: str, tally: Tally) -> str:
    """One line of the table."""
    main = [tally.faults.get(fault, 0) for fault in FAULTS[:4]]
    counts = [tally.contacts, *main, sum(tally.faults.values()) - sum(main), tally.unlike]
    lengths = (tally.early, tally.over, tally.under)
    median = float(np.median(tally.times)) if tally.times else 0.0
    return (
        f"{name:10} {kind:8} {tally.motions:7} "
        + " ".join(f"{count:7}" for count in counts)
        + " "
        + " ".join(f"{1e3 * length:9.4f}" for length in lengths)
        + f" {1e3 * tally.witness:11.4f} {median:10.2f}"
    )


def done_tasks(
    tasks: Sequence[tuple[str, int]], options: argparse.Namespace, folder: str
) -> Iterator[tuple[str, int, Tally]]:
    """Batches as they get done, in this process or in several."""
    if options.jobs == 1:
        for name, batch in tasks:
            yield name, batch, work(name, batch, options, folder)
        return
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        running = {
            pool.submit(work, name, batch, options, folder): (name, batch) for name, batch in tasks
        }
        for future in as_completed(running):
            yield *running[future], future.result()


def present(names: Sequence[str], folder: Path) -> list[str]:
    """The arms that can be loaded; the others are named and skipped."""
    found = []
    for name in names:
        try:
            _machines[name] = machine(name, folder)
        except AbsentError as why:
            print(f"{name}: skipped, {why}")
        else:
            found.append(name)
    return found


def main() -> int:
    """Print the table; 1 if a promise was broken or nothing could be tried."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", maxsplit=1)[0])
    parser.add_argument("--motions", type=int, default=120, help="in all, shared by the arms")
    parser.add_argument("--arms", nargs="+", default=["ur5", "excavator", "zx200"], choices=NAMES)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", type=int, help="only this motion, of each arm given")
    parser.add_argument("--sharp", type=float, help="clearance tolerance instead of ours [m]")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options = parser.parse_args()
    tallies: dict[tuple[str, str], Tally] = {}
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        arms = present(options.arms, Path(folder))
        share = -(-options.motions // max(len(arms), 1))
        numbers = batches(share) if options.case is None else [options.case // PER_BATCH]
        wanted = [n for n in numbers if options.case is not None or kind_of(n) in options.kinds]
        tasks = [(name, batch) for batch in wanted for name in arms]
        for i, (name, batch, tally) in enumerate(done_tasks(tasks, options, folder), 1):
            tallies.setdefault((name, kind_of(batch)), Tally()).add(tally)
            faults = f", {sum(tally.faults.values())} faults" if tally.faults else ""
            spent = time.monotonic() - begin
            print(f"[{spent:6.0f} s] {i}/{len(tasks)} {name} batch {batch}{faults}", flush=True)
    return report(tallies, options.seed)


def report(tallies: dict[tuple[str, str], Tally], seed: int) -> int:
    """Faults first, a few of each kind, then the table."""
    total = Tally()
    for tally in tallies.values():
        total.add(tally)
    for fault in FAULTS:
        for story in [s for s in total.stories if s.startswith(f"{fault}:")][:TOLD]:
            print(f"{story}   [--seed {seed}]")
    print(HEAD)
    for (name, kind), tally in sorted(tallies.items()):
        print(row(name, kind, tally))
    print(row("all", "", total))
    print(f"verdicts {total.verdicts}, of them truly touching {total.touching}")
    print(f"faults {total.faults or 'none'}, answers of any_path {total.answers}")
    return 1 if total.faults or not total.motions else 0


if __name__ == "__main__":
    sys.exit(main())
