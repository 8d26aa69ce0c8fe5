"""``rampe-guard run``: load, connect (for as long as it takes), work, end cleanly.

Before anything is guarded the canary is tried once, which also compiles or loads the kernels of
the sweep. A guard whose canary fails tells so for a while and ends with `UNTRUSTED`: a machine
that computes wrongly is not to be trusted again until its process has started anew.
"""

from __future__ import annotations

from collections.abc import Sequence

from rampe_guard.assembly import Machine
from rampe_guard.collision.canary import Canary
from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.runtime.canary_watch import CanaryWatch
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.supervisor import UNTRUSTED, restarted_after
from rampe_guard.runtime.worker import Worker
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, for_operator, load_site


def run(
    site_path: str, endpoints: Sequence[str], stop: StopFlag, operator: str | None = None
) -> int:
    """Guard a machine until told to stop.

    Args:
        site_path: the site file.
        endpoints: Zenoh endpoints instead of the site file's.
        stop: ends it.
        operator: who is at the levers, instead of whom the site file names.

    Returns:
        The exit code: 0, or `UNTRUSTED` if the canary failed.

    Raises:
        SettingsError: the site file is wrong.
        GeometryError: its geometry cannot be used.
    """
    say = Sayer("rampe_guard")
    site = for_operator(connect_to(load_site(site_path), endpoints), operator)
    if site.format != "json":
        raise SettingsError(
            f"{site.path}: format: {site.format!r} is not supported by this version; use json"
        )
    loaded = stop.unless_stopped(lambda: _load(site, say))
    if loaded is None:
        return 0
    machine, canary = loaded
    say.info(f"{site.machine} at {site.name}: {len(machine.sweeper.zones)} zones loaded")
    bus = Bus.open_retrying(site.zenoh, stop, lambda text: say.warn("connect", text), stop.wait)
    if bus is None:
        return 0
    with bus:
        if bus.is_alive(f"{site.keys.base}/alive"):
            raise ConnectionFailedError(
                f"another guard already publishes under {site.keys.base}; stop it, or give this"
                " machine a base key of its own"
            )
        with Keeper(site, machine.arm.limits, say) as keeper:
            worker = Worker(machine, bus, say, keeper, CanaryWatch(canary), restarted_after())
            say.info(f"guarding on {site.keys.base}")
            untrusted = worker.run(stop, stop.wait)
    say.info("ended: the canary failed" if untrusted else "stopped")
    return UNTRUSTED if untrusted else 0


def _load(site: Site, say: Sayer) -> tuple[Machine, Canary]:
    """Machine and canary, tried once: the worker tries it again before its first step."""
    machine = load_telling(site, say.info)
    for note in machine.sweeper.notes:
        say.info(note)
    canary = Canary(machine.arm, site.sweep)
    canary.check()
    return machine, canary
