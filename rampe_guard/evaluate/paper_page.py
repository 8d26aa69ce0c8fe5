"""The page: one HTML file with everything in it, computed numbers and verdicts only.

Nothing is fetched from anywhere: the figures are embedded, and there is no script.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.paper_claims import SHARE_OF_RUNS, Claim, Condition
from rampe_guard.evaluate.paper_estimates import MODES, N_INIT, PREDICTORS, TOL
from rampe_guard.evaluate.paper_report import Experiment, FigureFile, Report, sign_name
from rampe_guard.evaluate.paper_table import LAST, CategoryRow, ErrorQuantiles

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
  max-width: 66rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.25rem; margin-top: 2.5rem; }
h3 { font-size: 1rem; margin: 1.8rem 0 .4rem; }
table { border-collapse: collapse; font-size: .875rem; margin: 0 0 1.2rem; }
div.wide { overflow-x: auto; }
th, td { padding: .3rem .7rem .3rem 0; text-align: right; vertical-align: top;
  border-bottom: 1px solid #e2e2e2; white-space: nowrap; }
th { font-weight: 600; color: #555; } th:first-child, td:first-child { text-align: left; }
td.text { white-space: normal; min-width: 18rem; }
figure { margin: 1.8rem 0; } figure img { max-width: 100%; height: auto; }
figcaption { color: #555; font-size: .875rem; }
.verdict { font-weight: 600; } .note { color: #555; font-size: .875rem; }
"""


