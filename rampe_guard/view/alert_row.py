"""One alert on one line: the cells that the view of a machine and that of many share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.table import Table
from rich.text import Text

from rampe_guard.core.alarm import urgency
from rampe_guard.view.marks import DIM, GREY, countdown, level_text
from rampe_guard.view.state import AlertView

WIDE = 110
"""From here on there are more columns [cells]."""


def alert_table(alerts: Sequence[AlertView], now_s: float, width: int, indent: int = 0) -> Table:
    """The alerts, the gravest first, in ``width`` cells."""
    table = Table(box=None, padding=(0, 1, 0, 0), header_style=GREY, width=width, show_header=False)
    table.add_column(no_wrap=True, width=12 + indent)
    table.add_column(no_wrap=True, overflow="ellipsis", ratio=1)
    # fixed, so that tables of several machines stand in line
    table.add_column(no_wrap=True, justify="right", width=8)
    table.add_column(no_wrap=True, justify="right", width=4)
    table.add_column(no_wrap=True, overflow="ellipsis", width=25)
    if width >= WIDE:
        table.add_column(no_wrap=True, width=28)
    for alert in sorted(alerts, key=lambda a: urgency(a.level, a.time_to_collision_s)):
        level, *rest = _cells(alert, now_s, width)
        table.add_row(Text(" " * indent).append_text(level), *rest)
    return table


def _cells(alert: AlertView, now_s: float, width: int) -> Iterable[Text]:
    stale = alert.stale(now_s)
    quiet = stale or alert.gone or alert.inhibit != "none"
    plain = DIM if quiet else ""
    level = level_text(alert.level, flashes=alert.flashes, now_s=now_s)
    yield Text(level.plain, DIM) if quiet else level
    where = alert.zone if alert.link is None else f"{alert.link} → {alert.zone}"
    if alert.source == "system":
        where = alert.text or where
    yield Text(where, plain or "bold")
    seconds, chance = alert.time_to_collision_s, alert.probability
    yield Text("" if seconds is None else countdown(seconds), plain)
    yield Text("" if chance is None else f"{chance:4.0%}", plain)
    yield Text(_remark(alert, now_s, stale=stale), plain or GREY)
    if width >= WIDE:
        clear = alert.clearance_now_m
        yield Text("" if clear is None else f"now {clear:+.2f} m from the margin", plain or GREY)


def _remark(alert: AlertView, now_s: float, *, stale: bool) -> str:
    if stale:
        return f"STALE {now_s - alert.sent_s:.0f} s"
    if alert.inhibit == "machine_off":
        return "machine off"
    if alert.inhibit == "shelved":
        left_s = alert.shelved_left_s(now_s)
        time = "" if left_s is None else f", {left_s:.0f} s left"
        return f"shelved by {alert.shelved_by or 'someone'}{time}"
    words = [alert.source]
    if alert.times is not None:
        words = [f"{alert.source}: {alert.times[0]} of {alert.times[1]}"]
    if not alert.trusted:
        words.append("DOUBTFUL")
    if alert.gone:
        words = ["over; please acknowledge"]
    elif not alert.attention:
        words.append(f"seen by {alert.acked_by}" if alert.acked_by else "seen")
    return " · ".join(words)
