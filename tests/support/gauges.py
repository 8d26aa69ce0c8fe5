"""What a running process costs, from /proc."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True)
class Cost:
    """Of a process.

    Attributes:
        own_mb: memory that is its own and nobody else's [MB].
        resident_mb: all that is resident, shared libraries too [MB].
        share_mb: its proportional share of the latter [MB].
        cpu_s: processor time [s].
    """

    own_mb: float
    resident_mb: float
    share_mb: float
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

    share = re.search(r"^Pss: +(\d+) kB", (folder / "smaps_rollup").read_text(), re.MULTILINE)
    share_mb = int(share[1]) / 1024.0 if share else float("nan")
    cpu_s = (int(fields[11]) + int(fields[12])) / _TICKS
    return Cost(mb("RssAnon"), mb("VmRSS"), share_mb, cpu_s)
