"""What the extra ``rampe-guard[eval]`` brings, and what is said where it is missing."""

from __future__ import annotations

from rampe_guard.errors import RampeGuardError


def missing(error: ImportError) -> RampeGuardError:
    """The error for a user without the extra."""
    return RampeGuardError(
        f"this needs {error.name}, which is not installed: pip install 'rampe-guard[eval]'"
    )
