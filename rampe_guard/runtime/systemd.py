"""Words to a service manager: ready, what the status is, and that the worker loop still turns.

The protocol of ``sd_notify(3)``: lines in a datagram to the socket that ``$NOTIFY_SOCKET`` names.
Whoever is not run by systemd has no such variable, and every word then goes nowhere. Words come
from the guard's own process, which is not the unit's main process (that is its supervisor): the
unit needs ``NotifyAccess=all``.
"""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Mapping
from pathlib import Path

MAX_STATUS = 200
"""Characters of a status text."""
_FEEDS = 4
"""Within the time that the service manager waits."""
_LONGEST_PERIOD_S = 1.0


class Watchdog:
    """Tells systemd, if it listens. No method ever waits or raises.

    Args:
        environment: ``NOTIFY_SOCKET``, and ``WATCHDOG_USEC`` if a watchdog waits [µs].
    """

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        told = os.environ if environment is None else environment
        self._address = _address(told.get("NOTIFY_SOCKET", ""))
        self._socket: socket.socket | None = None
        if self._address is not None:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.settimeout(0.0)  # never waits
        self.period_s = _period_s(told.get("WATCHDOG_USEC", ""))
        self._fed_s = float("-inf")
        self._status: str | None = None

    def ready(self) -> None:
        """The guard guards."""
        self._tell("READY=1")

    def status(self, text: str) -> None:
        """What ``systemctl status`` is to show; told when it changes."""
        line = "".join(c if c.isprintable() else " " for c in text[:MAX_STATUS])
        if line != self._status:
            self._status = line
            self._tell(f"STATUS={line}")

    def feed(self, now_s: float) -> None:
        """The worker loop turns; called at each turn, told a few times within what is asked.

        Args:
            now_s: monotonic time [s].
        """
        if self.period_s is not None and now_s - self._fed_s >= self.period_s:
            self._fed_s = now_s
            self._tell("WATCHDOG=1")

    def stopping(self) -> None:
        """The guard ends."""
        self._tell("STOPPING=1")

    def close(self) -> None:
        """Say nothing any more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _tell(self, line: str) -> None:
        if self._socket is None or self._address is None:
            return
        # a full or vanished socket must not stop a guard; systemd then misses us, and acts
        with contextlib.suppress(OSError):
            self._socket.sendto(line.encode(), self._address)


def _address(text: str) -> str | None:
    """The address of the socket; one in the abstract name space is written with an @."""
    if text.startswith("@") and len(text) > 1:
        return f"\0{text[1:]}"
    return text if text and Path(text).is_absolute() else None


def _period_s(text: str) -> float | None:
    """How often to feed [s]; ``WATCHDOG_PID`` names the supervisor, so it is not asked."""
    try:
        timeout_s = int(text) * 1e-6
    except ValueError:
        return None
    return min(timeout_s / _FEEDS, _LONGEST_PERIOD_S) if timeout_s > 0.0 else None
