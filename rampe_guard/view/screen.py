"""The terminal view: a pure function of `ViewState`.

Manners: grey when all is normal, nothing is ever green, and no meaning hangs on colour
alone: each level has its own shape and word. What is stale is greyed and says so; without
a fresh heartbeat the screen says that nobody is protected, never that nothing is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from rich.cells import cell_len, set_cell_size
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.core.alarm import Level
from rampe_guard.view.gauge import DIM, digits, gauge
from rampe_guard.view.state import ActuatorView, AlertView, Protection, ViewState

SHAPES = {Level.CLEAR: "·", Level.CAUTION: "◆", Level.WARNING: "▲", Level.IMMINENT: "■"}
WORDS = {
    Level.CLEAR: "clear",
    Level.CAUTION: "caution",
    Level.WARNING: "WARNING",
    Level.IMMINENT: "IMMINENT",
}
STYLES = {
    Level.CLEAR: "grey62",
    Level.CAUTION: "yellow",
    Level.WARNING: "bold yellow",
    Level.IMMINENT: "bold #ffffff on #b00000",
}
GREY = "grey62"
ALARM = "bold #ffffff on #b00000"
ARROWS = {1: "→", 0: "·", -1: "←", None: "?"}
WIDE = 110
_FIXED_ROWS = 6
_ALERT_ROWS = 3


def render(state: ViewState, width: int = 80, height: int = 24) -> RenderableType:
    """Lay out the screen.

    Args:
        state: what to show.
        width: of the terminal [cells]; from 110 on there are more columns.
        height: of the terminal [cells]; old events give way first, alerts never.
    """
    head = [_header(state, width), *_banner(state, width)]
    spare = max(0, _ALERT_ROWS - max(1, len(state.alerts)))  # so that an alert moves nothing
    rows = len(head) + len(state.actuators) + max(1, len(state.alerts)) + spare + _FIXED_ROWS
    return Group(
        *head,
        _title("actuators", _basis(state), width),
        _actuators(state, width),
        _title("alerts", "", width),
        _alerts(state, width),
        *[Text("")] * spare,
        _title("events", "", width),
        _events(state, max(1, height - rows)),
        Text(""),
        _footer(state, width),
    )


def level_text(level: Level) -> Text:
    """Shape and word of a level in its colour."""
    return Text(f" {SHAPES[level]} {WORDS[level]} ", STYLES[level])


def _header(state: ViewState, width: int) -> Text:
    words = {
        Protection.MONITORING: ("monitoring", GREY),
        Protection.DEGRADED: ("▲ DEGRADED", "bold yellow"),
        Protection.NOT_MONITORING: ("✖ NOT MONITORING", ALARM),
        Protection.UNAVAILABLE: ("✖ PROTECTION UNAVAILABLE", ALARM),
    }
    word, style = words[state.protection]
    name = f"{state.machine} · {state.site}"
    line = Text(_fit(name, width - len(word) - 4), "bold")
    line.append(" " * max(1, width - line.cell_len - len(word) - 2))
    return line.append(f" {word} ", style)


def _banner(state: ViewState, width: int) -> list[Text]:
    """Three rows across the screen when nobody is protected; one when the guard is degraded."""
    reasons = "; ".join(state.health.reasons) if state.health is not None else ""
    if state.protection is Protection.MONITORING:
        return []
    if state.protection is Protection.DEGRADED:
        return [Text(_fit(f" ▲ degraded: {reasons}", width), "yellow")]
    if state.protection is Protection.NOT_MONITORING:
        lines = ["✖  NOT MONITORING  ✖", reasons or "the guard gave no reason"]
    else:
        silent = state.silence_s
        lines = [
            "✖  PROTECTION UNAVAILABLE  ✖",
            "no message from the guard yet"
            if silent is None
            else f"no message from the guard for {silent:.1f} s",
        ]
    lines.append("Collision warnings will not come. Work as if there were none.")
    rows = [Text(_fit(line, width), ALARM) for line in lines]
    for row in rows:
        row.align("center", width)
    return rows


def _lost(state: ViewState) -> bool:
    return state.protection in {Protection.NOT_MONITORING, Protection.UNAVAILABLE}


def _basis(state: ViewState) -> str:
    if state.prediction_received_s is None or state.observations is None or _lost(state):
        return "no prediction"
    seen = state.observations
    return f"prediction from {seen} earlier move{'' if seen == 1 else 's'} like this"


def _actuators(state: ViewState, width: int) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), header_style=GREY, width=width)
    stale = state.position_stale
    lost = _lost(state)
    bar = 20 if width < WIDE else width - 72
    table.add_column("", no_wrap=True, width=9, overflow="ellipsis")
    table.add_column("travel", width=bar, no_wrap=True)
    numbers = [("position", 10), ("speed/s", 8), ("lever", 6), ("", 1), ("x̂ ± spread", 15)]
    if width >= WIDE:
        numbers.append(("endpoint", 10))
    for title, cells in numbers:  # fixed, so that no column moves when a number changes
        table.add_column(title, justify="right", no_wrap=True, width=cells)
    for actuator in state.actuators:
        places = digits(actuator)
        row = [
            Text(actuator.name, "" if not stale else DIM),
            gauge(actuator, bar, stale=stale, predicted=not lost),
            _number(actuator.position, places, f" {actuator.unit}", stale=stale),
            _number(actuator.velocity, places, "", stale=stale, signed=True),
            _lever(actuator, stale=state.command_stale),
            Text(ARROWS[actuator.sign], "bold" if actuator.sign and not lost else GREY),
            _prediction(actuator, places, stale=lost),
        ]
        if width >= WIDE:
            moving = actuator.endpoint if actuator.sign else None
            row.append(_number(moving, places, f" {actuator.unit}", stale=stale))
        table.add_row(*row)
    if stale:
        table.columns[1].header = Text("travel: STALE", "yellow")
    return table


def _alerts(state: ViewState, width: int) -> RenderableType:
    if not state.alerts:
        if _lost(state):
            return Text(" unknown: see above", "bold yellow")
        return Text(" none", GREY)
    table = Table(box=None, padding=(0, 1, 0, 0), header_style=GREY, width=width, show_header=False)
    for justify in ("left", "left", "right", "right", "left"):
        table.add_column(justify=justify, no_wrap=True, overflow="ellipsis")
    table.columns[1].ratio = 1
    if width >= WIDE:
        table.add_column(no_wrap=True)
    for alert in sorted(state.alerts, key=_urgency):
        table.add_row(*_alert_cells(state, alert, width))
    return table


def _alert_cells(state: ViewState, alert: AlertView, width: int) -> Iterable[Text]:
    stale = state.alert_stale(alert)
    plain = DIM if stale else ""
    level = level_text(alert.level)
    if stale:
        level = Text(level.plain, DIM)
    elif alert.level is Level.IMMINENT and alert.attention:
        level.stylize("blink", 1, 2)  # only the shape flashes: the word stays readable
    where = alert.zone if alert.link is None else f"{alert.link} → {alert.zone}"
    if alert.source == "system":
        where = alert.text or where
    seconds = alert.time_to_collision_s
    chance = alert.probability
    yield level
    yield Text(where, plain or "bold")
    yield Text("" if seconds is None else _countdown(seconds), plain)
    yield Text("" if chance is None else f"{chance:4.0%}", plain)
    yield Text(_remark(state, alert, stale=stale), plain or GREY)
    if width >= WIDE:
        clear = alert.clearance_now_m
        yield Text("" if clear is None else f"now {clear:+.2f} m from the margin", plain or GREY)


def _countdown(seconds: float) -> str:
    """Rounded down: no more time is promised than there is."""
    tenths = max(0, math.floor(seconds * 10.0 + 1e-6))
    return f"in {tenths / 10.0:.1f} s" if tenths else "now"


def _remark(state: ViewState, alert: AlertView, *, stale: bool) -> str:
    if stale:
        return f"STALE {state.now_s - alert.received_s:.0f} s"
    words = [alert.source]
    if not alert.trusted:
        words.append("DOUBTFUL")
    if alert.gone:
        words = ["over; please acknowledge"]
    elif not alert.attention:
        words.append("seen")
    return " · ".join(words)


def _urgency(alert: AlertView) -> tuple[int, float]:
    seconds = alert.time_to_collision_s
    return -alert.level, float("inf") if seconds is None else seconds


def _events(state: ViewState, rows: int) -> RenderableType:
    if not state.events:
        return Text(" none yet", GREY)
    table = Table(box=None, padding=(0, 1, 0, 0), show_header=False)
    table.add_column(justify="right", no_wrap=True, style=GREY, min_width=8)
    table.add_column(no_wrap=True, overflow="ellipsis")
    for event in state.events[:rows]:
        style = STYLES[event.level] if event.level is not Level.IMMINENT else "bold red"
        text = Text(f"{SHAPES[event.level]} {event.text}", style)
        table.add_row(f"{_age(state.now_s - event.at_s)} ago", text)
    return table


def _footer(state: ViewState, width: int) -> Text:
    health = state.health
    if health is None:
        return Text(" no heartbeat yet", GREY)
    known = "last known: " if state.protection is Protection.UNAVAILABLE else ""
    line = Text(
        f" {known}loop {_pair(health.loop_p50_ms, health.loop_p99_ms)}"
        f" · sweep {_pair(health.sweep_p50_ms, health.sweep_p99_ms)} ms p50/p99"
        f" · age: joystick {_ms(health.joystick_age_s)}, actuators {_ms(health.actuators_age_s)}",
        GREY,
    )
    if width >= WIDE and health.version:
        line.append(f" · rampe-guard {health.version}")
    line.truncate(width, overflow="ellipsis")
    return line


def _title(name: str, remark: str, width: int) -> Text:
    rule = "─" * max(0, width - len(name) - len(remark) - 5 - bool(remark))
    return Text(f"── {name} {rule}{' ' if remark else ''}{remark}", DIM)


def _number(
    value: float | None, places: int, unit: str, *, stale: bool, signed: bool = False
) -> Text:
    if value is None:
        return Text("—", GREY)
    sign = "+" if signed else ""
    value = round(value, places) + 0.0  # no "-0.00"
    return Text(f"{value:{sign}.{places}f}{unit}", DIM if stale else "")


def _lever(actuator: ActuatorView, *, stale: bool) -> Text:
    if actuator.command is None:
        return Text("—", GREY)
    return Text(f"{round(actuator.command, 2) + 0.0:+.0%}", DIM if stale else "")


def _prediction(actuator: ActuatorView, places: int, *, stale: bool) -> Text:
    if actuator.displacement is None or not actuator.sign:
        return Text("—", GREY)
    spread = "" if actuator.spread is None else f" ± {actuator.spread:.{places}f}"
    return Text(f"{actuator.displacement:+.{places}f}{spread}", DIM if stale else "cyan")


def _fit(text: str, width: int) -> str:
    return text if cell_len(text) <= width else f"{set_cell_size(text, width - 1)}…"


def _age(seconds: float) -> str:
    if seconds < 60.0:  # noqa: PLR2004 - a minute
        return f"{max(0.0, seconds):.1f} s"
    return f"{seconds / 60.0:.0f} min"


def _pair(p50: float | None, p99: float | None) -> str:
    return f"{'—' if p50 is None else f'{p50:.1f}'}/{'—' if p99 is None else f'{p99:.1f}'}"


def _ms(seconds: float | None) -> str:
    return "—" if seconds is None else f"{seconds * 1000.0:.0f} ms"