def page(report: Report, figures: Sequence[tuple[FigureFile, bytes]]) -> str:
    """The whole page as HTML.

    Args:
        report: all numbers.
        figures: each with its SVG.
    """
    parts = [
        "<h1>RAMPE: the engineering test of Section IV-B, reproduced</h1>",
        *_experiment(report),
        *_claims(report),
        *_limits(report),
        *_quantiles(report),
        "<h2>Figures</h2>",
        f"<p>Drawn from the first run, seed {report.seeds[0]}.</p>",
        *(_figure(file, svg) for file, svg in figures),
        *_tables(report),
    ]
    body = "\n".join(parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>RAMPE, engineering test</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _experiment(report: Report) -> Iterable[str]:
    done = report.experiment
    ways = " → ".join(done.way)
    ranges = " and ".join(
        f"{span:.3g} {escape(unit)} of {escape(name)}"
        for name, unit, span in zip(done.actuators, done.units, done.span, strict=True)
    )
    yield (
        f"<p>A simulated hydraulic arm with two actuators, swing q1 [deg] and boom cylinder q2"
        f" [m], is driven by a simulated operator with a joystick: {escape(ways)},"
        f" {done.cycles} cycles a run. The arm has dead time, lag, limited acceleration, a dead"
        " zone and sensor noise. The operator aims with scatter, pushes each lever as hard as it"
        " comes, foresees the stop only roughly and corrects what came out too far off; his"
        " levers seldom come to rest together. Categories and primitives are found by the"
        " detector and tracker that the guard itself uses.</p>"
    )
    yield (
        f"<p>{len(report.seeds)} runs (seeds {escape(_seeds(report.seeds))}),"
        f" {done.minutes:.0f} simulated minutes, {report.primitives} primitives,"
        f" {done.corrections} corrections. Every estimate is made from the start of a primitive"
        f" and the earlier primitives of its category, before the true displacement is shown."
        f" E = x \N{MINUS SIGN} x̂.</p>"
    )
    yield (
        "<ul>"
        f"<li><b>faithful</b>: the paper. Regressor [q1, q2, 1] in degrees and metres, x̂ = 0 for"
        f" the first {N_INIT} occurrences, pseudo-inverse with tolerance {TOL:g} (relative).</li>"
        "<li><b>default</b>: what the guard uses, with its settings as they come. It begins from a"
        " prior on scaled positions, estimates as soon as it can, and never goes against the sign"
        " of the category nor past a limit.</li>"
        "<li><b>running mean</b>: the mean displacement of the category, wherever it began.</li>"
        f"</ul><p>Shares of the range are of {ranges}: the span of the targets.</p>"
    )


def _claims(report: Report) -> Iterable[str]:
    yield "<h2>The paper's claims</h2>"
    yield (
        "<p>Each claim is put as conditions with limits that are part of the program. A condition"
        f" is met when at least {SHARE_OF_RUNS:.0%} of the runs that can show it keep the limit."
        " A claim holds when all of its conditions are met, and in part when some are. Numbers are"
        " the median over the runs (least to most), then the share of runs within the limit.</p>"
    )
    for number, found in enumerate(zip(*(report.claims[m] for m in MODES), strict=True), 1):
        yield f"<h3>{number}. {escape(found[0].text)}</h3>"
        yield f"<p>{' · '.join(_verdict(m, c) for m, c in zip(MODES, found, strict=True))}</p>"
        heads = ["measured", "limit", *(h for m in MODES for h in (m, "runs"))]
        rows = []
        for conditions in zip(*(claim.conditions for claim in found), strict=True):
            first = conditions[0]
            cells = [cell for c in conditions for cell in _condition(c)]
            limit = f"{'&gt;' if first.above else '≤'} {first.limit:g}"
            rows.append([escape(first.name), limit, *cells])
        yield _table(heads, rows, text_columns=1)


def _limits(report: Report) -> Iterable[str]:
    yield "<h3>Where the error is</h3>"
    lines = [
        f"<li>{mode}: {sign_name(category)} bears {part:.1%} of the squared error.</li>"
        for mode in MODES
        for category, part in list(report.squared[mode].items())[:1]
    ]
    lines += [
        f"<li>In {count} of {len(report.seeds)} runs {sign_name(category)} goes two ways from one"
        " place. Position and category cannot tell these apart (the tangent paths of Fig. 2).</li>"
        for category, count in report.two_ways.items()
    ]
    lines += [
        f"<li>The default said of {sign_name(category)} that it has two futures, and not one, in"
        f" {said} of {total} forecasts.</li>"
        for category, (said, total) in report.two_futures.items()
    ]
    yield "<ul>" + "".join(lines or ["<li>Nothing to show.</li>"]) + "</ul>"


def _verdict(mode: str, claim: Claim) -> str:
    return f'{mode}: <span class="verdict">{claim.verdict.value}</span>'


def _condition(condition: Condition) -> tuple[str, str]:
    shown = condition.shown
    if condition.share is None:
        return "no run shows it", "\N{EN DASH}"
    mark = "met" if condition.met else "not met"
    values = f"{np.median(shown):.3g} ({shown.min():.3g} to {shown.max():.3g})"
    return values, f"{condition.share:.0%} of {shown.size}, {mark}"


def _quantiles(report: Report) -> Iterable[str]:
    yield "<h2>Size of the error</h2>"
    yield (
        f"<p>|E| as a share of the range (root mean square over the actuators), all"
        f" {len(report.seeds)} runs.</p>"
    )
    heads = ["after initialising", "median", "p90", "p99", "largest", "primitives"]
    yield _table(heads, [[p, *_quantile_cells(report.quantiles[p])] for p in PREDICTORS])
    heads[0] = "all occurrences"
    yield _table(heads, [[p, *_quantile_cells(report.quantiles_all[p])] for p in PREDICTORS])


def _quantile_cells(q: ErrorQuantiles) -> list[str]:
    return [*(_number(v) for v in (q.median, q.p90, q.p99, q.largest)), str(q.count)]


def _figure(file: FigureFile, svg: bytes) -> str:
    data = base64.b64encode(svg).decode("ascii")
    caption = escape(file.caption)
    return (
        f'<figure id="{escape(file.name)}"><img alt="{escape(file.title)}: {caption}"'
        f' src="data:image/svg+xml;base64,{data}">'
        f"<figcaption><b>{escape(file.title)}.</b> {caption}</figcaption></figure>"
    )


def _tables(report: Report) -> Iterable[str]:
    yield "<h2>Per category</h2>"
    yield (
        f"<p>RMS of x, of E after the first {N_INIT} occurrences, and of E over the last {LAST} of"
        " each run. A category names the sign of each actuator.</p>"
    )
    yield f"<h3>All {len(report.seeds)} runs</h3>"
    yield _category_table(report.every, report.experiment)
    yield f"<h3>First run, seed {report.seeds[0]}</h3>"
    yield _category_table(report.first, report.experiment)


def _category_table(rows: Sequence[CategoryRow], done: Experiment) -> str:
    heads = ["category", "occurrences", "actuator", "RMS x"]
    heads += [f"{p}: {what}" for p in MODES for what in ("RMS E", f"last {LAST}")]
    cells = []
    for row in rows:
        for i, (name, unit) in enumerate(zip(done.actuators, done.units, strict=True)):
            first = [sign_name(row.category), str(row.occurrences)] if i == 0 else ["", ""]
            errors = [_of(e[p], i) for p in MODES for e in (row.rms_error, row.rms_last)]
            actuator = escape(f"{name} [{unit}]")
            cells.append([*first, actuator, _number(row.rms_displacement[i]), *errors])
    return _table(heads, cells)


def _of(values: FloatArray | None, i: int) -> str:
    return "\N{EN DASH}" if values is None else _number(float(values[i]))


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "\N{EN DASH}"


def _seeds(seeds: Sequence[int]) -> str:
    return str(seeds[0]) if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], text_columns: int = 0) -> str:
    head = "".join(f"<th>{h}</th>" for h in heads)
    lines = []
    for row in rows:
        cells = "".join(
            f'<td class="text">{cell}</td>' if i < text_columns else f"<td>{cell}</td>"
            for i, cell in enumerate(row)
        )
        lines.append(f"<tr>{cells}</tr>")
    body = "\n".join(lines)
    return f'<div class="wide"><table>\n<tr>{head}</tr>\n{body}\n</table></div>'
