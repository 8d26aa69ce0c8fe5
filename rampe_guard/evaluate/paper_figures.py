"""Figures 5 to 9 of the paper, in its form, drawn from one run."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_claims import FREQUENT
from rampe_guard.evaluate.paper_estimates import MODES, N_INIT, PredictorName, Run
from rampe_guard.evaluate.paper_plot import (
    Axes,
    Figure,
    Line2D,
    category_style,
    new_figure,
    plain,
    save,
    style,
)
from rampe_guard.evaluate.paper_report import Experiment, FigureFile, sign_name

_GREY = "#666666"
_BEYOND = "#c00000"
_EDGE = 1.1
"""Errors beyond this many times the largest displacement are drawn at the edge."""


def draw_figures(
    folder: Path, experiment: Experiment, run: Run, time_s: FloatArray, position: FloatArray
) -> tuple[FigureFile, ...]:
    """Write all figures of one run of two actuators as PNG and SVG.

    Args:
        folder: exists.
        experiment: names, units and targets.
        run: judged by every predictor.
        time_s: (T,) [s].
        position: measured (T, 2) [unit].
    """
    with style():
        made = _draw(experiment, run, time_s, position)
        for figure, file in made:
            save(figure, folder, file.name)
    return tuple(file for _, file in made)


def _draw(
    experiment: Experiment, run: Run, time_s: FloatArray, position: FloatArray
) -> list[tuple[Figure, FigureFile]]:
    seed = f"seed {run.seed}"
    made = [
        (
            figure5(experiment),
            FigureFile("figure5", "Figure 5", "The targets, and the way between them."),
        ),
        (
            figure6(experiment, time_s, position),
            FigureFile(
                "figure6", "Figure 6", f"The actuators over time, {experiment.cycles} cycles."
            ),
        ),
        (
            figure7(experiment, run, time_s, position),
            FigureFile(
                "figure7",
                "Figure 7",
                "The path by category of the primitive; a mark where each primitive starts.",
            ),
        ),
    ]
    for mode in MODES:
        ending = "" if mode == "faithful" else f"_{mode}"
        shown = f"{mode} mode, {seed}"
        made += [
            (
                figure8(experiment, run, mode),
                FigureFile(
                    f"figure8{ending}",
                    f"Figure 8, {mode} mode",
                    f"Start, estimated and actual end of the {FREQUENT} most frequent categories"
                    f" after initialising ({shown}). A thin line joins estimate and truth.",
                ),
            ),
            (
                figure9(experiment, run, mode),
                FigureFile(
                    f"figure9{ending}",
                    f"Figure 9, {mode} mode",
                    f"Error E of the {FREQUENT} most frequent categories against occurrence k"
                    f" ({shown}). The first {N_INIT} occurrences are shaded; a triangle at the"
                    " edge is an error beyond it.",
                ),
            ),
        ]
    return made


def figure5(experiment: Experiment) -> Figure:
    """The targets in the q1-q2 plane."""
    figure = new_figure(5.2, 3.6)
    (axes,) = plain(figure, 1, 1)
    targets = experiment.targets
    for here, there in pairwise(experiment.way):
        arrow = {"arrowstyle": "->", "color": _GREY, "shrinkA": 9, "shrinkB": 9}
        arrow["connectionstyle"] = "arc3,rad=0.08"  # there and back side by side
        axes.annotate("", xy=targets[there], xytext=targets[here], arrowprops=arrow)
    for name, (q1, q2) in targets.items():
        axes.plot(q1, q2, "o", color="#0072b2", markersize=7)
        label = f"{name}  ({q1:g}, {q2:.2f})"
        below = q2 < max(t[1] for t in targets.values())  # clear of the arrows
        axes.annotate(label, (q1, q2), (9, -15 if below else 8), textcoords="offset points")
    axes.margins(x=0.45, y=0.15)
    _plane(axes, experiment)
    return figure


def figure6(experiment: Experiment, time_s: FloatArray, position: FloatArray) -> Figure:
    """Both actuators over time."""
    figure = new_figure(9.0, 4.2)
    panels = plain(figure, 2, 1)
    for i, axes in enumerate(panels):
        axes.plot(time_s, position[:, i], color="#0072b2", linewidth=0.9)
        levels: dict[float, list[str]] = {}
        for name, target in experiment.targets.items():
            levels.setdefault(target[i], []).append(name)
        for level, names in levels.items():
            axes.axhline(level, color="#bbbbbb", linewidth=0.7, zorder=0)
            at = (1.005, level)
            axes.annotate(
                ", ".join(names), at, xycoords=("axes fraction", "data"), va="center", color=_GREY
            )
        axes.set_ylabel(_label(experiment, i))
        axes.margins(x=0.01)
    panels[-1].set_xlabel("time [s]")
    return figure


def figure7(experiment: Experiment, run: Run, time_s: FloatArray, position: FloatArray) -> Figure:
    """The path in the q1-q2 plane, coded by category."""
    figure = new_figure(8.0, 4.8)
    (axes,) = plain(figure, 1, 1)
    axes.plot(*position.T, color="#d0d0d0", linewidth=0.5, zorder=1)
    p = run.primitives
    handles = []
    for category in p.most_frequent(len(p.category)):
        colour, mark = category_style(category)
        members = p.of(category)
        for k in members:
            inside = (time_s >= p.start_s[k]) & (time_s <= p.end_s[k])
            axes.plot(*position[inside][::2].T, color=colour, linewidth=0.9, alpha=0.75, zorder=2)
        axes.plot(
            *p.start[members].T,
            mark,
            color=colour,
            markersize=4.5,
            markeredgecolor="white",
            markeredgewidth=0.4,
            zorder=3,
            linestyle="none",
        )
        label = f"{sign_name(category)}  {len(members)}"
        handles.append(Line2D([], [], color=colour, marker=mark, markersize=5, label=label))
    handles.append(Line2D([], [], color="#d0d0d0", label="static"))
    axes.legend(
        handles=handles, title="category, occurrences", loc="center left", bbox_to_anchor=(1, 0.5)
    )
    _plane(axes, experiment)
    return figure


def figure8(experiment: Experiment, run: Run, predictor: PredictorName) -> Figure:
    """Start, estimated end and actual end of the most frequent categories."""
    figure = new_figure(10.0, 5.8)
    panels = plain(figure, 2, 3)
    p = run.primitives
    for axes, category in zip(panels, p.most_frequent(FREQUENT), strict=False):
        members = p.of(category)
        known = members[run.initialised[members]]
        start, end = p.start[known], p.start[known] + p.displacement[known]
        said = p.start[known] + run.estimate[predictor][known]
        colour, _ = category_style(category)
        for a, b in zip(said, end, strict=True):
            axes.plot(*np.array([a, b]).T, color=colour, linewidth=0.6, alpha=0.6)
        axes.plot(*start.T, "o", color="white", markeredgecolor="#333333", markersize=4.5)
        axes.plot(*end.T, "o", color=colour, markersize=4.5, linestyle="none")
        axes.plot(*said.T, "x", color="#111111", markersize=5, markeredgewidth=1.0)
        outside = _zoom(axes, np.concatenate([start, end]), said)
        beyond = f", {outside} estimates outside" if outside else ""
        axes.set_title(f"{sign_name(category)}: {len(known)} primitives{beyond}")
        _plane(axes, experiment)
    for axes in panels[min(FREQUENT, len(set(p.category))) :]:
        axes.set_axis_off()
    marks = [
        Line2D([], [], ls="", marker="o", color="white", markeredgecolor="#333333", label="start"),
        Line2D([], [], ls="", marker="x", color="#111111", label="estimated end"),
        Line2D([], [], ls="", marker="o", color=_GREY, label="actual end (in colour)"),
    ]
    panels[-1].legend(handles=marks, loc="center", title=f"{predictor} mode", fontsize=10)
    return figure


def figure9(experiment: Experiment, run: Run, predictor: PredictorName) -> Figure:
    """Error E = x - x̂ against occurrence k, a row per actuator, a column per category."""
    figure = new_figure(11.0, 4.8)
    categories = run.primitives.most_frequent(FREQUENT)
    panels = plain(figure, 2, max(len(categories), 1))
    widest = np.abs(run.primitives.displacement).max(axis=0, initial=0.0) * _EDGE
    for row in range(2):
        for column, category in enumerate(categories):
            axes = panels[row * len(categories) + column]
            _errors(axes, run, predictor, category, row, float(widest[row]) or 1.0)
            if row == 0:
                axes.set_title(sign_name(category))
                axes.tick_params(labelbottom=False)
            else:
                axes.set_xlabel("occurrence k")
            if column == 0:
                axes.set_ylabel(f"E of {_label(experiment, row)}")
            else:
                axes.tick_params(labelleft=False)
    return figure


def _errors(
    axes: Axes, run: Run, predictor: PredictorName, category: Category, row: int, edge: float
) -> None:
    members = run.primitives.of(category)
    k = run.primitives.occurrence[members]
    error = run.error(predictor)[members, row]
    colour, mark = category_style(category)
    axes.axvspan(0.5, N_INIT + 0.5, color="#eeeeee", zorder=0)
    axes.axhline(0.0, color=_GREY, linewidth=0.8)
    inside = np.abs(error) <= edge
    axes.plot(k, np.clip(error, -edge, edge), color=colour, linewidth=0.7, alpha=0.6)
    axes.plot(k[inside], error[inside], mark, color=colour, markersize=3.5, linestyle="none")
    for sign, pointing in ((1.0, "^"), (-1.0, "v")):
        beyond: npt.NDArray[np.bool_] = sign * error > edge
        axes.plot(
            k[beyond],
            np.full(beyond.sum(), sign * edge),
            pointing,
            color=_BEYOND,
            markersize=6,
            linestyle="none",
            clip_on=False,
            in_layout=False,  # an empty line that is not clipped has no finite size
        )
        for at, value in zip(k[beyond], error[beyond], strict=True):
            axes.annotate(
                f"{value:.3g}",
                (at, sign * edge),
                (0, -9 * sign),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=7,
                color=_BEYOND,
                in_layout=False,
            )
    axes.set_ylim(-edge * 1.05, edge * 1.05)
    axes.set_xlim(0.0, max(len(members), N_INIT) + 1.0)


def _zoom(axes: Axes, seen: FloatArray, said: FloatArray) -> int:
    """Fit the axes to what happened; return how many estimates lie outside."""
    if not len(seen):
        return 0
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = np.maximum(0.25 * (high - low), [2.0, 0.01])
    low, high = low - room, high + room
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    return int(np.sum(np.any((said < low) | (said > high), axis=1)))


def _plane(axes: Axes, experiment: Experiment) -> None:
    axes.set_xlabel(_label(experiment, 0))
    axes.set_ylabel(_label(experiment, 1))


def _label(experiment: Experiment, i: int) -> str:
    return f"{experiment.actuators[i]} q{i + 1} [{experiment.units[i]}]"
