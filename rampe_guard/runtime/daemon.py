"""``rampe-guard run``: load, connect (for as long as it takes), work, end cleanly."""

from __future__ import annotations

from collections.abc import Sequence

from rampe_guard.assembly import load_machine
from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.worker import Worker
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import for_operator, load_site


def run(
    site_path: str, endpoints: Sequence[str], stop: StopFlag, operator: str | None = None
) -> int:
    """Guard a machine until told to stop.

    Args:
        site_path: the site file.
        endpoints: Zenoh endpoints instead of the site file's.
        stop: ends it.
        operator: who is at the levers, instead of whom the site file names.

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
    machine = stop.unless_stopped(lambda: load_machine(site))
    if machine is None:
        return 0
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
            worker = Worker(machine, bus, say, keeper)
            say.info(f"guarding on {site.keys.base}")
            worker.run(stop, stop.wait)
    say.info("stopped")
    return 0
