"""The folder that a command writes its results into."""

from __future__ import annotations

import os
from pathlib import Path

from rampe_guard.errors import RampeGuardError


def output_folder(out: str | Path) -> Path:
    """Make the folder ``out`` if it is not there, and see that it can be written into.

    Raises:
        RampeGuardError: it cannot be made or written into.
    """
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RampeGuardError(f"cannot make the folder {out}: {error.strerror}") from error
    if not os.access(folder, os.W_OK):  # now, and not after minutes of work
        raise RampeGuardError(f"cannot write into the folder {out}; choose another with --out")
    return folder
