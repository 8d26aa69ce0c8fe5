"""The simulated machine and operator on a site's keys, in a process of its own.

``python -m rampe_guard.simulate.process --connect ENDPOINT --cycles 8 --seed 1``
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from rampe_guard.collision import load_arm
from rampe_guard.errors import RampeGuardError
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.player import Frame, Player
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.quarry import START, quarry_operator
from rampe_guard.simulate.run import simulate

RATE_HZ = 100.0


def frames(site: Site, cycles: int | None, seed: int, rate_hz: float) -> Iterator[Frame]:
    """The demo quarry's operator at work on the site's machine, stamped when sent."""
    limits = load_arm(site.arm).limits
    operator = quarry_operator(site.guard.actuators, seed)
    simulated = build_machine(site.guard.actuators, limits)
    ticks = simulate(
        site.guard.actuators,
        operator,
        simulated,
        START,
        rate_hz=rate_hz,
        cycles=cycles,
        seed=seed,
    )
    for tick in ticks:
        yield Frame(tick.time_s, None, tick.axes, tick.position, tick.velocity)


def main() -> int:
    """Run until the cycles are done or told to stop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--site", default=str(shipped_site("demo")))
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--cycles", type=int, default=None)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=RATE_HZ)
    args = parser.parse_args()
    stop = StopFlag.on_signals()
    say = Sayer("rampe_guard.simulate")
    try:
        site = connect_to(load_site(args.site), args.connect)
        work = frames(site, args.cycles, args.seed, args.rate)
        first = stop.unless_stopped(lambda: next(work))  # loads the machine before time counts
        if first is None:
            return 0
        bus = Bus.open_retrying(site.zenoh, stop, say.info, stop.wait)
        if bus is None:
            return 0
        with bus:
            player = Player(bus, site)
            if player.wait_for_guard(stop):
                player.play(_chain(first, work), stop)
            print("done", flush=True)  # noqa: T201 - whoever started this waits for it
    except RampeGuardError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2
    return 0


def _chain(first: Frame, rest: Iterator[Frame]) -> Iterator[Frame]:
    yield first
    yield from rest


if __name__ == "__main__":
    sys.exit(main())
