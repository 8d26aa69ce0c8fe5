"""The page of an evaluation: one file, from the report alone, without any outside address."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from rampe_guard.evaluate import page_charts as charts
from rampe_guard.evaluate.definitions import GUARD
from rampe_guard.evaluate.page_style import STYLE
from rampe_guard.evaluate.report_model import Interval, LogLine, Point, Report

_STRICTLY = (
    "Each alarm ends with its last cause, so that none earns credit by staying on: more alarms,"
    " more of them false, and fewer early."
)
_FIFTH = "95 % exceed"
_COLUMNS = (
    "false / min and zone",
    "≥ 0.5 s",
    "≥ 1.0 s",
    "≥ 1.5 s",
    "≥ 2.0 s",
    "median lead",
    _FIFTH,
    "missed",
    "time alarmed",
)


def page(report: Report) -> str:
    """The whole page as HTML."""
    title = f"{report.machine} at {report.site}: evaluation"
    body = (
        f"<header><h1>{escape(title)}</h1><p class='lead'>{_headline(report)}</p>{_cards(report)}"
        f"</header><main>{_trade_offs(report)}{_reliability(report)}{_leads(report)}"
        f"{_timelines(report)}{_tables(report)}{_prediction(report)}{_definitions(report)}</main>"
    )
    return (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>{body}</body></html>\n"
    )


def _headline(report: Report) -> str:
    at = report.forecasts[GUARD].operating_point
    rate, share = at.false_per_min_per_zone, at.warned_1_0_s
    if share is None or rate is None:
        return _nothing(report)
    first = (
        f"Warned at least 1 s ahead of <b>{share:.0%}</b> of {at.crossings} crossings, with"
        f" <b>{rate:.1f}</b> false alarms a minute and zone."
    )
    false = _peers(report, "false_per_min_per_zone", rate)
    told = f"{first} It was alarmed {_share(at.alarmed_share)} of the time. With no more false"
    told = f"{told} alarms, {false}."
    if at.alarmed_share is None:
        return told
    return (
        f"{told} Alarmed no more of the time, {_peers(report, 'alarmed_share', at.alarmed_share)}."
    )


def _nothing(report: Report) -> str:
    when = " while the guard monitored" if report.not_monitoring_s > 0.0 else ""
    inside = any(z.inside_at_first_s is not None for log in report.logs for z in log.zones.values())
    if inside:
        return f"No zone was entered{when} after the start, so there was nothing to warn of."
    return f"Nothing was touched in these logs{when}, so there was nothing to warn of."


def _peers(report: Report, cost: str, most: float) -> str:
    """What the baselines warn of a second ahead, each set as well as can be within a cost."""
    others = []
    for name, words in (("constant_velocity", "constant velocity"), ("proximity", "proximity")):
        best = charts.best_within(report.trade_offs[name].curve, "warned_1_0_s", most, cost)
        if best is None or best.warned_1_0_s is None:
            others.append(f"{words} cannot be had")
            continue
        rate = best.false_per_min_per_zone
        paid = (
            f"alarmed {_share(best.alarmed_share)} of the time"
            if cost != "alarmed_share"
            else f"with {_number(rate)} false"
        )
        others.append(f"{words}, set as well as can be: {best.warned_1_0_s:.0%}, {paid}")
    return "; ".join(others)


def _cards(report: Report) -> str:
    at = report.forecasts[GUARD].operating_point
    cards = [
        (f"{report.duration_s / 60:.1f} min", f"of work in {len(report.logs)} logs"),
        (str(at.crossings), f"crossings of {len(report.zones)} zones"),
        (_share(at.warned_0_5_s), "warned ≥ 0.5 s ahead"),
        (_share(at.warned_1_0_s), "warned ≥ 1 s ahead"),
        ("—" if at.median_lead_s is None else f"{at.median_lead_s:.2f} s", "median lead"),
        (str(report.published["caution"].total.missed), "without any alert before"),
    ]
    if report.not_monitoring_s > 0.0:
        meanwhile = f"NOT MONITORING; crossings meanwhile, in no figure: {at.unmonitored}"
        cards += [(f"{report.not_monitoring_s:.1f} s", meanwhile)]
    told = "".join(f"<li><b>{escape(a)}</b><span>{escape(b)}</span></li>" for a, b in cards)
    known = escape(f"Knowledge {report.knowledge}.")
    return f"<ul class='cards'>{told}</ul><p class='small'>{known}</p>"


def _trade_offs(report: Report) -> str:
    figures = (
        (charts.trade_off(report, "warned_1_0_s", "false_per_min_per_zone"), "A second ahead"),
        (charts.trade_off(report, "warned_0_5_s", "false_per_min_per_zone"), "Half a second ahead"),
        (charts.trade_off(report, "warned_1_0_s", "alarmed_share"), "Against time spent alarmed"),
    )
    return _section(
        "What warning costs",
        "Up and to the left is better. Each line is one forecaster over all its settings; whiskers"
        " are 95 % bootstrap intervals. Who is always alarmed is never false and has warned of"
        " everything: proximity with a distance so wide that the arm hardly ever leaves it comes"
        " near to that, since an alarm that lasts from one crossing to the next is one alarm, and"
        " true. Nobody would listen to it. So the third chart asks what share of the time is spent"
        " alarmed.",
        charts.trade_off_legend() + _grid(figures),
    )


def _reliability(report: Report) -> str:
    if not report.reliability:
        return ""
    figures = []
    for of in report.reliability:
        title = f"Within {of.horizon_s:g} s"
        if of.calibration_error is not None and of.calibration_error_told is not None:
            title += (
                f": calibration error {of.calibration_error:.3f}, where at least 2 % was said"
                f" {of.calibration_error_told:.3f}"
            )
        figures.append((charts.reliability(of), title))
    return _section(
        "Do probabilities mean what they say?",
        "Of all the moments at which a contact was given this probability, so many led to one."
        " On the dashed line they do.",
        _grid(figures),
    )


def _leads(report: Report) -> str:
    return _section(
        "How early",
        "Share of all crossings for which the guard's published alert, at each level, had been"
        " there for at least so long.",
        _grid([(charts.leads(report), "Lead times by level")]),
    )


def _timelines(report: Report) -> str:
    key = (
        "<p class='legend'><span><i class='key contact'></i>contact</span>"
        "<span><i class='key true-alarm'></i>alarm that a contact followed</span>"
        "<span><i class='key false-alarm'></i>&times; false alarm</span>"
        "<span><i class='key undecided-alarm'></i>undecided at the end</span></p>"
    )
    if report.not_monitoring_s > 0.0:
        key += "<p class='legend'><span><i class='key blind'></i>not monitoring</span></p>"
    rows = "".join(
        f"<h3>{escape(log.log)}</h3>{_inside(log)}<div class='wide'>{charts.timeline(log)}</div>"
        for log in report.logs
    )
    return _section("Every log", "The guard at its operating point.", key + rows)


def _inside(log: LogLine) -> str:
    told = ", ".join(
        f"{zone} ({line.inside_at_first_s:.1f} s)"
        for zone, line in log.zones.items()
        if line.inside_at_first_s is not None
    )
    words = f"Inside from the start, which counts as no crossing: {told}."
    return f"<p>{escape(words)}</p>" if told else ""


def _tables(report: Report) -> str:
    forecasts = _table(
        "forecaster",
        [(name, f.operating_point) for name, f in report.forecasts.items()],
        GUARD,
    )
    strict = _table(
        "forecaster",
        [(name, f.operating_point) for name, f in report.forecasts.items()],
        GUARD,
        strict=True,
    )
    parts = [
        f"<h3>At the site's settings</h3>{forecasts}",
        f"<h3>The same, strictly</h3><p>{escape(_STRICTLY)}</p>{strict}",
    ]
    for level, table in report.published.items():
        rows = [("all zones", table.total), *table.zones.items()]
        text = escape(f"Published alerts, {level}{'' if level == 'imminent' else ' or above'}")
        parts.append(f"<h3>{text}</h3>{_table('zone', rows, 'all zones')}")
    logs = list(report.forecasts[GUARD].by_log.items())
    parts.append(f"<h3>The guard, log by log</h3>{_table('log', logs)}")
    return _section("Figures", "In small print: 95 % bootstrap intervals.", "".join(parts))


def _prediction(report: Report) -> str:
    return _section(
        "The next displacement",
        "How far off each forecaster was of where the primitive under way would end.",
        _grid([(charts.errors(report), "Error")]),
    )


def _definitions(report: Report) -> str:
    words = {**report.definitions}
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in words.items())
    items += "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(f.description)}</dd>"
        for name, f in report.forecasts.items()
    )
    versions = ", ".join(f"{name} {found}" for name, found in report.versions.items())
    out = ""
    if report.zones_left_out:
        out = f"<p>Not judged, since they move: {escape(', '.join(report.zones_left_out))}.</p>"
    return _section("Words", "", f"<dl>{items}</dl>{out}<p class='small'>{escape(versions)}</p>")


def _section(title: str, text: str, content: str) -> str:
    intro = f"<p>{escape(text)}</p>" if text else ""
    return f"<section><h2>{escape(title)}</h2>{intro}{content}</section>"


def _grid(figures: Iterable[tuple[str, str]]) -> str:
    told = "".join(
        f"<figure><figcaption>{escape(name)}</figcaption>{svg}</figure>" for svg, name in figures
    )
    return f"<div class='grid'>{told}</div>"


def _table(
    first: str, rows: Sequence[tuple[str, Point]], strong: str = "", *, strict: bool = False
) -> str:
    columns = [name for name in _COLUMNS if not (strict and name == _FIFTH)]
    head = "".join(f"<th>{escape(name)}</th>" for name in (first, *columns))
    body = "".join(
        f"<tr{' class=strong' if name == strong else ''}><th>{escape(name)}</th>"
        f"{_strict_cells(at) if strict else _cells(at)}</tr>"
        for name, at in rows
    )
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f"<div class='wide'>{table}</div>"


def _cells(at: Point) -> str:
    of = at.intervals
    cells = [
        (_number(at.false_per_min_per_zone), _range(of.false_per_min_per_zone if of else None)),
        (_share(at.warned_0_5_s), _shares(of.warned_0_5_s if of else None)),
        (_share(at.warned_1_0_s), _shares(of.warned_1_0_s if of else None)),
        (_share(at.warned_1_5_s), _shares(of.warned_1_5_s if of else None)),
        (_share(at.warned_2_0_s), _shares(of.warned_2_0_s if of else None)),
        (_number(at.median_lead_s, " s"), _range(of.median_lead_s if of else None)),
        (_number(at.lead_5_percent_s, " s"), _range(of.lead_5_percent_s if of else None)),
        (f"{at.missed} of {at.crossings}", ""),
        (_share(at.alarmed_share), ""),
    ]
    return "".join(
        f"<td>{escape(value)}{f'<small>{small}</small>' if small else ''}</td>"
        for value, small in cells
    )


def _strict_cells(at: Point) -> str:
    of = at.strict
    if of is None:
        return ""
    cells = (
        _number(of.false_per_min_per_zone),
        _share(of.warned_0_5_s),
        _share(of.warned_1_0_s),
        _share(of.warned_1_5_s),
        _share(of.warned_2_0_s),
        _number(of.median_lead_s, " s"),
        f"{of.missed} of {at.crossings}",
        _share(of.alarmed_share),
    )
    return "".join(f"<td>{escape(value)}</td>" for value in cells)


def _number(value: float | None, unit: str = "") -> str:
    return "—" if value is None else f"{value:.2f}{unit}"


def _share(value: float | None) -> str:
    return "—" if value is None else f"{value:.0%}"


def _range(around: Interval) -> str:
    return "" if around is None else f"{around[0]:.2f} to {around[1]:.2f}"


def _shares(around: Interval) -> str:
    return "" if around is None else f"{around[0]:.0%} to {around[1]:.0%}"
