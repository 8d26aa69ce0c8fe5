"""``rampe-guard paper``: the engineering test of the paper, simulated, judged and shown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.progress import track
from rich.table import Table
from rich.text import Text

from rampe_guard.errors import RampeGuardError
from rampe_guard.evaluate.paper_estimates import MODES, PREDICTORS, Run, judge
from rampe_guard.evaluate.paper_figures import draw_figures
from rampe_guard.evaluate.paper_page import page
from rampe_guard.evaluate.paper_primitives import primitives_of
from rampe_guard.evaluate.paper_report import (
    Experiment,
    Report,
    build_report,
    primitives_csv,
    report_json,
)
from rampe_guard.programs.output import output_folder
from rampe_guard.simulate.paper_arm import ACTUATORS, LIMITS, TARGETS, WAY, Recording, paper_run


def paper(out: str, seeds: int, cycles: int, first_seed: int, console: Console) -> int:
    """Run the experiment and write figures, tables and page into ``out``; 0 when done.

    Args:
        out: folder, made if missing.
        seeds: how many runs.
        cycles: of each run.
        first_seed: of the first run, of which the figures are; the others follow it.
        console: where the summary goes.

    Raises:
        RampeGuardError: ``out`` cannot be written to.
    """
    folder = output_folder(out)
    shown: Recording | None = None
    runs: list[Run] = []
    minutes, corrections = 0.0, 0
    numbers = range(first_seed, first_seed + seeds)
    for seed in track(numbers, "simulating", console=console, transient=True):
        recording = paper_run(seed, cycles)
        shown = shown or recording
        runs.append(_judged(recording))
        minutes += float(recording.time_s[-1]) / 60.0
        corrections += recording.corrections
    if shown is None:
        raise RampeGuardError(f"--seeds is {seeds}, must be 1 or more")
    report = build_report(_experiment(cycles, minutes, corrections), runs)
    _write(folder, report, runs, shown)
    console.print(_summary(report))
    console.print(Text(f"\npage: {folder / 'index.html'}", no_wrap=True, overflow="ignore"))
    return 0


def _judged(recording: Recording) -> Run:
    primitives = primitives_of(recording.time_s, recording.axes, recording.position, ACTUATORS)
    return judge(recording.seed, primitives, LIMITS)


def _experiment(cycles: int, minutes: float, corrections: int) -> Experiment:
    return Experiment(
        cycles=cycles,
        actuators=tuple(a.name for a in ACTUATORS),
        units=tuple(a.unit for a in ACTUATORS),
        span=np.ptp(np.array(list(TARGETS.values())), axis=0),
        targets=TARGETS,
        way=WAY,
        minutes=minutes,
        corrections=corrections,
    )


def _write(folder: Path, report: Report, runs: Sequence[Run], shown: Recording) -> None:
    done = report.experiment
    files = draw_figures(folder, done, runs[0], shown.time_s, shown.position)
    pictures = [(file, (folder / f"{file.name}.svg").read_bytes()) for file in files]
    table = json.dumps(report_json(report), indent=2, allow_nan=False)
    (folder / "table.json").write_text(table + "\n", "utf-8")
    (folder / "primitives.csv").write_text(primitives_csv(runs, done), "utf-8")
    (folder / "index.html").write_text(page(report, pictures), "utf-8")


def _summary(report: Report) -> RenderableType:
    done = report.experiment
    head = Text(
        f"{_count(len(report.seeds), 'run')} of {_count(done.cycles, 'cycle')},"
        f" {report.primitives} primitives,"
        f" {done.minutes:.0f} simulated minutes",
        "bold",
    )
    return Group(
        head,
        Text("\nerror after initialising, share of the range", "bold"),
        _errors(report),
        Text("\nthe paper's claims", "bold"),
        _claims(report),
    )


def _errors(report: Report) -> Table:
    table = _table("predictor")
    for title in ("median", "p90", "p99", "largest"):
        table.add_column(title, header_style="dim", justify="right")
    for predictor in PREDICTORS:
        q = report.quantiles[predictor]
        table.add_row(predictor, *(_share(value) for value in (q.median, q.p90, q.p99, q.largest)))
    return table


def _claims(report: Report) -> Table:
    table = _table("claim", *MODES)
    for found in zip(*(report.claims[mode] for mode in MODES), strict=True):
        table.add_row(found[0].text, *(claim.verdict.value for claim in found))
    return table


def _share(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "-"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, header_style="dim", overflow="fold")
    return table
