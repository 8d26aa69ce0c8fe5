"""The closing table of a demo or a replay: was every contact warned of, and how early."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.core.alarm import Level
from rampe_guard.view.marks import ALARM, GREY, LOST, STYLES


@dataclass(frozen=True, slots=True)
class ZoneTally:
    """What happened at one zone.

    Attributes:
        zone: its name.
        contacts: times the arm went in while the guard monitored.
        leads_s: lead time of each contact that was warned of [s].
        false_alarms: warnings without a contact.
        unknown_contacts: contacts that rest on a sweep without an answer.
        unmonitored: times it went in while the guard did not monitor.
    """

    zone: str
    contacts: int
    leads_s: tuple[float, ...]
    false_alarms: int
    unknown_contacts: int = 0
    unmonitored: int = 0


@dataclass(frozen=True, slots=True)
class Summary:
    """What happened in a run.

    Attributes:
        zones: one per keep-out object.
        duration_s: watched time [s].
        cycles: work cycles done, or None where nobody counts them.
        loop_p50_ms: loop time of the guard [ms].
        loop_p99_ms: the same [ms].
        blind_s: how much of the watched time the guard did not monitor [s].
        inside_at_first_s: zones that the arm was in from the start, and for how long [s].
    """

    zones: Sequence[ZoneTally]
    duration_s: float
    cycles: int | None = None
    loop_p50_ms: float | None = None
    loop_p99_ms: float | None = None
    blind_s: float = 0.0
    inside_at_first_s: Mapping[str, float] = field(default_factory=dict)


def summary(tally: Summary) -> RenderableType:
    """Lay out the table, its totals and one line of verdict."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style=GREY)
    table.add_column("zone", no_wrap=True, overflow="ellipsis", max_width=24)
    for title in ("contacts", "warned", "missed", "lead min", "median", "max", "false alarms"):
        table.add_column(title, justify="right", no_wrap=True)
    blind = any(zone.unmonitored for zone in tally.zones)
    if blind:
        table.add_column("blind", justify="right", no_wrap=True)
    for zone in tally.zones:
        table.add_row(*_row(zone, blind=blind))
    everything = ZoneTally(
        "all",
        sum(z.contacts for z in tally.zones),
        tuple(lead for z in tally.zones for lead in z.leads_s),
        sum(z.false_alarms for z in tally.zones),
        sum(z.unknown_contacts for z in tally.zones),
        sum(z.unmonitored for z in tally.zones),
    )
    table.add_section()
    table.add_row(*_row(everything, blind=blind), style="bold")
    said = [_verdict(everything, tally), *_blind(everything, tally), *_inside(tally)]
    return Group(table, Text(""), *said, Text(_run(tally, everything), GREY))


def _row(zone: ZoneTally, *, blind: bool) -> list[Text]:
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
        *([Text(str(zone.unmonitored))] if blind else []),
    ]


def _verdict(zone: ZoneTally, run: Summary) -> Text:
    missed = zone.contacts - len(zone.leads_s)
    if zone.contacts == 0:
        when = " after the start" if run.inside_at_first_s else ""
        if run.blind_s > 0.0:
            when += " while the guard monitored"
        return Text(
            f"The arm entered no keep-out margin{when}: this run shows nothing about warning."
        )
    if missed:
        return Text(f"✖ {missed} of {zone.contacts} contacts came without a warning.", "bold red")
    which = " that came while the guard monitored" if zone.unmonitored else ""
    latest = f"the latest {min(zone.leads_s):.2f} s ahead"
    return Text(f"All {zone.contacts} contacts{which} were warned of, {latest}.", "bold")


def _blind(zone: ZoneTally, run: Summary) -> list[Text]:
    """That it was blind, and what came meanwhile."""
    if run.blind_s <= 0.0:
        return []
    text = f"NOT MONITORING {run.blind_s:.1f} of {run.duration_s:.1f} s"
    if zone.unmonitored:
        more = "1 more contact" if zone.unmonitored == 1 else f"{zone.unmonitored} more contacts"
        text += f": {more} came meanwhile (blind), neither warned of nor missed"
    return [Text(text, LOST)]


def _inside(run: Summary) -> list[Text]:
    """Zones that the arm was in from the start, of which nobody could warn."""
    if not run.inside_at_first_s:
        return []
    zones = ", ".join(
        f"{zone} ({inside_s:.1f} s{', to the end' if inside_s >= run.duration_s else ''})"
        for zone, inside_s in run.inside_at_first_s.items()
    )
    return [
        Text(
            f"The arm was inside from the start, which counts as no contact: {zones}",
            STYLES[Level.CAUTION],
        )
    ]


def _run(tally: Summary, everything: ZoneTally) -> str:
    minutes = tally.duration_s / 60.0
    watched = (tally.duration_s - tally.blind_s) / 60.0 * len(tally.zones)
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
