"""Errors that rampe-guard raises on purpose.

::

    RampeGuardError
    ├── SettingsError        a site or scene file: file, line, key, value, what to do
    ├── GeometryError        a URDF, mesh or linkage that cannot be used: file and reason
    ├── MessageError         a message that breaks the contract: key and reason
    ├── LogError             a recording that cannot be replayed: file, line, column
    ├── ModelFileError       kept models that cannot be read, written or found: file and reason
    ├── InterruptedReplayError  a replay was stopped before its end: no score
    ├── RefusedError         a request that the guard will not grant: what and why
    └── ConnectionFailedError  no router answered, or the session was refused

Each is printed to a user as one message without a traceback, and ends a command with exit
code 2. Anything else that escapes is a bug and keeps its traceback.
"""

from __future__ import annotations


class RampeGuardError(Exception):
    """Base of every error that a user can cause and mend."""

    @property
    def lines(self) -> tuple[str, ...]:
        """The message line by line; what else ends a line in it is part of a name or a value."""
        return (str(self),)


class _LinesError(RampeGuardError):
    """One of several lines.

    Args:
        problems: each is a line.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__("\n".join(problems))
        self._problems = problems

    def __reduce__(self) -> tuple[type[_LinesError], tuple[str, ...]]:
        """From one process to another it keeps its lines."""
        return type(self), self._problems

    @property
    def lines(self) -> tuple[str, ...]:
        """The problems."""
        return self._problems


class SettingsError(_LinesError):
    """A site or scene file is wrong; the message names file, line, key, value and remedy."""


class GeometryError(RampeGuardError):
    """A URDF, mesh or linkage cannot be used; the message names the file and the reason."""


class MessageError(RampeGuardError):
    """A message breaks the contract; the message names the field and the reason.

    Attributes:
        reason: one of a small set of words, fit for a counter (e.g. ``"bad_json"``).
    """

    def __init__(self, reason: str, detail: str) -> None:
        self.reason = reason
        super().__init__(f"{reason}: {detail}")


class LogError(_LinesError):
    """A recording cannot be replayed; the message names file, line or column, and why."""


class ModelFileError(RampeGuardError):
    """A kept model cannot be read, written or found; the message names the file and why."""


class InterruptedReplayError(RampeGuardError):
    """A replay was stopped before its end; half a replay has no score."""


class RefusedError(RampeGuardError):
    """A request that the guard will not grant; the message says why, with the limit it broke."""


class ConnectionFailedError(RampeGuardError):
    """No router answered, or the session was refused; the message names the endpoints."""
