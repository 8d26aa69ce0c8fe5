"""The closing table of a demo or a replay: was every contact warned of, and how early."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.view.marks import ALARM, GREY


@dataclass(frozen=True, slots=True)
class ZoneTally:
    """What happened at one zone.

    Attributes:
        zone: its name.
        contacts: times the arm went in.
        leads_s: lead time of each contact that was warned of [s].
        false_alarms: warnings without a contact.
        unknown_contacts: contacts that rest on a sweep without an answer.
    """

    zone: str
    contacts: int
    leads_s: tuple[float, ...]
    false_alarms: int
    unknown_contacts: int = 0


@dataclass(frozen=True, slots=True)
class Summary:
    """What happened in a run.

    Attributes:
        zones: one per keep-out object.
        duration_s: watched time [s].
        cycles: work cycles done, or None where nobody counts them.
        loop_p50_ms: loop time of the guard [ms].
        loop_p99_ms: the same [ms].
    """

    zones: Sequence[ZoneTally]
    duration_s: float
    cycles: int | None = None
    loop_p50_ms: float | None = None
    loop_p99_ms: float | None = None


def summary(tally: Summary) -> RenderableType:
    """Lay out the table, its totals and one line of verdict."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style=GREY)
    table.add_column("zone", no_wrap=True, overflow="ellipsis", max_width=24)
    for title in ("contacts", "warned", "missed", "lead min", "median", "max", "false alarms"):
        table.add_column(title, justify="right", no_wrap=True)
    for zone in tally.zones:
        table.add_row(*_row(zone))
    everything = ZoneTally(
        "all",
        sum(z.contacts for z in tally.zones),
        tuple(lead for z in tally.zones for lead in z.leads_s),
        sum(z.false_alarms for z in tally.zones),
        sum(z.unknown_contacts for z in tally.zones),
    )
    table.add_section()
    table.add_row(*_row(everything), style="bold")
    return Group(table, Text(""), _verdict(everything), Text(_run(tally, everything), GREY))


def _row(zone: ZoneTally) -> list[Text]:
    missed = zone.contacts - len(zone.leads_s)
    leads = zone.leads_s
    return [
        Text(zone.zone),
        Text(str(zone.contacts)),
        Text(str(len(leads))),
        Text(f"✖ {missed}", ALARM) if missed else Text("0"),
        _seconds(min(leads, default=None)),
        _seconds(median(leads) if leads else None),
        _seconds(max(leads, default=None)),
        Text(str(zone.false_alarms)),
    ]


def _verdict(zone: ZoneTally) -> Text:
    missed = zone.contacts - len(zone.leads_s)
    if zone.contacts == 0:
        return Text("The arm entered no keep-out margin: this run shows nothing about warning.")
    if missed:
        return Text(f"✖ {missed} of {zone.contacts} contacts came without a warning.", "bold red")
    text = (
        f"All {zone.contacts} contacts were warned of, the latest {min(zone.leads_s):.2f} s ahead."
    )
    return Text(text, "bold")


def _run(tally: Summary, everything: ZoneTally) -> str:
    minutes = tally.duration_s / 60.0
    watched = minutes * len(tally.zones)
    work = "" if tally.cycles is None else f"{tally.cycles} cycles in "
    first = f"{work}{minutes:.1f} min"
    if watched > 0.0:
        first += f" · {everything.false_alarms / watched:.2f} false alarms per minute and zone"
    lines = [first]
    if everything.unknown_contacts:
        lines.append(f"{everything.unknown_contacts} contacts rest on sweeps without an answer")
    if tally.loop_p50_ms is not None and tally.loop_p99_ms is not None:
        lines.append(f"loop {tally.loop_p50_ms:.1f} ms p50, {tally.loop_p99_ms:.1f} ms p99")
    return "\n".join(lines)


def _seconds(value: float | None) -> Text:
    return Text("—", GREY) if value is None else Text(f"{value:.2f} s")
