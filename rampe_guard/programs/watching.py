"""Commands of people who watch: ``watch``, ``ack`` and ``shelve``."""

from __future__ import annotations

import getpass
from collections.abc import Sequence

from rich.console import Console

from rampe_guard import wire
from rampe_guard.collision import load_arm
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site
from rampe_guard.view.observer import Observer
from rampe_guard.view.watch import watch


def watch_site(site_path: str, endpoints: Sequence[str], console: Console, stop: StopFlag) -> int:
    """Show a machine until told to stop; waits for a router if there is none."""
    site = connect_to(load_site(site_path), endpoints)
    arm = stop.unless_stopped(lambda: load_arm(site.arm))
    if arm is None:
        return 0
    bus = Bus.open_retrying(site.zenoh, stop, console.print, stop.wait)
    if bus is None:
        return 0
    with bus:
        watch(Observer(bus, site, arm.limits), stop, console)
    return 0


def acknowledge(site_path: str, endpoints: Sequence[str], alert_id: str, who: str | None) -> int:
    """Tell the guard that someone has seen an alert.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    site = connect_to(load_site(site_path), endpoints)
    with Bus.open(site.zenoh) as bus:
        ack = wire.Ack(alert_id=alert_id, who=who or getpass.getuser())
        if not bus.ask(f"{site.keys.base}/ack", wire.encode(ack)):
            raise ConnectionFailedError(f"no guard answers on {site.keys.base}/ack")
    return 0


def shelve(
    site_path: str, endpoints: Sequence[str], alert_id: str, who: str | None, duration_s: float
) -> int:
    """Ask the guard to keep an alert silent for a while [s]; 0 ends its silence.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    site = connect_to(load_site(site_path), endpoints)
    with Bus.open(site.zenoh) as bus:
        wish = wire.Shelve(alert_id=alert_id, who=who or getpass.getuser(), duration_s=duration_s)
        if not bus.ask(f"{site.keys.base}/shelve", wire.encode(wish)):
            raise ConnectionFailedError(f"no guard answers on {site.keys.base}/shelve")
    return 0
