"""Loading a machine with a word on what takes long: kernels compiled, meshes wrapped."""

from __future__ import annotations

import math
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


class StatusLine:
    """What a command that takes long does now.

    On a terminal it is one line, overwritten and in the end cleared. Elsewhere it is a sentence
    once that has taken long, and then again now and then.
    """

    def __init__(
        self,
        out: TextIO,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
        again_s: float = math.inf,
    ) -> None:
        """Write to ``out`` if it is a terminal, else ``say`` a sentence, and again_s [s] later."""
        self._out, self._say, self._clock, self._again_s = out, say, clock, again_s
        self._terminal = out.isatty()
        self._began_s: float | None = None
        self._shown_s: float | None = None

    def show(self, text: str, *, more: str = "", at_once: bool = False) -> None:
        """Take that ``text`` is done now.

        Args:
            text: a few words.
            more: said behind them where there is room for sentences.
            at_once: a terminal shows it without waiting whether it takes long.
        """
        now_s = self._clock()
        if self._began_s is None:
            self._began_s = now_s
        since_s = now_s - self._began_s
        if not self._terminal:
            if since_s > LONG_S and not self._just_shown(now_s, self._again_s):
                self._shown_s = now_s
                self._say(f"{text}{more}")
        elif at_once or (since_s > FLICKER_S and not self._just_shown(now_s, _PERIOD_S)):
            self._shown_s = now_s
            self._out.write(f"{_CLEAR}{text}")
            self._out.flush()

    def _just_shown(self, now_s: float, period_s: float) -> bool:
        return self._shown_s is not None and now_s - self._shown_s < period_s

    def clear(self) -> None:
        """Wipe the line, and be ready for the next work."""
        if self._terminal and self._shown_s is not None:
            self._out.write(_CLEAR)
            self._out.flush()
        self._began_s = self._shown_s = None


class BuildLine:
    """Says how far the shapes of meshes are, each anew; called as `Progress`."""

    def __init__(
        self,
        out: TextIO,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Write to ``out`` if it is a terminal, else call ``say`` with a sentence."""
        self._line = StatusLine(out, say, clock)

    def __call__(self, what: str, share: float) -> None:
        """Take that ``what`` is done, and which ``share`` of its mesh, from 0 to 1."""
        if share >= 1.0:
            self.clear()
            return
        text = f"{what}: {share:.0%}".replace("%", " %")
        self._line.show(text, more="; a mesh that was wrapped is kept for the next start")

    def clear(self) -> None:
        """Wipe the line, and be ready for the next mesh."""
        self._line.clear()


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
