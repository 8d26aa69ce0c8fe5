"""The terminal view: a pure function of `ViewState`.

What is stale is greyed and says so; without a fresh heartbeat the screen says that nobody is
protected, never that nothing is wrong. How levels look is in `marks`.
"""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level
from rampe_guard.view.alert_row import WIDE, alert_table
from rampe_guard.view.gauge import digits, gauge
from rampe_guard.view.marks import (
    ALARMING,
    DIM,
    GREY,
    LOST_HZ,
    LOST_SHAPE,
    PROTECTION,
    SHAPES,
    STYLES,
    age,
    fit,
    hatched,
    lit,
)
from rampe_guard.view.state import ActuatorView, EventView, ViewState

ARROWS = {1: "→", 0: "·", -1: "←", None: "?"}
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
        title("actuators", _basis(state), width),
        _actuators(state, width),
        title("alerts", "", width),
        _alerts(state, width),
        *[Text("")] * spare,
        title("events", "", width),
        _events(state, max(1, height - rows)),
        Text(""),
        _footer(state, width),
    )


def event_line(event: EventView, text: str | None = None) -> Text:
    """What happened, with shape and colour; ``text`` instead of the event's own."""
    text = event.text if text is None else text
    if event.lost:
        return Text(f"{LOST_SHAPE} {text}", "bold magenta")
    style = STYLES[event.level] if event.level is not Level.IMMINENT else "bold red"
    return Text(f"{SHAPES[event.level]} {text}", style)


def _header(state: ViewState, width: int) -> Text:
    word, style = PROTECTION[state.protection]
    name = f"{state.machine} · {state.site}"
    line = Text(fit(name, width - len(word) - 4), "bold")
    line.append(" " * max(1, width - line.cell_len - len(word) - 2))
    return line.append(f" {word} ", style)


def _banner(state: ViewState, width: int) -> list[Text]:
    """Three rows across the screen when nobody is protected; one when the guard is degraded."""
    if state.protection is Protection.MONITORING:
        return []
    if state.protection is Protection.DEGRADED:
        return [Text(fit(f" △ degraded: {state.why}", width), "yellow")]
    if state.protection is Protection.MACHINE_OFF:
        return [Text(fit(" ○ The machine says that it is switched off: not watched.", width), GREY)]
    not_monitoring = state.protection is Protection.NOT_MONITORING
    head = "NOT MONITORING" if not_monitoring else "PROTECTION UNAVAILABLE"
    lines = [
        f"{LOST_SHAPE}  {head}  {LOST_SHAPE}",
        state.why,
        "Collision warnings will not come. Work as if there were none.",
    ]
    turned = not state.seen and not lit(LOST_HZ, state.now_s)
    return [hatched(line, width, turned=turned) for line in lines]


def _lost(state: ViewState) -> bool:
    return state.protection in ALARMING


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
    if state.alerts:
        return alert_table(state.alerts, state.now_s, width)
    if _lost(state):
        return Text(" unknown: see above", "bold yellow")
    off = state.protection is Protection.MACHINE_OFF
    return Text(" none: the machine is off" if off else " none", GREY)


def _events(state: ViewState, rows: int) -> RenderableType:
    if not state.events:
        return Text(" none yet", GREY)
    table = Table(box=None, padding=(0, 1, 0, 0), show_header=False)
    table.add_column(justify="right", no_wrap=True, style=GREY, min_width=8)
    table.add_column(no_wrap=True, overflow="ellipsis")
    for event in state.events[:rows]:
        table.add_row(f"{age(state.now_s - event.at_s)} ago", event_line(event))
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


def title(name: str, remark: str, width: int) -> Text:
    """A rule with a name, and a remark at its end."""
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


def _pair(p50: float | None, p99: float | None) -> str:
    return f"{'—' if p50 is None else f'{p50:.1f}'}/{'—' if p99 is None else f'{p99:.1f}'}"


def _ms(seconds: float | None) -> str:
    return "—" if seconds is None else f"{seconds * 1000.0:.0f} ms"
