"""Many machines on one terminal: a line for each, below it its alerts; a pure function of `Wall`.

The order of machines never changes with what happens to them, so that a glance finds each at
its place. Only when they do not all fit, those in trouble are shown and the rest is counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level
from rampe_guard.view.alert_row import WIDE, alert_table
from rampe_guard.view.marks import (
    DIM,
    GREY,
    LOST,
    LOST_HZ,
    LOST_SHAPE,
    LOST_TURNED,
    PROTECTION,
    age,
    fit,
    hatched,
    level_text,
    lit,
)
from rampe_guard.view.screen import event_line, title
from rampe_guard.view.wall import Row, Wall, fitted

_EVENT_ROWS = 4
_TALL = 36
_INDENT = 3
_UNAVAILABLE = f"{LOST_SHAPE} UNAVAILABLE"
"""Short of the words of `PROTECTION`, for a column."""


def render_wall(wall: Wall, width: int = 80, height: int = 24) -> RenderableType:
    """Lay out the screen in ``width`` by ``height`` cells."""
    head = [_header(wall, width), *_banner(wall, width, height)]
    head += [Text(fit(f" △ {problem}", width), "bold yellow") for problem in wall.problems]
    fixed = len(head) + 2 + 1  # titles of machines and events, and one event at least
    choice = fitted(wall.rows, max(1, height - fixed - _EVENT_ROWS + 1))
    body: list[RenderableType] = []
    used = 0
    for row, details in choice.rows:
        body.append(_machine(row, wall.now_s, width))
        used += 1 + details
        if details:
            body.append(_details(row, details, wall.now_s, width))
    if choice.hidden:
        body.append(_hidden(choice.hidden, width))
        used += 1
    if not wall.rows:
        body.append(Text(fit(f" no guard was heard on {', '.join(wall.asked)}", width), LOST))
        used += 1
    room = max(1, height - fixed - used + 1)
    return Group(
        *head,
        title("machines", "inputs · heartbeat", width),
        *body,
        title("events", "", width),
        _events(wall, room, width),
    )


def _header(wall: Wall, width: int) -> Text:
    counts = Counter(row.state.protection for row in wall.rows)
    machines = len(wall.rows)
    words = [f"{machines} machine{'' if machines == 1 else 's'}"]
    words += [f"{counts[p]} {PROTECTION[p][0]}" for p in Protection if counts[p]]
    line = Text(fit(" · ".join(words), width - len(wall.clock) - 1), "bold")
    line.append(" " * max(1, width - line.cell_len - len(wall.clock)))
    return line.append(wall.clock, GREY)


def _banner(wall: Wall, width: int, height: int) -> list[Text]:
    """Across the screen while somebody who should be protected is not."""
    lost = [row for row in wall.rows if row.lost]
    if not lost:
        return []
    turned = not all(row.seen for row in lost) and not lit(LOST_HZ, wall.now_s)
    names = ", ".join(row.name for row in lost)
    words = f"{LOST_SHAPE} NOT PROTECTED: {names} {LOST_SHAPE}"
    if len(words) + 8 > width:
        words = f"{LOST_SHAPE} NOT PROTECTED: {len(lost)} machines {LOST_SHAPE}"
    line = hatched(words, width, turned=turned)
    if height < _TALL:
        return [line]
    return [hatched("", width, turned=turned), line, hatched("", width, turned=turned)]


def _machine(row: Row, now_s: float, width: int) -> Table:
    word, style = PROTECTION[row.state.protection]
    if row.state.protection is Protection.UNAVAILABLE:
        word = _UNAVAILABLE
    if row.lost and not row.seen and not lit(LOST_HZ, now_s):
        style = LOST_TURNED
    table = Table(box=None, padding=(0, 1, 0, 0), show_header=False, width=width)
    wide = width >= WIDE
    for cells in (34 if wide else 13, 18 if wide else 16):
        table.add_column(no_wrap=True, width=cells, overflow="ellipsis")
    table.add_column(no_wrap=True, ratio=1, overflow="ellipsis")
    table.add_column(no_wrap=True, justify="right", width=32 if wide else 6)
    table.add_column(no_wrap=True, justify="right", width=6)
    site = f" · {row.site}" if wide and row.site and row.site not in row.name else ""
    table.add_row(
        Text(row.name, "bold").append(site, "not bold"),
        Text(word, style),
        _gravest(row, now_s),
        _inputs(row, wide=wide),
        _beat(row),
        style=LOST if row.lost else "",
    )
    return table


def _gravest(row: Row, now_s: float) -> Text:
    alert = row.gravest
    if row.lost:
        return Text(row.why, LOST)
    if alert is not None:
        text = level_text(alert.level, flashes=alert.flashes, now_s=now_s)[1:]
        return text.append(alert.text, "bold" if alert.level > Level.CAUTION else "")
    if row.state.protection is Protection.DEGRADED:
        return Text(row.why, "yellow")
    return Text("· no alert" if row.state.protection is Protection.MONITORING else "", GREY)


def _inputs(row: Row, *, wide: bool) -> Text:
    beat = row.state.heartbeat
    if beat is None or row.state.silent:
        return Text("—", GREY if not row.lost else "")
    ages = beat.input_age_s
    levers, arm = ages.joystick_s, ages.actuators_s
    text = _short(None if levers is None or arm is None else max(levers, arm))
    if wide:
        text = f"joystick {_short(levers)}, actuators {_short(arm)}"
    return Text(text, "" if row.lost else GREY)


def _beat(row: Row) -> Text:
    silence_s = row.state.silence_s
    return Text("never" if silence_s is None else age(silence_s), "" if row.lost else GREY)


def _details(row: Row, count: int, now_s: float, width: int) -> RenderableType:
    """As many alerts as there is room for; the last line says how many are missing."""
    if count >= len(row.details):
        return alert_table(row.details, now_s, width, _INDENT)
    missing = len(row.details) - count + 1
    more = Text(f"{' ' * _INDENT} … {missing} more", DIM)
    if count == 1:
        return more
    return Group(alert_table(row.details[: count - 1], now_s, width, _INDENT), more)


def _hidden(rows: Sequence[Row], width: int) -> Text:
    counts = Counter(row.state.protection for row in rows)
    words = [f"{counts[p]} {PROTECTION[p][0]}" for p in Protection if counts[p]]
    raised = sum(row.gravest is not None for row in rows)
    alerts = f"{raised} with alerts" if raised else "no alerts"
    text = f" … {len(rows)} more do not fit here: {', '.join(words)}; {alerts}"
    lost = any(row.lost for row in rows)
    return Text(fit(text, width), LOST if lost else "bold yellow" if raised else GREY)


def _events(wall: Wall, rows: int, width: int) -> RenderableType:
    if not wall.events:
        return Text(" none yet", GREY)
    return Group(*_event_rows(wall, rows, width))


def _event_rows(wall: Wall, rows: int, width: int) -> Iterator[Text]:
    for event in wall.events[:rows]:
        when = f"{age(wall.now_s - event.at_s):>7} ago "
        line = Text(when, GREY)
        yield line.append_text(event_line(event, fit(event.text, width - len(when) - 2)))


def _short(seconds: float | None) -> str:
    if seconds is None:
        return "none"
    return f"{seconds * 1000.0:.0f} ms" if seconds < 1.0 else age(seconds)
