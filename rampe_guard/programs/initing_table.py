"""What ``rampe-guard init`` proposes, for who sits at the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rampe_guard.programs.initing_plan import ActuatorPlan, Said


def show(plans: Sequence[ActuatorPlan], console: Console) -> None:
    """Print the values, and what is wrong with them; what several have in common once."""
    console.print(_table(plans))
    problems: dict[str, list[str]] = {}
    for one in plans:
        for problem in one.problems:
            problems.setdefault(problem, []).append(one.name)
    for problem, names in problems.items():
        console.print(Text(f"note: {', '.join(names)}: {problem}", "yellow"))


def _table(plans: Sequence[ActuatorPlan]) -> Table:
    """Narrow enough for 80 columns, where names are not long."""
    table = Table(title="proposed; ? is not measured", title_justify="left", title_style="bold")
    table.box, table.pad_edge, table.padding = None, False, (0, 2, 0, 0)
    joints = any(one.joint.name not in (one.name, f"{one.name}_joint") for one in plans)
    names = ("name", "joint") if joints else ("name",)
    for column in names:
        table.add_column(column, header_style="dim", overflow="fold")
    for column in ("axis", "top speed", "braking", "lag", "deadband"):
        table.add_column(column, header_style="dim", no_wrap=True)
    table.add_column("seen", header_style="dim", overflow="fold")
    for one in plans:
        axis = f"{'+' if one.sign.value > 0 else '-'}{one.axis.value}"
        table.add_row(
            *(one.name, one.joint.name)[: len(names)],
            _shown(one.axis, axis),
            _shown(one.max_velocity, f"{one.max_velocity.value:g}"),
            _shown(one.max_deceleration, f"{one.max_deceleration.value:g}"),
            _shown(one.lag_s, f"{one.lag_s.value:g}"),
            _shown(one.deadband, f"{one.deadband.value:g}"),
            one.range or one.unit,
        )
    table.caption = "speed and braking per s and s², lag in s, in the unit of seen"
    table.caption_justify = "left"
    return table


def _shown(said: Said, text: str) -> str:
    return f"{text} ?" if said.todo else text
