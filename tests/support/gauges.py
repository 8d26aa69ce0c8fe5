"""What a running process costs, from /proc."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True)
class Cost:
    """Memory that is its own and nobody else's, all that is resident [MB], processor time [s]."""

    own_mb: float
    resident_mb: float
    cpu_s: float


def cost(pid: int) -> Cost:
    """Of a process that lives.

    Raises:
        OSError: it does not.
    """
    folder = Path("/proc") / str(pid)
    fields = (folder / "stat").read_text().rpartition(")")[2].split()
    words = dict(
        line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line
    )

    def mb(name: str) -> float:
        return int(words[name].split()[0]) / 1024.0

    return Cost(mb("RssAnon"), mb("VmRSS"), (int(fields[11]) + int(fields[12])) / _TICKS)
