"""``rampe-guard watch SITE``: one machine in detail."""

from __future__ import annotations

from rich.console import Console

from rampe_guard.collision import load_arm
from rampe_guard.errors import SettingsError
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site
from rampe_guard.view.observer import Observer
from rampe_guard.view.watch import watch


def watch_one(
    site_path: str, network: Network, console: Console, stop: StopFlag, *, bell: bool
) -> int:
    """Show a machine until told to stop; waits for a router if there is none.

    Raises:
        SettingsError: the site file is not valid, or there is no terminal to ring.
    """
    if bell and not console.is_terminal:
        raise SettingsError("--bell rings a terminal's bell, and the output is no terminal")
    site = network.of(load_site(site_path))
    arm = stop.unless_stopped(lambda: load_arm(site.arm))
    if arm is None:
        return 0
    bus = Bus.open_retrying(site.zenoh, stop, console.print, stop.wait)
    if bus is None:
        return 0
    with bus:
        watch(Observer(bus, site, arm.limits), stop, console, bell=bell)
    return 0
