"""The simulated machine and operator on a site's keys, in a process of its own.

``python -m rampe_guard.simulate.process --connect ENDPOINT --cycles 8 --seed 1``
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain

from rampe_guard.client import CommandShaper
from rampe_guard.collision import load_arm
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import RampeGuardError
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.player import Frame, Player
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, Inbox
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.quarry import START, quarry_operator
from rampe_guard.simulate.run import Tick, simulate

RATE_HZ = 100.0


def quarry_work(
    site: Site,
    cycles: int | None,
    seed: int,
    rate_hz: float = RATE_HZ,
    shape: Callable[[FloatArray], FloatArray] | None = None,
) -> Iterator[Tick]:
    """The demo quarry's operator at work on the site's machine.

    Args:
        site: of the demo.
        cycles: of his work; None: without end.
        seed: of his day.
        rate_hz: of both signals.
        shape: what the machine makes of a command.
    """
    limits = load_arm(site.arm).limits
    return simulate(
        site.guard.actuators,
        quarry_operator(site.guard.actuators, seed),
        build_machine(site.guard.actuators, limits),
        START,
        rate_hz=rate_hz,
        cycles=cycles,
        seed=seed,
        shape=shape,
    )


def perform(
    site: Site,
    work: Callable[[], Iterator[Tick]],
    stop: StopFlag,
    say: Sayer,
    listen: Callable[[Bus], None] | None = None,
) -> bool:
    """Do some work on the keys of a site, from when its guard is there, stamped when sent.

    Args:
        site: where.
        work: begins it; its machine is loaded before time counts.
        stop: ends it.
        say: log.
        listen: told of the session before anything is sent.

    Returns:
        Whether it got as far as having a session.
    """
    frames = _frames(work)
    first = stop.unless_stopped(lambda: next(frames))
    if first is None:
        return False
    bus = Bus.open_retrying(site.zenoh, stop, say.info, stop.wait)
    if bus is None:
        return False
    with bus:
        if listen is not None:
            listen(bus)
        player = Player(bus, site)
        if player.wait_for_guard(stop):
            say.info(f"{site.machine} is at work")
            player.play(chain([first], frames), stop)
        return True


def _frames(work: Callable[[], Iterator[Tick]]) -> Iterator[Frame]:
    for tick in work():
        yield Frame(tick.time_s, None, tick.axes, tick.position, tick.velocity)


class Obeying:
    """A machine that follows the advice on its key: what it makes of a command.

    Without fresh advice it stands, since that is not the same as free.
    """

    def __init__(self, site: Site) -> None:
        self._key = f"{site.keys.base}/advice"
        self._shaper = CommandShaper(site.actuator_names)
        self._inbox: Inbox | None = None

    def listen(self, bus: Bus) -> None:
        """Hear of advice from now on."""
        self._inbox = bus.inbox(self._key)

    def __call__(self, command: FloatArray) -> FloatArray:
        """The command (n,), no larger than advised now."""
        now_s = time.time()  # the clock of the stamps
        if self._inbox is not None:
            for message in self._inbox.drain():
                self._shaper.take(message.payload, now_s)
        return self._shaper.shape(command, now_s)


def main() -> int:
    """Run until the cycles are done or told to stop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--site", default=str(shipped_site("demo")))
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--cycles", type=int, default=None)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=RATE_HZ)
    parser.add_argument("--obey", action="store_true", help="follow the guard's speed advice")
    args = parser.parse_args()
    stop = StopFlag.on_signals()
    say = Sayer("rampe_guard.simulate")
    try:
        site = connect_to(load_site(args.site), args.connect)
        obeying = Obeying(site) if args.obey else None
        listen = None if obeying is None else obeying.listen
        begin = partial(quarry_work, site, args.cycles, args.seed, args.rate, obeying)
        if perform(site, begin, stop, say, listen):
            print("done", flush=True)  # noqa: T201 - whoever started this waits for it
    except RampeGuardError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
