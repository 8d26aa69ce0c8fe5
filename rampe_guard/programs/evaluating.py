"""``rampe-guard evaluate``: how early, how often in vain, how well foreseen, on recorded work."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from rampe_guard.collision import load_arm
from rampe_guard.errors import RampeGuardError
from rampe_guard.evaluate.crew import Findings, Order, crew, evaluate_all
from rampe_guard.evaluate.definitions import GUARD
from rampe_guard.evaluate.foresight import report
from rampe_guard.evaluate.foresight_page import page
from rampe_guard.evaluate.prediction_plot import draw
from rampe_guard.evaluate.report_model import Point, Report, Strict, report_bytes
from rampe_guard.evaluate.stages import machine_of
from rampe_guard.programs.evaluating_prediction import prediction_summary, prediction_title
from rampe_guard.programs.fleet_file import read_fleet
from rampe_guard.programs.log_motion import motion_warnings
from rampe_guard.programs.output import output_folder
from rampe_guard.recording import open_log
from rampe_guard.runtime.loading import load_telling
from rampe_guard.settings import load_site

_LINE_S = 10.0
"""Least time between two lines on how far it is, where there is no bar [s]."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What was asked for.

    Attributes:
        site: path of the site file, None with ``fleet``.
        logs: paths of logs, in the order in which they are learned.
        fleet: path of a file that lists sequences, None for one sequence.
        out: folder for the results.
        fresh: each log starts from nothing.
        frozen: only so many logs teach, and only the others are judged.
        jobs: processes of this machine, None for as many as there are cores.
        scheduler: address of a Dask scheduler.
    """

    site: str | None
    logs: tuple[str, ...]
    fleet: str | None
    out: Path
    fresh: bool
    frozen: int | None
    jobs: int | None
    scheduler: str | None


def evaluate(wishes: Wishes, console: Console) -> int:
    """Evaluate one sequence of logs, or a fleet's; writes reports into a folder.

    Raises:
        SettingsError, GeometryError: a site cannot be used.
        LogError: a log cannot be what the site file says, or there is nothing to predict.
        ConnectionFailedError: no Dask cluster answers.
        RampeGuardError: what was asked for cannot be.
    """
    begin_s = time.perf_counter()
    orders = _orders(wishes)
    for order in orders:  # what is wrong is said at once, not after minutes
        _check(order)
    jobs = wishes.jobs or min(os.cpu_count() or 1, 3 * len(orders))
    if jobs > 1 and wishes.scheduler is None:
        load_telling(load_site(orders[0].site))  # compiled once, not by each process
    with crew(jobs, wishes.scheduler) as workers, _progress() as tell:
        found = evaluate_all(orders, workers, tell)
    worked_s = 0.0
    summary: dict[str, Any] = {}
    for findings in found:
        out = wishes.out / findings.order.name if wishes.fleet else wishes.out
        made = _write(findings, output_folder(out))
        worked_s += made.duration_s
        _show(made, findings, out, console)
        summary[findings.order.name] = {
            "site": made.site,
            "machine": made.machine,
            "duration_s": made.duration_s,
            "operating_point": msgspec.to_builtins(made.forecasts[GUARD].operating_point),
        }
    if wishes.fleet is not None:
        text = json.dumps(summary, indent=1, allow_nan=False)
        (wishes.out / "fleet.json").write_text(text + "\n", encoding="utf-8")
    spent_s = time.perf_counter() - begin_s
    print(  # noqa: T201
        f"{worked_s:.0f} s of work evaluated in {spent_s:.0f} s: {worked_s / spent_s:.0f} times"
        " as fast as it was done",
        file=sys.stderr,
    )
    return 0


def _orders(wishes: Wishes) -> tuple[Order, ...]:
    if wishes.fleet is not None:
        if wishes.site is not None:
            raise RampeGuardError("either SITE and LOG, or --fleet FILE, which names them")
        entries = read_fleet(wishes.fleet)
        return tuple(Order(e.name, e.site, e.logs, wishes.fresh, wishes.frozen) for e in entries)
    if wishes.site is None or not wishes.logs:
        raise RampeGuardError("a site file and at least one log are needed, or --fleet FILE")
    name = Path(wishes.site).stem
    return (Order(name, wishes.site, wishes.logs, wishes.fresh, wishes.frozen),)


def _check(order: Order) -> None:
    if order.frozen is not None and order.frozen >= len(order.logs):
        raise RampeGuardError(
            f"{order.name}: --frozen {order.frozen} leaves none of {len(order.logs)} logs to judge"
        )
    if order.frozen is not None and order.fresh:
        raise RampeGuardError("--fresh learns each log from nothing, --frozen does not: choose one")
    site = load_site(order.site)
    limits = load_arm(site.arm).limits
    for path in order.logs:
        log = open_log(site, path, limits)
        for warning in (*log.warnings, *motion_warnings(site, log)):
            print(f"warning: {warning}", file=sys.stderr)  # noqa: T201


class _progress:  # noqa: N801 - a context manager that is used like a function
    """A bar on stderr if it is a terminal; elsewhere a line now and then."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._lines = not console.is_terminal
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.0f} of {task.total:.0f}"),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
            transient=True,
        )

    def __enter__(self) -> Callable[[int, int], None]:
        self._bar.start()
        task = self._bar.add_task("evaluating", total=None)
        said_s = time.monotonic()

        def tell(done: int, total: int) -> None:
            nonlocal said_s
            self._bar.update(task, completed=done, total=total)
            if self._lines and time.monotonic() - said_s > _LINE_S:
                said_s = time.monotonic()
                print(f"{done} of {total} pieces evaluated", file=sys.stderr)  # noqa: T201

        return tell

    def __exit__(self, *_: object) -> None:
        self._bar.stop()


