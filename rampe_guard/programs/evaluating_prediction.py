"""What `evaluate` prints of the forecasts of the next displacement."""

from __future__ import annotations

import math

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from rampe_guard.evaluate.prediction import MEAN, PROCESS, RAMPE, ZERO, Prediction
from rampe_guard.evaluate.prediction_score import KNOWN, Error
from rampe_guard.settings import Site


def prediction_title(site: Site, prediction: Prediction) -> str:
    """Machine, logs and primitives in one line."""
    knowledge = "each from nothing" if prediction.fresh else "knowledge carried over"
    count = len(prediction.runs)
    logs = "1 log" if count == 1 else f"{count} logs, {knowledge}"
    return f"{site.machine} at {site.name}: {logs}, {prediction.total.primitives} primitives"


def prediction_summary(site: Site, prediction: Prediction) -> list[RenderableType]:
    """Tables of errors and calibration, for people."""
    parts: list[RenderableType] = [Text(prediction_title(site, prediction), "bold"), Text("")]
    parts += [_table(prediction), Text("")]
    if len(prediction.runs) > 1:
        parts += [_runs(prediction), Text("")]
    parts += [*_ratios(prediction), _calibration(site, prediction), Text("")]
    parts.append(Text(_range(site, prediction), "dim"))
    return parts


def _grid(title: str, first: str, *columns: str) -> Table:
    table = Table(
        title=title, title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0)
    )
    table.add_column(first, header_style="dim", no_wrap=True)
    for column in columns:
        table.add_column(column, header_style="dim", justify="right", no_wrap=True)
    return table


def _table(prediction: Prediction) -> Table:
    total = prediction.total
    table = _grid(
        f"error of the next displacement, share of the range\n{total.primitives_known} primitives"
        f" of categories seen at least {KNOWN} times before, and all {total.primitives}",
        "forecaster",
        f"seen ≥ {KNOWN}",
        "95 %\nbootstrap",
        "moving\nonly",
        "all",
        "answered",
    )
    for name, error in total.everything.items():
        table.add_row(
            name,
            *_three(total.known.get(name)),
            f"{error.error:.3f}",
            f"{error.answered:.0%}",
            style="bold" if name == RAMPE else None,
        )
    return table


def _three(error: Error | None) -> tuple[str, str, str]:
    if error is None:
        return "—", "—", "—"
    spread = f"{error.spread.low:.3f}-{error.spread.high:.3f}"
    return f"{error.error:.3f}", spread, f"{error.moving:.3f}"


def _runs(prediction: Prediction) -> Table:
    shown = (ZERO, MEAN, PROCESS, RAMPE)
    titles = (
        "primitives",
        "cut\nshort",
        f"seen\n≥ {KNOWN}",
        *(name.replace(" ", "\n") for name in shown),
    )
    table = _grid(f"error by log, seen ≥ {KNOWN}", "log", *titles)
    for run, found in zip(prediction.runs, prediction.by_run, strict=True):
        errors = [found.known.get(name) for name in shown]
        table.add_row(
            run.name,
            str(found.primitives),
            str(run.incomplete),
            str(found.primitives_known),
            *("—" if e is None else f"{e.error:.3f}" for e in errors),
        )
    return table


def _ratios(prediction: Prediction) -> list[RenderableType]:
    known = prediction.ratios_known
    ratios, which = (known, f"seen ≥ {KNOWN}") if known else (prediction.ratios, "all")
    lines: list[RenderableType] = [
        Text(
            f"{RAMPE} / {name}, {which}: {ratios[name].median:.2f}"
            f" (95 % {ratios[name].low:.2f} to {ratios[name].high:.2f})"
        )
        for name in (PROCESS, MEAN)
    ]
    return [*lines, Text("")]


def _calibration(site: Site, prediction: Prediction) -> Table:
    found = prediction.calibration
    table = _grid(
        f"calibration of {RAMPE} ({found.forecasts} forecasts)",
        "actuator",
        *(f"inside {c.level:.0%}" for c in found.coverage),
        "displacements",
        "calibration error",
        "answers",
    )
    rows = zip(
        (*site.actuator_names, "all"),
        zip(*([*c.actuators.tolist(), c.overall] for c in found.coverage), strict=True),
        (*found.coverage[0].counts.tolist(), found.coverage[0].counts.sum()),
        (*found.actuators, found.overall),
        strict=True,
    )
    for name, inside, count, odds in rows:
        table.add_row(
            name,
            *(_share(v) for v in inside),
            str(count),
            _figure(odds.error),
            str(odds.counts.sum()),
            style="bold" if name == "all" else None,
        )
    return table


def _share(value: float) -> str:
    return f"{value:.0%}" if math.isfinite(value) else "—"


def _figure(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "—"


def _range(site: Site, prediction: Prediction) -> str:
    actuators = zip(site.guard.actuators, prediction.width.tolist(), strict=True)
    widths = ", ".join(f"{a.name} {width:.3g} {a.unit}" for a, width in actuators)
    return f"range (greatest less smallest position over all logs): {widths}"
