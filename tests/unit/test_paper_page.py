"""The page says what the runs say, and fetches nothing."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
from html.parser import HTMLParser

import numpy as np

from rampe_guard.evaluate.paper_estimates import Run
from rampe_guard.evaluate.paper_page import page
from rampe_guard.evaluate.paper_report import (
    FigureFile,
    build_report,
    primitives_csv,
    report_json,
    sign_name,
)
from tests.support.paper import made_experiment, made_run, two_blobs

SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1"/>'
PICTURE = FigureFile("figure5", "Figure 5", "Targets & <ways>.")
VERDICT = re.compile(r'(faithful|default): <span class="verdict">([a-z ]+)</span>')


def runs(*, right: bool) -> list[Run]:
    made = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        category, start, x = two_blobs(rng, 40)
        said = x + rng.normal(0.0, [0.3, 0.003], x.shape) if right else x[::-1] * 3.0 + 1.0
        made.append(made_run(category, start, x, said, seed))
    return made


def written(made: list[Run]) -> str:
    return page(build_report(made_experiment(), made), [(PICTURE, SVG)])


def test_verdicts_on_the_page_are_those_of_the_data() -> None:
    for right in (True, False):
        report = build_report(made_experiment(), runs(right=right))
        shown = VERDICT.findall(written(runs(right=right)))
        wanted = [(m, report.claims[m][i].verdict) for i in range(3) for m in report.claims]
        assert shown == wanted
    good, bad = (
        VERDICT.findall(written(runs(right=True))),
        VERDICT.findall(written(runs(right=False))),
    )
    assert good[4] == ("faithful", "holds")
    assert bad[4] == ("faithful", "does not hold")


def test_numbers_on_the_page_are_those_of_the_data() -> None:
    made = runs(right=True)
    report = build_report(made_experiment(), made)
    text = written(made)
    row = report.every[0]
    assert row.rms_error["default"] is not None
    numbers = [*row.rms_displacement, *row.rms_error["default"], report.quantiles["default"].p99]
    for value in numbers:
        assert f">{value:.3g}<" in text
    of_default = re.compile("<td>default</td><td>.*</td>")
    before = of_default.findall(text)
    assert len(before) == 2
    made[0].estimate["default"] *= 5.0
    after = of_default.findall(written(made))
    assert all(a != b for a, b in zip(before, after, strict=True))


def test_the_page_is_one_file_with_balanced_tags_and_no_address() -> None:
    text = written(runs(right=True))
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert "<script" not in text
    assert not re.search(r"https?://", text)
    assert f"data:image/svg+xml;base64,{base64.b64encode(SVG).decode()}" in text
    assert "Targets &amp; &lt;ways&gt;." in text
    tags = _Tags()
    tags.feed(text)
    assert tags.open == []
    assert tags.seen >= {"h1", "h2", "table", "figure", "figcaption"}


class _Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        del attrs
        self.seen.add(tag)
        if tag not in {"meta", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_a_run_too_short_for_any_error_is_a_page_without_numbers() -> None:
    short = made_run([(0, 1)] * 2, np.zeros((2, 2)), np.ones((2, 2)))
    text = written([short])
    assert {verdict for _, verdict in VERDICT.findall(text)} == {"not shown"}
    assert not re.search(r"\bnan\b", text)
    table = json.dumps(report_json(build_report(made_experiment(), [short])), allow_nan=False)
    assert json.loads(table)["all_runs"][0]["rms_error_after_initialising"]["default"] is None


def test_who_bears_the_error_and_goes_two_ways_is_named() -> None:
    rng = np.random.default_rng(1)
    start = rng.normal([0.0, 2.79], [1.0, 0.01], (40, 2))
    x = np.column_stack([np.zeros(40), np.arange(40) % 2 * 0.17 + rng.normal(0.02, 0.004, 40)])
    text = written([made_run([(0, -1)] * 40, start, -x)])
    assert f"default: {sign_name((0, -1))} bears 100.0% of the squared error" in text
    assert f"In 1 of 1 runs {sign_name((0, -1))} goes two ways from one place" in text
    assert "two ways" not in written(runs(right=True))


def test_the_file_of_primitives_has_every_number_of_the_runs() -> None:
    made = runs(right=False)
    rows = list(csv.DictReader(io.StringIO(primitives_csv(made, made_experiment()))))
    assert len(rows) == 120
    of_second = [row for row in rows if row["seed"] == "1"]
    for k in (0, 17, 39):
        row = of_second[k]
        assert (row["sign_swing"], row["sign_boom"], row["occurrence"]) == ("0", "1", str(k + 1))
        for name, array in (
            ("start", made[1].primitives.start),
            ("displacement", made[1].primitives.displacement),
            ("running_mean", made[1].estimate["running mean"]),
        ):
            read = [float(row[f"{name}_swing_deg"]), float(row[f"{name}_boom_m"])]
            np.testing.assert_allclose(read, array[k], rtol=1e-8)
