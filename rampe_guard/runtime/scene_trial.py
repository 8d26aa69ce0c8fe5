"""``python -m rampe_guard.runtime.scene_trial SITE < TEXT``: can a guard sweep against this scene?

In a process of its own, since a mesh may take long to wrap, or bring native code down with it. What
was wrapped is kept in the cache of shapes, where the guard finds it. Exit code 0, or 2 with what
is wrong on stderr.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Final

from rampe_guard.assembly import load_machine
from rampe_guard.errors import GeometryError, RampeGuardError
from rampe_guard.settings import load_scene_text, load_site

LONGEST_S: Final = 300.0
"""A scene that takes longer to build is refused."""
_NICE: Final = ("nice", "-n", "10")


def try_scene(site_path: str, text: str) -> None:
    """Build the scene elsewhere.

    Raises:
        GeometryError: with what is wrong with it.
    """
    command = (*_NICE, sys.executable, "-m", __name__, site_path)
    try:
        done = subprocess.run(  # noqa: S603 - our own command line
            command,
            input=text,
            capture_output=True,
            encoding="utf-8",
            timeout=LONGEST_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise GeometryError(f"the scene was not built within {LONGEST_S:g} s") from None
    if done.returncode:
        words = done.stderr.strip() if done.returncode == _REFUSED else ""
        raise GeometryError(words or f"building the scene ended with code {done.returncode}")


_REFUSED: Final = 2


def main() -> int:
    """Build it here."""
    try:
        site = load_site(sys.argv[1])
        load_machine(replace(site, scene=load_scene_text(sys.stdin.read(), site)))
    except RampeGuardError as error:
        print(error, file=sys.stderr)  # noqa: T201 - whoever started it reads it
        return _REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main())
