"""rampe-guard: collision early warning for machines that a person drives.

The public API, small and typed; the command line is a thin layer over it::

    site = rampe_guard.load_site("config/sites/demo.yaml")
    result = rampe_guard.Sweeper(site).sweep(start, displacement)
    model = rampe_guard.Rampe(actuators=2, mode="faithful", n_init=3)
    guard = rampe_guard.Guard(site)
    events = guard.step(rampe_guard.Inputs(joystick=..., actuators=...), now_s=12.34)
    with rampe_guard.client.Alerts("tcp/127.0.0.1:7447", "rampe/*/*/guard") as alerts: ...

Each name loads only what it needs.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rampe_guard import client
    from rampe_guard.assembly import Sweeper
    from rampe_guard.assembly import guard_for as Guard  # noqa: N812 - reads as a class in the API
    from rampe_guard.core.rampe import Rampe
    from rampe_guard.core.types import ActuatorSample, Inputs, JoystickSample, ObjectSample
    from rampe_guard.errors import RampeGuardError, SettingsError
    from rampe_guard.settings import Site, load_site

from rampe_guard.kernel_cache import choose_folder

__version__ = "0.1.0"

choose_folder()

_HOME = {
    "ActuatorSample": ("rampe_guard.core.types", "ActuatorSample"),
    "Guard": ("rampe_guard.assembly", "guard_for"),
    "Inputs": ("rampe_guard.core.types", "Inputs"),
    "JoystickSample": ("rampe_guard.core.types", "JoystickSample"),
    "ObjectSample": ("rampe_guard.core.types", "ObjectSample"),
    "Rampe": ("rampe_guard.core.rampe", "Rampe"),
    "RampeGuardError": ("rampe_guard.errors", "RampeGuardError"),
    "SettingsError": ("rampe_guard.errors", "SettingsError"),
    "Site": ("rampe_guard.settings", "Site"),
    "Sweeper": ("rampe_guard.assembly", "Sweeper"),
    "load_site": ("rampe_guard.settings", "load_site"),
}
__all__ = [
    "ActuatorSample",
    "Guard",
    "Inputs",
    "JoystickSample",
    "ObjectSample",
    "Rampe",
    "RampeGuardError",
    "SettingsError",
    "Site",
    "Sweeper",
    "client",
    "load_site",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name == "client":
        return import_module("rampe_guard.client")
    if name not in _HOME:
        raise AttributeError(f"module 'rampe_guard' has no attribute {name!r}")
    module, attribute = _HOME[name]
    return getattr(import_module(module), attribute)
