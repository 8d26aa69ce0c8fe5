"""What people who watch say to a guard: ``ack`` and ``shelve``."""

from __future__ import annotations

import getpass
from collections.abc import Sequence

from rampe_guard import wire
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site


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
