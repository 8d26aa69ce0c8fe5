"""Loading a machine with a word on what takes long: kernels compiled, meshes wrapped."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from rampe_guard import kernel_cache
from rampe_guard.assembly import Machine, load_machine
from rampe_guard.settings import Site

COMPILING = "compiling the sweep, once on this machine (about a minute)"
FLICKER_S = 0.2
"""What is done sooner is not worth a line on a terminal."""
LONG_S = 2.0
"""What takes longer is worth a line in a log."""
_PERIOD_S = 0.1
_CLEAR = "\r\x1b[K"


class BuildLine:
    """Says how far the shapes of meshes are; called as `Progress`.

    On a terminal it is one line, overwritten and in the end cleared. Elsewhere it is one line
    for each mesh that takes long.
    """

    def __init__(
        self,
        out: TextIO,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Write to ``out`` if it is a terminal, else call ``say`` with a sentence."""
        self._out, self._say, self._clock = out, say, clock
        self._terminal = out.isatty()
        self._began_s: float | None = None
        self._shown_s: float | None = None

    def __call__(self, what: str, share: float) -> None:
        """Take that ``what`` is done, and which ``share`` of its mesh, from 0 to 1."""
        now_s = self._clock()
        if share >= 1.0:
            self.clear()
            return
        if self._began_s is None:
            self._began_s = now_s
        since_s = now_s - self._began_s
        text = f"{what}: {share:.0%}".replace("%", " %")
        if not self._terminal:
            if since_s > LONG_S and self._shown_s is None:
                self._shown_s = now_s
                self._say(f"{text}; a mesh that was wrapped is kept for the next start")
        elif since_s > FLICKER_S and (self._shown_s is None or now_s - self._shown_s >= _PERIOD_S):
            self._shown_s = now_s
            self._out.write(f"{_CLEAR}{text}")
            self._out.flush()

    def clear(self) -> None:
        """Wipe the line, and be ready for the next mesh."""
        if self._terminal and self._shown_s is not None:
            self._out.write(_CLEAR)
            self._out.flush()
        self._began_s = self._shown_s = None


def say_to_stderr(text: str) -> None:
    """Say a sentence to who runs a command whose output goes elsewhere."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def load_telling(site: Site, say: Callable[[str], None] = say_to_stderr) -> Machine:
    """`load_machine`, and a word on what takes long; progress goes to stderr if a terminal.

    Args:
        site: as `load_site` returns it.
        say: takes sentences.

    Raises:
        GeometryError: a URDF, mesh, linkage or scene object cannot be used.
    """
    if not kernel_cache.kept():
        say(COMPILING)
    line = BuildLine(sys.stderr, say)
    try:
        return load_machine(site, line)
    finally:
        line.clear()
