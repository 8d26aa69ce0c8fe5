"""What the paper's figures share: style, colours and marks of the categories, saving."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rampe_guard.core.types import Category
from rampe_guard.evaluate.extra import missing

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
except ImportError as error:
    raise missing(error) from error

__all__ = ["Axes", "Figure", "Line2D", "category_style", "new_figure", "plain", "save", "style"]

# Okabe and Ito: told apart by every kind of eye; the marks say the same without colour
_COLOURS: dict[Category, str] = {
    (-1, -1): "#0072b2",
    (-1, 0): "#d55e00",
    (-1, 1): "#009e73",
    (0, -1): "#cc79a7",
    (0, 1): "#56b4e9",
    (1, -1): "#e69f00",
    (1, 0): "#7f7f00",
    (1, 1): "#8b1a1a",
}
_MARKS: dict[Category, str] = {
    (-1, -1): "v",
    (-1, 0): "<",
    (-1, 1): "^",
    (0, -1): "s",
    (0, 1): "D",
    (1, -1): "P",
    (1, 0): ">",
    (1, 1): "o",
}
_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "svg.hashsalt": "rampe-guard",  # the same run gives the same bytes
}
_DPI = 160


def category_style(category: Category) -> tuple[str, str]:
    """Colour and mark of a category of two actuators."""
    return _COLOURS.get(category, "#555555"), _MARKS.get(category, ".")


@contextmanager
def style() -> Iterator[None]:
    """Everything drawn and saved within is in the common style, whatever the user's is."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that can be drawn without a display."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plain(figure: Figure, rows: int, columns: int) -> Sequence[Axes]:
    """``rows`` by ``columns`` axes, row by row."""
    axes: list[Axes] = list(figure.subplots(rows, columns, squeeze=False).ravel())
    return axes


def save(figure: Figure, folder: Path, name: str) -> None:
    """Write ``name``.png and ``name``.svg into ``folder``."""
    figure.savefig(folder / f"{name}.png", dpi=_DPI, metadata={"Software": None})
    figure.set_layout_engine("none")  # laid out by now; doing it again takes as long as drawing
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
