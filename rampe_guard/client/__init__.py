"""For those who build on the guard's alerts: who is guarded, what is raised, what was lost.

::

    with rampe_guard.client.Alerts("tcp/127.0.0.1:7447", "rampe/*/*/guard") as alerts:
        for item in alerts:
            print(item.machine, item.level, item.text)

`fleet` is the pure part (messages and time → `MachineState` and items), `feed` drains Zenoh into
it, `stream` does so in a thread; `Alerts` and `AsyncAlerts` are its two faces. `CommandShaper`
is for machine controllers that follow the speed advice.
"""

from rampe_guard.client.advice import CommandShaper
from rampe_guard.client.alerts import Alerts
from rampe_guard.client.async_alerts import AsyncAlerts
from rampe_guard.client.items import (
    Alert,
    GuardRestarted,
    Item,
    MessagesLost,
    Protection,
    ProtectionBack,
    ProtectionLost,
)
from rampe_guard.client.machine import MachineState

__all__ = [
    "Alert",
    "Alerts",
    "AsyncAlerts",
    "CommandShaper",
    "GuardRestarted",
    "Item",
    "MachineState",
    "MessagesLost",
    "Protection",
    "ProtectionBack",
    "ProtectionLost",
]
