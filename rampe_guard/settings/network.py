"""Which Zenoh endpoints stay on this machine, which are proven by certificates, and which neither.

An endpoint is ``PROTOCOL/ADDRESS[?METADATA][#CONFIGURATION]``. Its ends may hold secrets, such as
a private key, so no message shows more of it than `shown`.
"""

from __future__ import annotations

import ipaddress
import re
from typing import Final
from urllib.parse import urlsplit

PLAIN_NETWORK: Final = "i accept that anyone on this network can read and forge messages"
"""What a site file has to say before plain messages leave the machine."""
PROVEN: Final = ("tls", "quic")
"""Protocols whose far end shows a certificate."""
LOCAL: Final = ("unixsock-stream", "unixpipe")
"""Protocols that cannot leave the machine."""

_WITH_PORT: Final = ("tcp", "udp", "ws", *PROVEN)
_HIGHEST_PORT: Final = 65535
_HOST = re.compile(r"\[[^\[\]]+\]|[^\[\]:]+")
_UNVERIFIED = re.compile(r"[#;]verify_name_on_connect=(?!true(?:;|$))")
_USER = re.compile(r"(?<=/)[^/@]*@")


def shown(endpoint: str) -> str:
    """An endpoint without what may be secret in it."""
    bare = re.split("[?#]", endpoint, maxsplit=1)
    return _USER.sub("…@", bare[0]) + ("…" if len(bare) > 1 else "")


def redacted(text: str, endpoints: tuple[str, ...]) -> str:
    """A message of somebody else's, with every endpoint in it as `shown`."""
    for endpoint in sorted(endpoints, key=len, reverse=True):
        text = text.replace(endpoint, shown(endpoint))
    return text


def protocol(endpoint: str) -> str:
    """What is spoken there."""
    return endpoint.partition("/")[0]


def stays_here(endpoint: str) -> bool:
    """Whether it is on this machine for certain. Names other than localhost may be anywhere."""
    if protocol(endpoint) in LOCAL:
        return True
    address = re.split("[?#]", endpoint.partition("/")[2], maxsplit=1)[0]
    host = address.rpartition(":")[0]
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.removeprefix("[").removesuffix("]")).is_loopback
    except ValueError:
        return False


def is_loopback(host: str) -> bool:
    """Whether this name or address is this machine itself for certain."""
    return stays_here(f"tcp/[{host}]:0" if ":" in host else f"tcp/{host}:0")


def host_of(header: str | None) -> str | None:
    """The name or address in an HTTP Host header, without port and brackets; None if none is."""
    try:
        name = urlsplit(f"//{header or ''}").hostname
        if name and ":" in name:
            return str(ipaddress.ip_address(name))
    except ValueError:
        return None
    return name


def impossible(endpoint: str) -> str | None:
    """Why nobody could ever be met at this endpoint, as far as it shows; None if it does not."""
    if protocol(endpoint) not in _WITH_PORT:
        return None
    address = re.split("[?#]", endpoint.partition("/")[2], maxsplit=1)[0]
    host, _, port = address.rpartition(":")
    if _HOST.fullmatch(host) is None or not (port.isascii() and port.isdigit()):
        return "names no HOST:PORT"
    if len(port) > len(str(_HIGHEST_PORT)) or not 0 < int(port) <= _HIGHEST_PORT:
        return f"has no port from 1 to {_HIGHEST_PORT}"
    return None


def brings_authority(endpoint: str) -> bool:
    """Whether it names by itself the authority that its router is proven by."""
    return "root_ca_certificate" in endpoint.partition("#")[2]


def exposed(endpoint: str, *, verifies_names: bool = True) -> str | None:
    """Why messages to this endpoint could be read or forged on their way; None if they cannot.

    Args:
        endpoint: that is connected to.
        verifies_names: whether the name in the certificate must be that of the endpoint.
    """
    if stays_here(endpoint):
        return None
    if protocol(endpoint) not in PROVEN:
        return f"{shown(endpoint)} is plain, and not on this machine"
    if not verifies_names or _UNVERIFIED.search(endpoint):
        return f"{shown(endpoint)} may show anybody's certificate (verify_name_on_connect: false)"
    return None
