"""Small charts as inline SVG: axes, lines, marks and words; colours are classes of the page.

Everything that is drawn has a word or a shape beside its colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Final, Literal

Mark = Literal["disc", "square", "diamond", "triangle", "cross"]
_SHAPES: Final[dict[Mark, str]] = {
    "disc": "M-1,0a1,1 0 1,0 2,0a1,1 0 1,0 -2,0z",
    "square": "M-.9,-.9h1.8v1.8h-1.8z",
    "diamond": "M0,-1.25L1.25,0L0,1.25L-1.25,0z",
    "triangle": "M0,-1.2L1.15,.9L-1.15,.9z",
    "cross": "M-1,-1L1,1M-1,1L1,-1",
}


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis: its range, where it has ticks, their words, and what it is."""

    low: float
    high: float
    ticks: Sequence[tuple[float, str]]
    title: str


@dataclass(slots=True)
class Chart:
    """One chart; draw on it, then `render`.

    Attributes:
        title: read out to who cannot see it.
        x, y: axes.
        width, height: of the view box.
    """

    title: str
    x: Axis
    y: Axis
    width: float = 620.0
    height: float = 420.0
    left: float = 68.0
    right: float = 26.0
    top: float = 36.0
    bottom: float = 56.0
    _parts: list[str] = field(default_factory=list)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Place of a point of the data in the view box."""
        across = (x - self.x.low) / (self.x.high - self.x.low)
        up = (y - self.y.low) / (self.y.high - self.y.low)
        room = self.width - self.left - self.right
        return (
            self.left + across * room,
            self.height - self.bottom - up * (self.height - self.top - self.bottom),
        )

    def line(self, points: Sequence[tuple[float, float]], style: str) -> None:
        """A line through points of the data."""
        if len(points) > 1:
            path = "L".join(f"{x:.1f},{y:.1f}" for x, y in (self.at(*p) for p in points))
            self._parts.append(f'<path class="line {style}" d="M{path}"/>')

    def mark(self, point: tuple[float, float], shape: Mark, style: str, size: float = 5.0) -> None:
        """A mark at a point of the data."""
        x, y = self.at(*point)
        self._parts.append(
            f'<path class="mark {style}" d="{_SHAPES[shape]}"'
            f' transform="translate({x:.1f},{y:.1f}) scale({size:g})"/>'
        )

    def whiskers(
        self,
        point: tuple[float, float],
        across: tuple[float, float] | None,
        up: tuple[float, float] | None,
        style: str,
    ) -> None:
        """Intervals of a point of the data, along both axes."""
        if across is not None:
            self.line([(self._held(across[0]), point[1]), (self._held(across[1]), point[1])], style)
        if up is not None:
            self.line([(point[0], up[0]), (point[0], up[1])], style)

    def words(
        self,
        point: tuple[float, float],
        text: str,
        style: str = "",
        anchor: str = "start",
        shift: tuple[float, float] = (8.0, 4.0),
    ) -> None:
        """Words beside a point of the data."""
        x, y = self.at(*point)
        self._parts.append(
            f'<text class="{style}" x="{x + shift[0]:.1f}" y="{y + shift[1]:.1f}"'
            f' text-anchor="{anchor}">{escape(text)}</text>'
        )

    def box(self, low: tuple[float, float], high: tuple[float, float], style: str) -> None:
        """A filled box between two points of the data."""
        (x0, y0), (x1, y1) = self.at(*low), self.at(*high)
        self._parts.append(
            f'<rect class="{style}" x="{min(x0, x1):.1f}" y="{min(y0, y1):.1f}"'
            f' width="{max(abs(x1 - x0), 1.0):.1f}" height="{abs(y1 - y0):.1f}"/>'
        )

    def render(self) -> str:
        """The chart as an ``svg`` element."""
        grid = [self._tick_x(value, text) for value, text in self.x.ticks]
        grid += [self._tick_y(value, text) for value, text in self.y.ticks]
        names = (
            f'<text class="name" x="{self.width - self.right:.0f}" y="{self.height - 10:.0f}"'
            f' text-anchor="end">{escape(self.x.title)}</text>'
            f'<text class="name" x="6" y="18">{escape(self.y.title)}</text>'
        )
        return (
            f'<svg viewBox="0 0 {self.width:g} {self.height:g}" role="img"'
            f' aria-label="{escape(self.title)}">{"".join(grid)}{names}{"".join(self._parts)}</svg>'
        )

    def _held(self, x: float) -> float:
        return min(max(x, self.x.low), self.x.high)

    def _tick_x(self, value: float, text: str) -> str:
        x, bottom = self.at(value, self.y.low)
        return (
            f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{self.top:g}" y2="{bottom:.1f}"/>'
            f'<text class="tick" x="{x:.1f}" y="{bottom + 18:.1f}" text-anchor="middle">'
            f"{escape(text)}</text>"
        )

    def _tick_y(self, value: float, text: str) -> str:
        left, y = self.at(self.x.low, value)
        return (
            f'<line class="grid" x1="{left:.1f}" x2="{self.width - self.right:g}" y1="{y:.1f}"'
            f' y2="{y:.1f}"/><text class="tick" x="{left - 7:.1f}" y="{y + 4.5:.1f}"'
            f' text-anchor="end">{escape(text)}</text>'
        )


def percent_axis(title: str) -> Axis:
    """From 0 to 100 %."""
    return Axis(0.0, 1.0, [(k / 5, f"{k * 20} %") for k in range(6)], title)


def number_axis(high: float, title: str, unit: str = "") -> Axis:
    """From 0 to a number, with four to eight round ticks."""
    high = max(high, 1e-6)
    step = 1e-6
    while high / step > 8:  # noqa: PLR2004
        step *= 2.5 if f"{step:e}"[0] == "2" else 2
    count = int(high / step + 1e-9)
    return Axis(0.0, high, [(k * step, f"{k * step:g}{unit}") for k in range(count + 1)], title)
