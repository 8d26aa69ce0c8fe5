"""An actuator's travel as a bar of characters: where it is, and where it is thought to end."""

from __future__ import annotations

import math

from rich.text import Text

from rampe_guard.view.marks import DIM
from rampe_guard.view.state import ActuatorView

TRACK, SPAN, HERE = "─", "━", "●"
ENDS = {1: "▷", -1: "◁"}


def gauge(actuator: ActuatorView, width: int, *, stale: bool, predicted: bool = True) -> Text:
    """Draw the travel between the limits in ``width`` cells.

    ``●`` is the position, ``▷`` or ``◁`` the predicted endpoint, ``━`` the way between them.
    An endless actuator is drawn over one turn about zero. A position beyond a limit is
    drawn at the edge as ``«`` or ``»``. ``predicted`` False leaves the forecast out.
    """
    if actuator.position is None:
        return Text("no position".center(width)[:width], "yellow")
    lower, upper = travel(actuator)
    position = actuator.position
    if actuator.lower is None or actuator.upper is None:
        position = math.remainder(position, math.tau)
    cells = [TRACK] * width
    styles = [DIM] * width
    here = _cell(position, lower, upper, width)
    if predicted and actuator.endpoint is not None and actuator.sign:
        there = _cell(position + actuator.endpoint - actuator.position, lower, upper, width)
        for i in range(min(here, there), max(here, there) + 1):
            cells[i], styles[i] = SPAN, "cyan"
        cells[there], styles[there] = ENDS[1 if actuator.sign > 0 else -1], "bold cyan"
    cells[here] = "«" if position < lower else "»" if position > upper else HERE
    styles[here] = "bold"
    text = Text()
    for cell, style in zip(cells, styles, strict=True):
        text.append(cell, DIM if stale else style)
    return text


def travel(actuator: ActuatorView) -> tuple[float, float]:
    """Return the drawn range [unit]: the limits, or one turn where there are none."""
    if actuator.lower is None or actuator.upper is None:
        return -math.pi, math.pi
    return actuator.lower, actuator.upper


def digits(actuator: ActuatorView) -> int:
    """Return decimals that show about a thousandth of the travel."""
    lower, upper = travel(actuator)
    return 2 if upper - lower >= 0.5 else 3  # noqa: PLR2004 - half a metre or radian


def _cell(value: float, lower: float, upper: float, width: int) -> int:
    share = (value - lower) / (upper - lower)
    return min(width - 1, max(0, math.floor(share * width)))
