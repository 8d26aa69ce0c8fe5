"""No session over a network that anybody can listen and speak on, unless the site says so.

What is judged is the whole configuration that Zenoh will use, wherever it comes from. With no
plain endpoint in it Zenoh is held to the protocols that prove themselves, so that whoever is found
by scouting or gossip must show a certificate as well.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.certificates import check_private
from rampe_guard.settings.network import (
    LOCAL,
    PLAIN_NETWORK,
    PROVEN,
    exposed,
    protocol,
    shown,
    stays_here,
)

_REMEDY = (
    "use tls/ endpoints with zenoh.tls (or a Zenoh configuration file with certificates), or write"
    f' into the site file: zenoh: {{plain_network: "{PLAIN_NETWORK}"}}'
    " (commands without a site file: --plain-network)"
)


def check_exposure(get: Callable[[str], str]) -> None:
    """Refuse a configuration whose messages could be read or forged beyond this machine.

    Args:
        get: JSON text of a part of Zenoh's configuration, by its path.

    Raises:
        SettingsError: naming the endpoint or the setting, and both ways out.
    """
    for reason in _exposures(get):
        raise SettingsError(f"zenoh: {reason}: anyone there could read and forge; {_REMEDY}")


def allowed_protocols(get: Callable[[str], str]) -> tuple[str, ...]:
    """What the session may speak, for ``transport/link/protocols``; () where it is left alone."""
    ends = (*endpoints(get, "connect"), *endpoints(get, "listen"))
    wanted = json.loads(get("transport/link/protocols") or "null")
    if not ends or any(protocol(end) not in (*PROVEN, *LOCAL) for end in ends):
        return ()
    return tuple(word for word in (*PROVEN, *LOCAL) if not wanted or word in wanted)


def endpoints(get: Callable[[str], str], side: str) -> tuple[str, ...]:
    """Endpoints of the session's own mode.

    Args:
        get: as in `check_exposure`.
        side: "connect" or "listen".
    """
    found = json.loads(get(f"{side}/endpoints") or "null")
    mode = json.loads(get("mode") or "null") or "peer"
    if isinstance(found, dict) and not {"strategy", "locators"} & found.keys():
        found = found.get(mode)
    return tuple(_texts(found))


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        if "/" in value:  # else it is the name of a strategy
            yield value
    elif isinstance(value, list):
        for item in value:
            yield from _texts(item)
    elif isinstance(value, dict):
        yield from _texts(list(value.values()))


def check_keys(get: Callable[[str], str]) -> None:
    """Refuse private keys that others may read.

    Args:
        get: as in `check_exposure`.

    Raises:
        SettingsError: naming the file and what to do.
    """
    tls = json.loads(get("transport/link/tls") or "null") or {}
    for name in ("connect_private_key", "listen_private_key"):
        if isinstance(file := tls.get(name), str):
            check_private(file)


def _exposures(get: Callable[[str], str]) -> Iterator[str]:
    tls = json.loads(get("transport/link/tls") or "null") or {}
    named = tls.get("verify_name_on_connect") is not False
    for end in endpoints(get, "connect"):
        reason = exposed(end, verifies_names=named)
        if reason is not None:
            yield reason
    for end in endpoints(get, "listen"):
        if stays_here(end):
            continue
        if protocol(end) not in PROVEN:
            yield f"listens on {shown(end)}, plain, for other machines"
        elif tls.get("enable_mtls") is not True:
            yield f"listens on {shown(end)} and asks nobody for a certificate (enable_mtls)"
    if not allowed_protocols(get):
        yield from _found_by_itself(get)


def _found_by_itself(get: Callable[[str], str]) -> Iterator[str]:
    """How the session would join those whom nobody named, on any protocol."""
    scouting = json.loads(get("scouting") or "null") or {}
    client = json.loads(get("mode") or "null") == "client"
    on = {
        name
        for name in ("multicast", "gossip")
        if (scouting.get(name) or {}).get("enabled", True) is not False
    }
    if "multicast" in on and not (client and endpoints(get, "connect")):
        yield "scouting/multicast joins whoever answers on the network"
    if "gossip" in on and not client:
        yield "scouting/gossip joins whomever others name"
