"""`prediction.png`: errors, learning, reliability and coverage on one sheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rampe_guard.evaluate.calibration import Reliability
from rampe_guard.evaluate.extra import missing
from rampe_guard.evaluate.prediction import MEAN, PROCESS, RAMPE, ZERO, Calibration, Prediction
from rampe_guard.evaluate.prediction_score import KNOWN, CurvePoint

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import PercentFormatter
except ModuleNotFoundError as error:
    raise missing(error) from error

_INK, _GREY, _LIGHT = "#222222", "#8a8a8a", "#c9cdd2"
_OURS = "#c1440e"
_ACTUATORS = ("#1f77b4", "#2a9d8f", "#8e6bbf", "#b8860b", "#5b7083", "#a14a76")
_CURVES = {
    MEAN: ("#8a8a8a", "s"),
    PROCESS: ("#1f77b4", "^"),
    "RLS of river": ("#2a9d8f", "v"),
    "RAMPE, faithful": ("#e0a080", "D"),
    RAMPE: (_OURS, "o"),
}
_MOST = 1.5
"""Errors above this many times that of predicting no motion run off the axes."""
_FEW = 20
"""Bins with fewer answers are not drawn: their share is chance."""


def draw(prediction: Prediction, names: Sequence[str], title: str, path: Path) -> None:
    """Write the sheet as a PNG.

    Args:
        prediction: what was measured.
        names: of the actuators (n).
        title: of the sheet.
        path: of the PNG file.
    """
    figure = Figure(figsize=(13.0, 9.6), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, ha="left")
    axes = figure.subplots(2, 2)
    _bars(axes[0, 0], prediction)
    _curve(axes[0, 1], prediction.curve)
    _reliability(axes[1, 0], prediction.calibration, names)
    _coverage(axes[1, 1], prediction.calibration, names)
    for panel in axes.flat:
        panel.spines[["top", "right"]].set_visible(False)
    figure.savefig(path)


def _bars(axes: Axes, prediction: Prediction) -> None:
    known = prediction.total.known or prediction.total.everything
    names = list(known)
    at = np.arange(len(names))
    values = np.array([known[n].error for n in names])
    low = np.array([known[n].spread.low for n in names])
    high = np.array([known[n].spread.high for n in names])
    whiskers = np.maximum([values - low, high - values], 0.0)
    colours = [_OURS if n == RAMPE else _LIGHT for n in names]
    axes.barh(at - 0.08, values, 0.5, color=colours, xerr=whiskers, ecolor=_INK, capsize=3)
    everything = [prediction.total.everything[n].error for n in names]
    axes.barh(at + 0.27, everything, 0.16, color=_GREY)
    room = 1.03 * min(max(float(high.max()), *everything), _MOST * known[ZERO].error)
    room = room or 1.0  # nobody erred: nothing moved
    for y, value in zip(at.tolist(), values.tolist(), strict=True):
        text = f"{value:.3f}" if value < room else f"→ {value:.3f}"
        axes.text(room * 1.01, y, text, va="center", fontsize=9, color=_INK)
    axes.set_yticks(at, names)
    axes.invert_yaxis()
    axes.set_xlim(0.0, room)
    counted = prediction.total.primitives_known
    which = f"{counted} primitives of categories seen at least {KNOWN} times before"
    if not prediction.total.known:
        which = f"all {prediction.total.primitives} primitives, no category was seen {KNOWN} times"
    axes.set_title(f"Error of the next displacement\n{which}", loc="left", fontsize=10)
    axes.set_xlabel("error [share of the range]; whiskers: 95 % bootstrap; thin: all primitives")


def _curve(axes: Axes, curve: Sequence[CurvePoint]) -> None:
    at = np.arange(len(curve))
    for name, (colour, marker) in _CURVES.items():
        values = [p.errors[name] for p in curve]
        width = 2.4 if name == RAMPE else 1.4
        axes.plot(at, values, color=colour, marker=marker, markersize=5, lw=width, label=name)
    axes.set_xticks(at, [f"{_bin(p)}\n({p.primitives})" for p in curve], fontsize=8)
    most = _MOST * max(p.errors[ZERO] for p in curve)
    top = 1.08 * max(p.errors[name] for p in curve for name in _CURVES)
    axes.set_ylim(0.0, min(top, most) or 1.0)
    axes.set_title("Error against experience", loc="left", fontsize=10)
    axes.set_xlabel("occurrences of the category before (primitives)")
    axes.set_ylabel("error [share of the range]")
    axes.legend(frameon=False, fontsize=9)
    axes.grid(axis="y", color="#eeeeee")


def _bin(point: CurvePoint) -> str:
    if point.last is None:
        return f"{point.first}+"
    return f"{point.first}" if point.last == point.first else f"{point.first}-{point.last}"


def _reliability(axes: Axes, found: Calibration, names: Sequence[str]) -> None:
    axes.plot([0, 1], [0, 1], color=_GREY, lw=1, ls="--")
    for j, (name, each) in enumerate(zip(names, found.actuators, strict=True)):
        _line(axes, each, name, _ACTUATORS[j % len(_ACTUATORS)], 1.2)
    _line(axes, found.overall, "all", _OURS, 2.6)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    answers = int(found.overall.counts.sum())
    axes.set_title(
        f"Will it pass d? Reliability inside a primitive, {RAMPE}\n{answers} answers",
        loc="left",
        fontsize=10,
    )
    axes.set_xlabel("probability said")
    axes.set_ylabel("share that passed")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize=9, title="expected calibration error")


def _line(axes: Axes, found: Reliability, name: str, colour: str, width: float) -> None:
    enough = found.counts >= _FEW
    if enough.any():
        said, happened = found.said[enough], found.happened[enough]
        label = f"{name}  {found.error:.3f}"
        axes.plot(said, happened, color=colour, lw=width, marker="o", markersize=4, label=label)


def _coverage(axes: Axes, found: Calibration, names: Sequence[str]) -> None:
    labels = [*names, "all"]
    at = np.arange(len(labels))
    size = 0.8 / len(found.coverage)
    for k, covered in enumerate(found.coverage):
        values = np.append(covered.actuators, covered.overall)
        x = at + (k - (len(found.coverage) - 1) / 2) * size
        colours = [_LIGHT] * len(names) + [_OURS]
        axes.bar(x, np.nan_to_num(values), size * 0.92, color=colours)
        axes.hlines(np.full(len(x), covered.level), x - size / 2, x + size / 2, color=_INK, lw=2)
        for xx, value in zip(x.tolist(), values.tolist(), strict=True):
            text = f"{value:.0%}" if np.isfinite(value) else "none"
            axes.text(xx, 0.02, text, ha="center", fontsize=8, color=_INK)
    counts = [*found.coverage[0].counts.tolist(), int(found.coverage[0].counts.sum())]
    axes.set_xticks(at, [f"{n}\n({c})" for n, c in zip(labels, counts, strict=True)])
    axes.set_ylim(0.0, 1.05)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    promised = " and ".join(f"{c.level:.0%}" for c in found.coverage)
    axes.set_title(
        f"Coverage of the central {promised} intervals, {RAMPE}\nline: promised",
        loc="left",
        fontsize=10,
    )
    axes.set_xlabel("actuator (displacements)")
