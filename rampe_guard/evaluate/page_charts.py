"""The charts of the page of an evaluation, each from the report alone."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Final

from rampe_guard.evaluate.definitions import GUARD, SPARING
from rampe_guard.evaluate.report_model import LogLine, Point, ReliabilityOf, Report
from rampe_guard.evaluate.svg import Axis, Chart, Mark, number_axis, percent_axis

LEADS: Final = ("warned_0_5_s", "warned_1_0_s", "warned_1_5_s", "warned_2_0_s")
_MOST_FALSE = 6.0
_FAMILIES: Final[dict[str, tuple[str, str, Mark]]] = {
    "constant_velocity": ("constant velocity", "velocity", "triangle"),
    "proximity": ("proximity", "proximity", "square"),
}
_OTHERS: Final[dict[str, tuple[str, str, Mark]]] = {
    "rampe_primitive": ("RAMPE, this primitive", "primitive", "diamond"),
    "running_mean": ("running mean", "usual", "diamond"),
    "stopping": ("stopping only", "stopping", "cross"),
}
_LEVELS: Final[dict[str, tuple[str, str]]] = {
    "caution": ("caution or above", "caution"),
    "warning": ("warning or above", "warning"),
    "imminent": ("imminent", "imminent"),
}


def trade_off(report: Report, lead: str, against: str) -> str:
    """Coverage at one lead against a cost, ``false_per_min_per_zone`` or ``alarmed_share``."""
    seconds = lead.removeprefix("warned_").removesuffix("_s").replace("_", ".")
    up = percent_axis(f"crossings warned ≥ {seconds} s ahead")
    if against == "alarmed_share":
        across = percent_axis("share of the time outside contact that an alarm is on")
    else:
        every = [p for f in report.forecasts.values() for p in f.curve]
        every += [p for t in report.trade_offs.values() for p in t.curve]
        most = max((p.false_per_min_per_zone or 0.0 for p in every), default=1.0)
        across = number_axis(min(most * 1.05, _MOST_FALSE), "false alarms per minute and zone")
    chart = Chart(f"{up.title} against {across.title}", across, up)
    for name, (_, style, shape) in _FAMILIES.items():
        points = _points(report.trade_offs[name].curve, lead, against, across)
        chart.line(points, style)
        for point in points[4::5]:
            chart.mark(point, shape, style, 3.5)
    for name, (_, style, shape) in _OTHERS.items():
        forecast = report.forecasts[name]
        points = _points(forecast.curve, lead, against, across)
        chart.line(points, style)
        for point in _points([forecast.operating_point], lead, against, across):
            chart.mark(point, shape, style, 5.0)
    sparing = report.forecasts[SPARING]
    chart.line(_points(sparing.curve, lead, against, across), "guard thin")
    guard = report.forecasts[GUARD]
    chart.line(_points(guard.curve, lead, against, across), "guard")
    for point in _points([guard.operating_point], lead, against, across):
        around = guard.operating_point.intervals
        if around is not None:
            level = getattr(around, lead)
            rate = around.false_per_min_per_zone if against != "alarmed_share" else None
            chart.whiskers(point, rate, level, "guard thin")
        chart.mark(point, "disc", "guard", 7.0)
    return chart.render()


def trade_off_legend() -> str:
    """Names of what `trade_off` draws."""
    entries: list[tuple[str, str, Mark]] = [
        (
            "guard (mark: as the site has set it; thin: with imminent_probability 1)",
            "guard",
            "disc",
        ),
        *_FAMILIES.values(),
        *_OTHERS.values(),
    ]
    return _legend(entries)


def reliability(of: ReliabilityOf) -> str:
    """Probability said against share that came true."""
    chart = Chart(
        f"reliability within {of.horizon_s:g} s",
        percent_axis(f"probability said of contact within {of.horizon_s:g} s"),
        percent_axis("came true"),
        width=420.0,
        height=400.0,
    )
    chart.line([(0.0, 0.0), (1.0, 1.0)], "ideal")
    chart.line([(b.said, b.happened) for b in of.bins], "guard")
    for b in of.bins:
        chart.whiskers((b.said, b.happened), None, b.happened_interval, "guard thin")
        chart.mark((b.said, b.happened), "disc", "guard", 4.0)
    return chart.render()


def leads(report: Report) -> str:
    """Share of crossings warned at least so long before, by published level."""
    across = number_axis(4.0, "at least so long before the crossing [s]")
    chart = Chart("lead times by level", across, percent_axis("share of all crossings"))
    for place, (level, (words, style)) in enumerate(_LEVELS.items()):
        told = report.published[level].leads_s
        known = sorted(lead for lead in told if lead is not None)
        if not known:
            continue
        steps: list[tuple[float, float]] = [(0.0, len(known) / len(told))]
        for index, lead in enumerate(known):
            left = (len(known) - index) / len(told)
            steps += [(min(lead, 4.0), left), (min(lead, 4.0), left - 1 / len(told))]
            if lead >= across.high:
                break
        chart.line([(x, max(y, 0.0)) for x, y in steps], style)
        chart.words((2.35, 0.95 - 0.075 * place), words, f"strong {style}")
        chart.line([(2.1, 0.963 - 0.075 * place), (2.3, 0.963 - 0.075 * place)], style)
    return chart.render()


def timeline(log: LogLine) -> str:
    """Zones as rows, time across; contacts, and alarms true and false."""
    zones = list(log.zones)
    row = 26.0
    width = 1180.0
    step = 30.0 if log.duration_s > 150.0 else 10.0  # noqa: PLR2004
    ticks = [(k * step, f"{k * step:g} s") for k in range(int(log.duration_s / step) + 1)]
    chart = Chart(
        f"timeline of {log.log}",
        Axis(0.0, max(log.duration_s, 1.0), ticks, ""),
        Axis(0.0, float(len(zones)), [], ""),
        width=width,
        height=row * len(zones) + 34.0,
        left=112.0,
        top=4.0,
        bottom=30.0,
    )
    for start, end in log.not_monitoring:
        until = log.duration_s if end is None else end - log.start_s
        first, last = (min(max(at, 0.0), log.duration_s) for at in (start - log.start_s, until))
        chart.box((first, 0.0), (last, float(len(zones))), "blind")
    for index, zone in enumerate(zones):
        base = len(zones) - 1 - index
        chart.words((0.0, base + 0.36), zone, "row", "end", (-8.0, 0.0))
        chart.line([(0.0, base + 0.5), (log.duration_s, base + 0.5)], "rail")
        told = log.zones[zone]
        for start, end, verdict in told.alarms:
            first = max(start - log.start_s, 0.0)
            last = log.duration_s if end is None else min(end - log.start_s, log.duration_s)
            if verdict == "false":
                chart.box((first, base + 0.38), (last, base + 0.62), "false-alarm")
                chart.mark((first, base + 0.8), "cross", "false-mark", 3.0)
            else:
                chart.box((first, base + 0.30), (last, base + 0.70), f"{verdict}-alarm")
        for entered, left in told.contacts:
            out = log.duration_s if left is None else left - log.start_s
            chart.box((entered - log.start_s, base + 0.12), (out, base + 0.88), "contact")
    return chart.render()


def errors(report: Report) -> str:
    """Errors of the next displacement, as bars."""
    found = sorted(report.prediction.values(), key=lambda e: e.rms)
    most = max([e.rms_interval[1] if e.rms_interval else e.rms for e in found], default=1.0)
    across = number_axis(min(most, 1.0) * 1.1, "root mean square error, share of the range")
    chart = Chart(
        "errors of the next displacement",
        across,
        Axis(0.0, float(len(found)), [], ""),
        height=30.0 * len(found) + 66.0,
        left=210.0,
        top=8.0,
    )
    for index, error in enumerate(found):
        base = len(found) - 1 - index
        style = "bar ours" if error.name == "RAMPE" else "bar"
        end = min(error.rms, across.high)
        chart.box((0.0, base + 0.2), (end, base + 0.8), style)
        chart.whiskers((end, base + 0.5), error.rms_interval, None, "thin ink")
        chart.words((0.0, base + 0.36), error.name, "row", "end", (-8.0, 0.0))
        chart.words((0.0, base + 0.36), f"{error.rms:.3f}", "on-bar", "start", (8.0, 0.0))
    return chart.render()


def best_within(
    curve: Sequence[Point], lead: str, most: float, cost: str = "false_per_min_per_zone"
) -> Point | None:
    """The point of a curve with the best coverage at no more of a cost; None without any."""
    fit = [
        p
        for p in curve
        if getattr(p, cost) is not None
        and getattr(p, cost) <= most
        and getattr(p, lead) is not None
    ]
    return max(fit, key=lambda p: getattr(p, lead), default=None)


def _points(
    curve: Sequence[Point], lead: str, against: str, across: Axis
) -> list[tuple[float, float]]:
    pairs = [(getattr(p, against), getattr(p, lead)) for p in curve]
    return [(x, y) for x, y in pairs if x is not None and y is not None and x <= across.high]


def _legend(entries: Sequence[tuple[str, str, Mark]]) -> str:
    parts = []
    for words, style, shape in entries:
        chart = Chart(words, Axis(0.0, 1.0, [], ""), Axis(0.0, 1.0, [], ""), 34, 16, 2, 2, 2, 2)
        chart.line([(0.0, 0.5), (1.0, 0.5)], style)
        chart.mark((0.5, 0.5), shape, style, 4.5)
        parts.append(f"<span>{chart.render()}{escape(words)}</span>")
    return f'<p class="legend">{"".join(parts)}</p>'
