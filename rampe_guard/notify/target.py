"""What every target can do, and how it says that it could not."""

from __future__ import annotations

from typing import Protocol

from rampe_guard.notify.choose import Notice


class NotHeardError(Exception):
    """A target was not told; the message says why. Never leaves this package."""


class Target(Protocol):
    """Somewhere that notices are carried to."""

    @property
    def name(self) -> str:
        """For people."""

    def tell(self, notice: Notice) -> None:
        """Carry it there, or raise NotHeardError, within the time-out.

        Raises:
            NotHeardError: it was not told.
        """

    def stop(self) -> None:
        """Break off what `tell` does in another thread."""
