"""What people who watch say to a guard: ``ack``, ``shelve`` and ``model reset --running``."""

from __future__ import annotations

import getpass
from collections.abc import Sequence

from rampe_guard import wire
from rampe_guard.client.order import Order, give
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site


def acknowledge(site_path: str, endpoints: Sequence[str], alert_id: str, who: str | None) -> int:
    """Tell the guard that someone has seen an alert.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    return _ask(site_path, endpoints, wire.Ack(alert_id=alert_id, who=who or getpass.getuser()))


def shelve(
    site_path: str, endpoints: Sequence[str], alert_id: str, who: str | None, duration_s: float
) -> int:
    """Ask the guard to keep an alert silent for a while [s]; 0 ends its silence.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    who = who or getpass.getuser()
    wish = wire.Shelve(alert_id=alert_id, who=who, duration_s=duration_s)
    return _ask(site_path, endpoints, wish)


def forget(site_path: str, endpoints: Sequence[str], operator: str | None, who: str | None) -> str:
    """Have the guard that runs forget all that it learned of its operator; says what that was.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    site = connect_to(load_site(site_path), endpoints)
    wish = wire.Forget(operator=operator or site.operator, who=who or getpass.getuser())
    with Bus.open(site.zenoh) as bus:
        told = wire.decode(give(bus, site.keys.base, wish), wire.Forgotten)
    return (
        f"forgotten: operator {told.operator!r} on {told.machine} at {told.site};"
        f" {told.primitives} primitives, {told.situations} situations"
    )


def _ask(site_path: str, endpoints: Sequence[str], order: Order) -> int:
    site = connect_to(load_site(site_path), endpoints)
    with Bus.open(site.zenoh) as bus:
        give(bus, site.keys.base, order)
    return 0