def _write(found: Findings, out: Path) -> Report:
    machine = machine_of(found.order.site)
    made = report(found, machine)
    (out / "report.json").write_bytes(report_bytes(made))
    details = json.dumps(made.prediction_details, indent=2, allow_nan=False)
    (out / "prediction.json").write_text(details + "\n", encoding="utf-8")
    (out / "report.html").write_text(page(made), encoding="utf-8")
    title = prediction_title(machine.site, found.prediction)
    draw(found.prediction, machine.site.actuator_names, title, out / "prediction.png")
    return made


def _show(made: Report, found: Findings, out: Path, console: Console) -> None:
    console.print(_table(made))
    for words in _outside_the_figures(made):
        console.print(Text(words, "yellow"))
    console.print(Text(""))
    for part in prediction_summary(load_site(found.order.site), found.prediction):
        console.print(part)
    files = ("report.html", "report.json", "prediction.json", "prediction.png")
    console.print(Text(", ".join(str(out / name) for name in files), "dim"))


def _table(made: Report) -> Table:
    minutes = made.duration_s / 60.0
    table = Table(
        title=(
            f"{made.machine} at {made.site}: {made.crossings} crossings of {len(made.zones)} zones"
            f" in {minutes:.1f} minutes\n{made.knowledge}"
        ),
        title_justify="left",
        title_style="bold",
        box=None,
        padding=(0, 2, 0, 0),
    )
    table.add_column("at the operating point", header_style="dim", no_wrap=True)
    for name in (
        "false /min\nand zone",
        "≥ 0.5 s",
        "≥ 1.0 s",
        "≥ 1.5 s",
        "median\nlead",
        "missed",
        "on",
    ):
        table.add_column(name, header_style="dim", justify="right", no_wrap=True)
    for name, forecast in made.forecasts.items():
        style = "bold" if name == GUARD else None
        table.add_row(name, *_cells(forecast.operating_point), style=style)
    strict = made.forecasts[GUARD].operating_point.strict
    if strict is not None:
        table.add_row(f"{GUARD}, strict", *_cells(strict))
    for level, of in made.published.items():
        table.add_row(f"published, {level} or above", *_cells(of.total), style="dim")
    return table


def _outside_the_figures(made: Report) -> Iterator[str]:
    """What no figure of the table counts: when the guard was blind, where the arm began inside."""
    if made.not_monitoring_s > 0.0:
        blind = made.forecasts[GUARD].operating_point.unmonitored
        more = "1 more crossing" if blind == 1 else f"{blind} more crossings"
        yield (
            f"NOT MONITORING {made.not_monitoring_s:.1f} of {made.duration_s:.1f} s: {more} came"
            " meanwhile, neither warned of nor missed"
        )
    for log in made.logs:
        inside = ", ".join(
            f"{zone} ({line.inside_at_first_s:.1f} s)"
            for zone, line in log.zones.items()
            if line.inside_at_first_s is not None
        )
        if inside:
            yield f"{log.log}: inside from the start, which counts as no crossing: {inside}"


def _cells(at: Point | Strict) -> tuple[str, ...]:
    shares = (at.warned_0_5_s, at.warned_1_0_s, at.warned_1_5_s)
    lead = at.median_lead_s
    return (
        _rate(at.false_per_min_per_zone),
        *map(_share, shares),
        "—" if lead is None else f"{lead:.2f} s",
        str(at.missed),
        _share(at.alarmed_share),
    )


def _rate(value: float | None) -> str:
    return "—" if value is None else f"{value:.2f}"


def _share(value: float | None) -> str:
    return "—" if value is None else f"{value:.0%}"
