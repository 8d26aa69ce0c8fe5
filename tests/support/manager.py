"""Listens for the words of a service, as systemd does."""

from __future__ import annotations

import socket


class Manager:
    """A datagram socket at a path, or in the abstract name space (``@…``)."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.settimeout(0.0)
        self._socket.bind(address.replace("@", "\0", 1))

    def heard(self) -> list[str]:
        """What came since the last call; never waits."""
        words = []
        while True:
            try:
                words.append(self._socket.recv(4096).decode())
            except BlockingIOError:
                return words

    def close(self) -> None:
        self._socket.close()
