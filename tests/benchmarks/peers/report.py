"""Tables for the terminal and the README, and what a program wants to know as JSON."""

from __future__ import annotations

import platform
from dataclasses import asdict, dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.benchmarks.peers.registry import ENTRIES, OURS

if TYPE_CHECKING:
    from tests.benchmarks.peers.clock import Row
    from tests.benchmarks.peers.registry import Entry
    from tests.benchmarks.peers.work import Work

HEAD = (
    "", "median ms", "p99 ms", "x ours (median / p99)", "missed", "false", "late (most, mm)",
    "guarantee",
)  # fmt: skip


@dataclass(slots=True)
class Section:
    """One work and everybody's figures on it."""

    arm: str
    kind: str
    objects: int
    motions: int
    contacts: int
    tolerance_m: float
    rows: list[Row] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, work: Work, contacts: int) -> Section:
        """An empty one for a work."""
        return cls(
            work.machine.name, work.kind, len(work.items), len(work.motions), contacts,
            work.machine.tolerance_m,
        )  # fmt: skip

    @property
    def title(self) -> str:
        """What was asked."""
        return (
            f"{self.arm}, {self.objects} objects ({self.kind}), {self.motions} motions, of which "
            f"{self.contacts} in contact; tolerance {1e3 * self.tolerance_m:g} mm"
        )

    @property
    def ours(self) -> Row | None:
        """Our row, if we took part."""
        return next((row for row in self.rows if row.peer == OURS), None)

    def best(self, *, exact: bool) -> Row | None:
        """The peer with the least median that missed nothing and was never late.

        Args:
            exact: and that called no contact where there was clearance.
        """
        fit = [
            row for row in self.rows if row.peer != OURS and row.sound and not (exact and row.false)
        ]
        return min(fit, key=lambda row: row.median_ms, default=None)

    def markdown(self) -> str:
        """Table with a line on the best peers below it."""
        lines = [f"**{self.title}**", "", _line(HEAD), _line(["---"] * len(HEAD))]
        lines += [_line(self._cells(row)) for row in self.rows]
        lines += [f"\n{word}" for word in [*self.skipped, *self._best_lines()]]
        return "\n".join(lines)

    def _cells(self, row: Row) -> list[str]:
        late = f"{row.late} ({row.latest_mm:.1f})" if row.late else "0"
        return [
            row.peer, f"{row.median_ms:.3f}", f"{row.p99_ms:.3f}", _ratio(row, self.ours),
            str(row.missed), str(row.false), late, row.guarantee,
        ]  # fmt: skip

    def _best_lines(self) -> list[str]:
        lines = []
        for exact, words in ((True, "nothing missed, late or false"), (False, "missed nothing")):
            best = self.best(exact=exact)
            if best is not None and self.ours is not None:
                ratio = _ratio(self.ours, best)
                lines.append(f"Ours / best peer with {words} ({best.peer}): {ratio}.")
        return lines

    def record(self) -> dict[str, Any]:
        """For JSON."""
        best = {"exact": self.best(exact=True), "sound": self.best(exact=False)}
        names = {key: None if row is None else row.peer for key, row in best.items()}
        return {**asdict(self), "best_peer": names}


def machine_record(core: int, entries: tuple[Entry, ...] = ENTRIES) -> dict[str, Any]:
    """CPU, core, Python and versions."""
    packages = {entry.package for entry in entries} | {"numba", "numpy", "example-robot-data"}
    versions = {}
    for name in sorted(packages):
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {
        "cpu": cpu_model(),
        "pinned_to_core": core,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": versions,
    }


def cpu_model() -> str:
    """As Linux names it; else what Python knows."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def machine_line(record: dict[str, Any]) -> str:
    """One sentence on where and with what this was measured."""
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    return f"{record['cpu']}, one core, Python {record['python']}; {versions}"


def _ratio(row: Row, to: Row | None) -> str:
    if to is None:
        return ""
    return f"{row.median_ms / to.median_ms:.2f} / {row.p99_ms / to.p99_ms:.2f}"


def _line(cells: list[str] | tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
