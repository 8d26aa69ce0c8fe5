"""Does saving a day's situations stall the worker? ``python -m tests.benchmarks.saving``

A memory of 200,000 situations is saved again and again by the keeper's thread, as in a guard, while
this thread takes turns of a millisecond as the worker loop does: how late is a turn while a save is
under way, and how late without one? What both have is the computer; the difference is the save.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rampe_guard.core.situation import Likeness
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import FloatArray
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store_situations import SituationKeeper
from rampe_guard.runtime.worker import SWITCH_S
from rampe_guard.settings import Site
from tests.support.models import bench_limits, bench_site

TURN_S = 0.001
NODE_S = 0.1


def remembering(site: Site, count: int) -> SituationMemory:
    """A memory of so many situations, no two alike."""
    top = np.array([a.max_velocity for a in site.guard.actuators])
    likeness, n = Likeness(top), len(top)
    memory = SituationMemory(likeness, n, site.guard.next.horizon_s, count)
    rng, stamp_s = np.random.default_rng(1), 0.0
    while memory.count < 0.97 * count:
        stamp_s += NODE_S
        see(memory, rng, stamp_s, likeness, n)
    return memory


def see(
    memory: SituationMemory, rng: np.random.Generator, stamp_s: float, likeness: Likeness, n: int
) -> None:
    """One more."""
    memory.see(stamp_s, rng.normal(size=n), rng.normal(size=likeness.size))


def late_ms(turns: int) -> FloatArray:
    """By how much so many turns of a millisecond were late [ms]."""
    late = np.empty(turns)
    for k in range(turns):
        began_s = time.perf_counter()
        time.sleep(TURN_S)
        late[k] = (time.perf_counter() - began_s - TURN_S) * 1e3
    return late


def told(name: str, late: FloatArray) -> str:
    """A line."""
    p50, p99, p999 = np.percentile(late, [50, 99, 99.9])
    return f"{name}: p50 {p50:.2f}, p99 {p99:.2f}, p99.9 {p999:.2f}, most {late.max():.1f} ms"


def main() -> None:
    """Print what a turn costs, with and without a save."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--situations", type=int, default=200_000)
    parser.add_argument("--saves", type=int, default=10)
    args = parser.parse_args()
    sys.setswitchinterval(SWITCH_S)
    with tempfile.TemporaryDirectory() as folder:
        site = bench_site(Path(folder))
        memory = remembering(site, args.situations)
        likeness = Likeness(np.array([a.max_velocity for a in site.guard.actuators]))
        rng, n = np.random.default_rng(2), len(site.guard.actuators)
        keeper = SituationKeeper(site, bench_limits(site), Sayer("benchmark"))
        keeper.begin(Path(folder) / "model.npz", memory, 0.0)
        quiet, busy, given, saves_s = late_ms(3000), [], [], []
        stamp_s = 1e6
        for _ in range(args.saves):
            stamp_s += NODE_S
            see(memory, rng, stamp_s, likeness, n)
            began_s = time.perf_counter()
            size = keeper.save()
            given.append((time.perf_counter() - began_s) * 1e3)
            saver = keeper._saver
            assert saver is not None
            while saver._saved != saver.taken:
                busy.append(late_ms(1))
            saves_s.append(time.perf_counter() - began_s)
            assert saver.problem is None, saver.problem
        keeper.close(10.0)
    print(
        f"{memory.count} situations, {size / 1e6:.0f} MB; a save takes {np.median(saves_s):.2f} s,"
        f" handing it over {max(given):.2f} ms"
    )
    print(told("turns without a save", quiet))
    print(told("turns during a save ", np.concatenate(busy)))


if __name__ == "__main__":
    main()
