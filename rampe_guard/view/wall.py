"""What a control room's screen shows of many machines, as one frozen value, and what fits on it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from rampe_guard.client.items import Item, Protection
from rampe_guard.client.machine import MachineState
from rampe_guard.core.alarm import Level
from rampe_guard.view.follow import alert_view
from rampe_guard.view.marks import ALARMING
from rampe_guard.view.state import AlertView, EventView
from rampe_guard.view.tell import lost, words, worth_a_line

_KEEP_EVENTS = 200


@dataclass(frozen=True, slots=True)
class Row:
    """One machine.

    Attributes:
        name: for people; with the site where another site has a machine of that name.
        site: its name; empty while it is not known.
        state: what is known of it.
        alerts: all that are not over, the gravest first.
    """

    name: str
    site: str
    state: MachineState
    alerts: tuple[AlertView, ...]

    @property
    def lost(self) -> bool:
        """Nobody is protected, and somebody should be."""
        return self.state.protection in ALARMING

    @property
    def seen(self) -> bool:
        """Somebody has acknowledged that it does not monitor; for a silent guard nobody can."""
        if self.state.protection is not Protection.NOT_MONITORING:
            return False
        return any(a.source == "system" and not a.attention for a in self.alerts)

    @property
    def details(self) -> tuple[AlertView, ...]:
        """The alerts to show below the machine: its own line tells that it does not monitor."""
        return tuple(a for a in self.alerts if not (self.lost and a.source == "system"))

    @property
    def why(self) -> str:
        """Why it is not plainly monitoring, and who has seen that."""
        seen = (a.acked_by for a in self.alerts if a.source == "system" and self.seen)
        names = [f"seen by {who}" for who in seen if who]
        return "; ".join((*self.state.reasons, *names))

    @property
    def gravest(self) -> AlertView | None:
        """The alert to name on the machine's own line: what asks for attention comes first."""
        asking = [a for a in self.alerts if a.inhibit == "none" and not a.gone]
        return asking[0] if asking else None

    @property
    def trouble(self) -> tuple[int, int]:
        """To sort by: the gravest first."""
        level = Level.CLEAR if self.gravest is None else self.gravest.level
        if self.lost:
            return -2, -level
        return -1 if level or self.state.protection is Protection.DEGRADED else 0, -level


@dataclass(frozen=True, slots=True)
class Wall:
    """Everything on the screen.

    Attributes:
        now_s: time of the picture [s].
        rows: machines in an order that does not change with what happens to them.
        names: machine and site before they are heard, by base.
        events: newest first.
        problems: of the view itself: networks that it cannot hear.
        asked: key expressions that are watched.
        clock: time of day, which shows that the picture lives.
    """

    now_s: float
    rows: tuple[Row, ...] = ()
    names: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    events: tuple[EventView, ...] = ()
    problems: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    clock: str = ""

    def name(self, base: str, machine: str, site: str) -> tuple[str, str]:
        """What people call the machine at ``base``, and its site."""
        if not machine:
            machine, site = self.names.get(base, (base, ""))
        twin = any(row.state.base != base and row.state.machine == machine for row in self.rows)
        return f"{machine} · {site}" if twin else machine, site

    def hear(self, items: Iterable[Item], now_s: float) -> Wall:
        """Put what happened on top of the events."""
        told = [
            EventView(
                now_s,
                Level[item.level.upper()],
                f"{self.name(item.base, item.machine, item.site)[0]}: {words(item)}",
                lost(item),
            )
            for item in items
            if worth_a_line(item)
        ]
        events = (*reversed(told), *self.events)[:_KEEP_EVENTS]
        return replace(self, now_s=now_s, events=events)

    def look(
        self,
        machines: Iterable[MachineState],
        problems: Iterable[str],
        now_s: float,
        clock: str,
    ) -> Wall:
        """Show what is known now."""
        rows = [
            Row(
                *self.name(machine.base, machine.machine, machine.site),
                machine,
                tuple(alert_view(alert, alert.sent_s) for alert in machine.alerts),
            )
            for machine in machines
        ]
        rows.sort(key=lambda row: (row.site, row.name, row.state.base))
        return replace(self, now_s=now_s, rows=tuple(rows), problems=tuple(problems), clock=clock)


@dataclass(frozen=True, slots=True)
class Fit:
    """What of the rows fits.

    Attributes:
        rows: machines to show, with the number of their alerts to show.
        hidden: machines that do not fit.
    """

    rows: tuple[tuple[Row, int], ...]
    hidden: tuple[Row, ...]


def fitted(rows: tuple[Row, ...], lines: int) -> Fit:
    """Choose what to show on ``lines`` lines: every machine before any detail, the gravest first.

    A line is kept for the word of what is hidden, where something is.
    """
    shown = rows
    if len(rows) > lines:
        shown = tuple(sorted(rows, key=lambda row: row.trouble)[: max(1, lines - 1)])
    hidden = tuple(row for row in rows if row not in shown)
    left = lines - len(shown) - bool(hidden)
    details: dict[str, int] = {}
    for row in sorted(shown, key=lambda row: row.trouble):
        details[row.state.base] = max(0, min(left, len(row.details)))
        left -= details[row.state.base]
    return Fit(tuple((row, details[row.state.base]) for row in rows if row in shown), hidden)
