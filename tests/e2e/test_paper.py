"""``rampe-guard paper`` as a user runs it: the files, and that they say the same."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from rampe_guard.core.types import FloatArray
from tests.support.processes import ROOT, command

pytestmark = pytest.mark.e2e

FIGURES = [
    *(f"figure{number}" for number in (5, 6, 7, 8, 9)),
    *("figure8_default", "figure9_default"),
]
SEEDS, CYCLES = 2, 6


@dataclass(frozen=True)
class Done:
    folder: Path
    said: str
    table: dict[str, Any]
    rows: list[dict[str, str]]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    folder = tmp_path_factory.mktemp("paper") / "not yet" / "there"
    run = command("paper", "--out", folder, "--seeds", str(SEEDS), "--cycles", str(CYCLES))
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    table = json.loads((folder / "table.json").read_text("utf-8"))
    with (folder / "primitives.csv").open(encoding="utf-8") as text:
        return Done(folder, run.stdout, table, list(csv.DictReader(text)))


def columns(rows: list[dict[str, str]], name: str) -> FloatArray:
    return np.array([[float(r[f"{name}_swing_deg"]), float(r[f"{name}_boom_m"])] for r in rows])


def test_every_figure_is_an_image_with_something_in_it(done: Done) -> None:
    for name in FIGURES:
        with Image.open(done.folder / f"{name}.png") as image:
            image.load()
            assert min(image.size) > 500
            assert len(image.convert("RGB").getcolors(1 << 24) or ()) > 20
        root = ET.parse(done.folder / f"{name}.svg").getroot()  # noqa: S314 - our own file
        assert root.tag.endswith("svg")
        assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 10


def test_the_terminal_says_the_verdicts_and_where_the_page_is(done: Done) -> None:
    assert f"{SEEDS} runs of {CYCLES} cycles, {len(done.rows)} primitives" in done.said
    assert str(done.folder / "index.html") in done.said
    p99 = done.table["error_share_of_range"]["after_initialising"]["default"]["p99"]
    assert f"{p99:.3f}" in done.said


def test_the_table_recomputes_from_the_primitives(done: Done) -> None:
    assert done.table["experiment"]["primitives"] == len(done.rows)
    for part, rows in (
        ("all_runs", done.rows),
        ("first_run", [r for r in done.rows if r["seed"] == "1"]),
    ):
        assert sum(row["occurrences"] for row in done.table[part]) == len(rows)
        for row in done.table[part]:
            sign = [str(s) for s in row["category"]]
            of = [r for r in rows if [r["sign_swing"], r["sign_boom"]] == sign]
            assert row["occurrences"] == len(of)
            same(row["rms_displacement"], columns(of, "displacement"))
            known = [r for r in of if int(r["occurrence"]) > 3]
            for name in ("faithful", "default", "running mean"):
                of_error = row["rms_error_after_initialising"][name]
                if not known:
                    assert of_error is None
                    continue
                said = columns(known, name.replace(" ", "_"))
                same(of_error, columns(known, "displacement") - said)


def same(written: dict[str, float], values: FloatArray) -> None:
    wanted = np.sqrt(np.mean(values**2, axis=0))
    assert [written["swing [deg]"], written["boom [m]"]] == pytest.approx(wanted, rel=1e-6)


def test_the_quantiles_recompute_from_the_primitives(done: Done) -> None:
    known = [r for r in done.rows if int(r["occurrence"]) > 3]
    for name in ("faithful", "default", "running mean"):
        error = columns(known, "displacement") - columns(known, name.replace(" ", "_"))
        share = np.sqrt(np.mean((error / [64.4, 0.35]) ** 2, axis=1))
        written = done.table["error_share_of_range"]["after_initialising"][name]
        shown = [written[q] for q in ("median", "p90", "p99")]
        assert shown == pytest.approx(np.quantile(share, [0.5, 0.9, 0.99]), rel=1e-6)


def test_faithful_begins_with_three_zeros_in_every_category_and_run(done: Done) -> None:
    early = [r for r in done.rows if int(r["occurrence"]) <= 3]
    assert not columns(early, "faithful").any()
    later = [r for r in done.rows if int(r["occurrence"]) > 3]
    assert columns(later, "faithful").any(axis=1).all()


def test_the_page_shows_every_figure_and_the_verdicts_of_the_table(done: Done) -> None:
    text = (done.folder / "index.html").read_text("utf-8")
    for name in FIGURES:
        assert f'id="{name}"' in text
    for mode in ("faithful", "default"):
        for claim in done.table["claims"][mode]:
            assert f'{mode}: <span class="verdict">{claim["verdict"]}</span>' in text


def test_a_browser_shows_the_page(done: Done, tmp_path: Path) -> None:
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no chromium on this machine to show the page")
    picture = tmp_path / "page.png"
    subprocess.run(
        [
            *(browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
            *(f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1200,6000"),
            *(f"--screenshot={picture}", (done.folder / "index.html").as_uri()),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    drawn = np.abs(pixels - [0x00, 0x72, 0xB2]).max(axis=2) < 4  # the blue of Figures 5 and 6
    assert drawn.sum() > 2000
    assert (pixels.max(axis=2) < 255).any(axis=1).mean() > 0.3  # not a mostly empty page


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (["--out", str(ROOT / "README.md")], "README.md"),
        (["--seeds", "0"], "--seeds"),
        (["--cycles", "-1"], "--cycles"),
        (["--seed", "x"], "--seed"),
    ],
)
def test_what_cannot_be_done_is_told_with_code_2(args: list[str], told: str) -> None:
    run = command("paper", *args)
    assert run.returncode == 2
    assert told in run.stderr
    assert "Traceback" not in run.stderr


def test_without_matplotlib_it_says_what_to_install(tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None;"
        " from rampe_guard.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, "paper", "--out", str(tmp_path / "none")],
        capture_output=True,
        encoding="utf-8",
        timeout=60,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert run.returncode == 2
    assert "rampe-guard[eval]" in run.stderr
    assert "Traceback" not in run.stderr
    assert not (tmp_path / "none").exists()
