"""Folders in which files must lie, so that one file cannot make us read any other on the machine.

Site, scene and URDF name further files, and come from whoever wrote them. What lies outside the
folder of the site file is read only if the site file allows its folder in words.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Self


@dataclass(frozen=True, slots=True)
class Folders:
    """Where files may be read.

    Attributes:
        paths: absolute, symbolic links resolved; first the one that relative paths start from.
    """

    paths: tuple[str, ...]

    @classmethod
    def of(cls, home: str | Path, allowed: tuple[str, ...] = ()) -> Self:
        """``home`` and what it allows beside itself, relative to it."""
        start = Path(home)
        return cls(tuple(str((start / folder).resolve()) for folder in ("", *allowed)))

    def hold(self, file: str | Path) -> bool:
        """Whether ``file`` lies in one of them, however it is written and through any link.

        Raises:
            OSError: its links lead round in circles.
            ValueError: it has a NUL.
        """
        real = _real(file)
        return any(real.is_relative_to(folder) for folder in self.paths)

    def refusal(self, file: str | Path) -> tuple[str, str]:
        """What is wrong with a file that they do not hold, and what to do."""
        real = _real(file)
        home = self.paths[0]
        wanted = os.path.relpath(real.parent, home)
        also = f" and the {len(self.paths) - 1} that it allows" if len(self.paths) > 1 else ""
        return (
            f"leads to {str(real)!r}, outside the site's folder {home!r}{also}",
            f"move it there, or write into the site file: files: {{allow: [{wanted!r}]}}",
        )


def _real(file: str | Path) -> Path:
    try:
        return Path(file).resolve()
    except RuntimeError as error:  # Python 3.11 and 3.12 say so of a loop of links
        raise OSError(str(error)) from None
