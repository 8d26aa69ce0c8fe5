"""Whoever minds a guard's process: its supervisor, and systemd if it runs under it."""

from __future__ import annotations

from rampe_guard.runtime.systemd import Watchdog
from rampe_guard.runtime.turning import Turning


class Minders:
    """What they are told. No method ever waits or raises."""

    def __init__(self) -> None:
        self._systemd, self._supervisor = Watchdog(), Turning()
        self._ready = False

    def waiting(self, text: str) -> None:
        """What the guard waits for before it guards."""
        self._systemd.status(text)

    def turn(self, now_s: float) -> None:
        """The worker loop turns; called at each turn.

        Args:
            now_s: monotonic time [s].
        """
        self._systemd.feed(now_s)
        self._supervisor.feed(now_s)

    def status(self, text: str) -> None:
        """The status of the guard, which guards: the first word of it says that it is ready."""
        if not self._ready:
            self._ready = True
            self._systemd.ready()
        self._systemd.status(text)

    def ending(self) -> None:
        """The worker loop has ended."""
        self._supervisor.end()
        self._systemd.stopping()
        self._systemd.close()
