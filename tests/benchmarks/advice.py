"""A machine that follows the advice: ``python -m tests.benchmarks.advice [--seeds 10]``.

The demo's operator works whole days offline, each twice: with free levers, and on a machine that
follows the guard's advice. Told are contacts (times the arm was in a zone's margin), time for a
cycle, how much of the time something was limited, how fast shares changed, and what a step costs
with advice and without.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass, field

import numpy as np
from rich.console import Console
from rich.table import Table

from rampe_guard.assembly import Machine, load_machine
from rampe_guard.core.events import AdviceEvent
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, JoystickSample
from rampe_guard.evaluate.referee import Referee
from rampe_guard.resources import shipped_site
from rampe_guard.settings import load_site
from rampe_guard.simulate.process import quarry_work

LOOK = 4
"""The referee looks at every so many-th position: it sweeps in between."""


@dataclass
class Day:
    """One day: what it was like."""

    seconds: float = 0.0
    contacts: int = 0
    steps_ms: list[float] = field(default_factory=list)
    shares: list[FloatArray] = field(default_factory=list)


def work(machine: Machine, seed: int, cycles: int, *, obey: bool) -> Day:
    """Whole cycles, on the clock of the simulation."""
    guard = machine.guard(0.0, "offline", advise=obey)
    n = len(machine.site.actuator_names)
    most = np.zeros((n, 2)) if obey else np.ones((n, 2))

    def shape(command: FloatArray) -> FloatArray:
        return np.clip(command, -most[:, 0], most[:, 1])

    referee, day = Referee(machine.sweeper), Day()
    for k, tick in enumerate(quarry_work(machine.site, cycles, seed, shape=shape)):
        now_s, q = tick.time_s, tick.position
        lever = JoystickSample(now_s, tick.axes, now_s)
        place = ActuatorSample(now_s, q, tick.velocity, now_s)
        began = time.perf_counter()
        events = guard.step(Inputs((lever,), (place,)), now_s)
        day.steps_ms.append(1e3 * (time.perf_counter() - began))
        for event in events:
            if isinstance(event, AdviceEvent) and event.advice is not None:
                most = event.advice.shares
                day.shares.append(most)
        if k % LOOK == 0:
            referee.feed(now_s, q)
        day.seconds = now_s
    day.contacts = len(referee.contacts)
    return day


def main() -> int:
    """Exit code 1 if an obedient machine came into contact."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=6)
    args = parser.parse_args()
    machine = load_machine(load_site(shipped_site("demo")))
    table = Table("seed", "contacts, free", "obeyed", "s a cycle, free", "obeyed", "more", box=None)
    pairs = []
    for seed in range(1, args.seeds + 1):
        free = work(machine, seed, args.cycles, obey=False)
        obeyed = work(machine, seed, args.cycles, obey=True)
        pairs.append((free, obeyed))
        seconds = [day.seconds / args.cycles for day in (free, obeyed)]
        more = f"{100 * (seconds[1] / seconds[0] - 1):+.1f} %"
        words = (seed, free.contacts, obeyed.contacts, *(f"{s:.2f}" for s in seconds), more)
        table.add_row(*map(str, words))
    console = Console(width=100)
    console.print(table)
    contacts = [sum(pair[i].contacts for pair in pairs) for i in (0, 1)]
    spent = [sum(pair[i].seconds for pair in pairs) for i in (0, 1)]
    changes = np.concatenate(
        [np.abs(np.diff(day.shares, axis=0)).max(axis=(1, 2)) for _, day in pairs]
    )
    limited = np.concatenate([np.min(day.shares, axis=(1, 2)) < 1.0 for _, day in pairs])
    console.print(f"contacts {contacts[0]} with free levers, {contacts[1]} obeyed;", end=" ")
    console.print(f"{100 * (spent[1] / spent[0] - 1):+.1f} % time a cycle")
    console.print(f"something limited {100 * limited.mean():.0f} % of the time;", end=" ")
    console.print(
        f"from one advice to the next by more than 0.3: {100 * (changes > 0.3).mean():.2f} %"
    )
    for i, name in ((0, "without advice"), (1, "with advice")):
        times = [ms for pair in pairs for ms in pair[i].steps_ms]
        p99 = statistics.quantiles(times, n=100)[-1]
        console.print(f"a step {name}: {statistics.median(times):.2f} ms, p99 {p99:.1f} ms")
    return 1 if contacts[1] else 0


if __name__ == "__main__":
    sys.exit(main())
