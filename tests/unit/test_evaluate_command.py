"""``rampe-guard evaluate`` on a log of one's own: files, table, refusals."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import jsonschema  # type: ignore[import-untyped]
import numpy as np
import pytest

from rampe_guard.cli import main
from rampe_guard.errors import RampeGuardError
from rampe_guard.evaluate import crew
from rampe_guard.evaluate.baselines import DESCRIPTIONS
from rampe_guard.evaluate.prediction import FORECASTERS
from rampe_guard.evaluate.prediction_report import report as prediction_report
from rampe_guard.evaluate.report_model import report_schema
from rampe_guard.evaluate.stages import prediction_piece
from rampe_guard.settings import load_site
from tests.support.bench_log import PERIOD_S, write_log
from tests.support.processes import BENCH, ROOT

CYCLES = 4
PRIMITIVES = 4 * CYCLES
"""Of each log; the last stroke of a log ends with its rest."""
LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("logs")
    return [str(write_log(folder / f"day{k}.csv", CYCLES, seed=k)) for k in (1, 2)]


def evaluated(out: Path, *args: str) -> dict[str, Any]:
    assert main(["evaluate", str(BENCH), *args, "--out", str(out), "--jobs", "1"]) == 0
    found: dict[str, Any] = json.loads((out / "prediction.json").read_text("utf-8"))
    assert (out / "prediction.png").read_bytes().startswith(b"\x89PNG")
    return found


@dataclass(frozen=True)
class Told:
    """What an evaluation wrote and showed."""

    found: dict[str, Any]
    report: dict[str, Any]
    page: str
    shown: str


def of_prediction(
    logs: list[str], *, fresh: bool = False, frozen: int | None = None
) -> dict[str, Any]:
    """The prediction part alone."""
    found = prediction_piece(str(BENCH), tuple(logs), fresh, frozen)
    return prediction_report(found, load_site(BENCH))


@pytest.fixture(scope="module")
def told(logs: list[str], tmp_path_factory: pytest.TempPathFactory) -> Told:
    """Both logs evaluated, knowledge carried over."""
    out = tmp_path_factory.mktemp("out") / "new" / "folder"
    with contextlib.redirect_stdout(io.StringIO()) as shown:
        found = evaluated(out, *logs)
    report = json.loads((out / "report.json").read_text("utf-8"))
    return Told(found, report, (out / "report.html").read_text("utf-8"), shown.getvalue())


def test_a_log_is_evaluated(told: Told) -> None:
    found, shown = told.found, told.shown
    assert [run["log"] for run in found["logs"]] == ["day1.csv", "day2.csv"]
    assert [run["primitives"] for run in found["logs"]] == [PRIMITIVES] * 2
    assert found["total"]["primitives"] == 2 * PRIMITIVES
    assert found["total"]["primitives_known"] == 2 * PRIMITIVES - 4 * 5
    assert found["range"]["stick"] == {"width": 1.0, "unit": "m"}  # it never moved
    assert 1.6 < found["range"]["swing"]["width"] < 2.6

    known = found["total"]["known"]
    assert list(known) == list(FORECASTERS)
    for name in FORECASTERS:
        assert name in shown
        low, _, high = known[name]["interval"]
        assert low <= known[name]["error"] <= high
        assert f"{known[name]['error']:.3f}" in shown
    # he aims at places: who knows where he starts knows better how far he goes
    error = {name: figures["error"] for name, figures in known.items()}
    assert error["RAMPE"] < error["running mean"] < error["zero"]
    assert error["RLS of river"] < error["running mean"]
    low, median, high = found["ratios"]["known"]["running mean"]
    assert low < median < high < 1.0

    calibration = found["calibration"]["all"]
    assert calibration["coverage"][0]["counts"]["stick"] == 0
    assert calibration["coverage"][0]["actuators"]["stick"] is None
    half, most = (c["overall"] for c in calibration["coverage"])
    assert 0.0 < half <= most <= 1.0
    reliability = calibration["reliability"]["overall"]
    assert sum(b["count"] for b in reliability["bins"]) == reliability["answers"] > 0
    assert 0.0 <= reliability["expected_calibration_error"] <= 1.0
    assert "folder" not in json.dumps(told.report)  # nor any other path of this machine
    assert {"rampe-guard", "river", "scikit-learn"} <= found["versions"].keys()


def test_the_report_tells_how_early_and_how_often_in_vain(told: Told) -> None:
    report = told.report
    jsonschema.validate(report, report_schema())
    assert report["zones"] == ["crate", "ceiling", "slew-left", "slew-right"]
    assert [log["log"] for log in report["logs"]] == ["day1.csv", "day2.csv"]
    assert list(report["forecasts"]) == ["guard", "guard_sparing", *DESCRIPTIONS]
    lines = [zone for log in report["logs"] for zone in log["zones"].values()]
    crossings = sum(len(line["contacts"]) for line in lines)
    assert report["crossings"] == crossings > 6  # none was there when a log began
    for name, forecast in report["forecasts"].items():
        at = forecast["operating_point"]
        assert at["crossings"] == crossings
        assert at["alarms"] >= at["false_alarms"] + at["undecided"]
        assert at["warned_0_5_s"] >= at["warned_1_0_s"] >= at["warned_1_5_s"] >= at["warned_2_0_s"]
        low, high = at["intervals"]["warned_1_0_s"]
        assert low <= at["warned_1_0_s"] <= high
        assert sum(point["crossings"] for point in forecast["by_zone"].values()) == crossings
        assert sum(point["missed"] for point in forecast["by_log"].values()) == at["missed"]
        assert sum(lead is None for lead in forecast["leads_s"]) == at["missed"]
        assert forecast["binary"] == (name not in {"guard", "guard_sparing", "rampe_primitive"})
        # an alarm that ends with its last cause is on for less of the time, and never warns more
        assert at["strict"]["alarmed_share"] <= at["alarmed_share"]
        assert at["strict"]["missed"] >= at["missed"]
    guard = report["forecasts"]["guard"]
    thresholds = [point["threshold"] for point in guard["curve"]]
    assert len(thresholds) >= 60
    assert report["warning_probability"] in thresholds
    at = guard["operating_point"]
    same = guard["curve"][thresholds.index(report["warning_probability"])]
    # the curve is of the one probability alone; the site also alarms of what is imminent
    assert same["false_alarms"] <= at["false_alarms"]
    assert same["warned_1_0_s"] <= at["warned_1_0_s"]
    sparing = report["forecasts"]["guard_sparing"]
    same = sparing["curve"][thresholds.index(report["warning_probability"])]
    assert {**same, "intervals": None} == {**sparing["operating_point"], "intervals": None}
    rates = [point["false_per_min_per_zone"] for point in guard["curve"]]
    assert rates[0] >= rates[-1]
    verdicts = [verdict for line in lines for *_, verdict in line["alarms"]]
    assert verdicts.count("false") == at["false_alarms"]
    # the floor is the stopping forecast, and nobody is warned later by more
    floor = report["forecasts"]["stopping"]["operating_point"]
    assert at["warned_0_5_s"] >= floor["warned_0_5_s"]
    published = report["published"]
    assert published["caution"]["total"]["missed"] <= published["imminent"]["total"]["missed"]
    rms = report["prediction"]
    assert rms["rampe"]["rms"] < rms["mean"]["rms"] < rms["zero"]["rms"]
    assert report["prediction_details"] == told.found


def test_the_page_needs_nothing_from_outside(told: Told) -> None:
    page = told.page
    assert page.startswith("<!doctype html>")
    assert not re.findall(r"(?:src|href|url)\s*[=(]|https?://|@import", page)
    at = told.report["forecasts"]["guard"]["operating_point"]
    assert f"<b>{at['warned_1_0_s']:.0%}</b> of {at['crossings']} crossings" in page
    for svg in re.findall(r"<svg.*?</svg>", page, re.DOTALL):
        assert "nan" not in svg
        ET.fromstring(svg)  # noqa: S314 - our own
    assert page.count("<svg") > 8


def carried_known(told: Told) -> int:
    known: int = told.found["total"]["primitives_known"]
    return known


def test_fresh_means_that_a_log_knows_nothing_of_those_before(told: Told, logs: list[str]) -> None:
    fresh = of_prediction(logs, fresh=True)
    carried = told.found
    assert fresh["total"]["primitives_known"] == 0 < carried_known(told)
    assert fresh["logs"][0] == carried["logs"][0]  # the first knows nothing either way
    before, after = (found["logs"][1]["all"] for found in (fresh, carried))
    assert before["zero"] == after["zero"]
    for name in ("running mean", "RAMPE, faithful"):
        assert before[name]["answered"] < after[name]["answered"] == 1.0


def test_frozen_means_that_only_the_first_logs_teach(told: Told, logs: list[str]) -> None:
    frozen = of_prediction(logs, frozen=1)
    assert frozen["total"]["primitives"] == PRIMITIVES  # of the second alone
    again = of_prediction([logs[0], logs[1], logs[1]], frozen=1)
    first, second = (log["all"] for log in again["logs"][1:])
    assert first == second == frozen["logs"][1]["all"]  # nothing was learned in between
    learned = told.found["logs"][1]["all"]
    assert frozen["logs"][1]["all"]["zero"] == learned["zero"]
    assert frozen["logs"][1]["all"]["RAMPE"] != learned["RAMPE"]


def test_a_short_log_has_no_known_categories_and_is_no_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = evaluated(tmp_path, str(write_log(tmp_path / "short.csv", 1, seed=3)))
    assert found["total"]["known"] == {}
    assert found["ratios"]["known"] == {}
    assert found["calibration"]["known"]["coverage"][0]["overall"] is None
    assert "—" in capsys.readouterr().out
    jsonschema.validate(json.loads((tmp_path / "report.json").read_text("utf-8")), report_schema())


def test_the_report_tells_when_the_guard_was_blind_and_where_the_arm_began(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = write_log(tmp_path / "whole.csv", 2, seed=3).read_text("utf-8").splitlines()
    column = lines[0].split(",").index("Swing Ms")
    rows = [line.split(",") for line in lines[1:]]
    begin = int(np.argmin([float(row[column]) for row in rows]))  # beyond a slew limit
    rows = rows[begin:]
    for row in rows[len(rows) // 2 :]:
        row[0] = f"{float(row[0]) + 5.0:.9g}"  # five seconds are missing
    (tmp_path / "holed.csv").write_text(
        "\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n", "utf-8"
    )
    evaluated(tmp_path, str(tmp_path / "holed.csv"))
    report = json.loads((tmp_path / "report.json").read_text("utf-8"))
    jsonschema.validate(report, report_schema())
    ((start, end),) = report["logs"][0]["not_monitoring"]
    assert 4.0 < end - start < 5.1
    assert report["not_monitoring_s"] == pytest.approx(end - start)
    watched = len(report["zones"]) * (report["duration_s"] - (end - start)) / 60.0
    for forecast in report["forecasts"].values():
        assert forecast["operating_point"]["zone_minutes"] == pytest.approx(watched)
    inside = {name: zone["inside_at_first_s"] for name, zone in report["logs"][0]["zones"].items()}
    (first,) = [name for name, seconds in inside.items() if seconds is not None]
    told = " ".join(capsys.readouterr().out.split())
    page = (tmp_path / "report.html").read_text("utf-8")
    assert f"NOT MONITORING {end - start:.1f} of" in told
    assert f"holed.csv: inside from the start, which counts as no crossing: {first} (" in told
    assert "NOT MONITORING; crossings meanwhile" in page
    assert 'class="blind"' in page
    assert f"counts as no crossing: {first} (" in page


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--frozen", "2"], "leaves none of 2 logs"),
        (["--frozen", "1", "--fresh"], "choose one"),
        (["--fleet", "fleet.yaml"], "either SITE and LOG, or --fleet"),
        (["--scheduler", "tcp://127.0.0.1:9", "--jobs", "1"], "no Dask scheduler answers"),
    ],
)
def test_what_cannot_be_is_said_at_once(
    options: list[str],
    words: str,
    logs: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(crew, "_PATIENCE_S", 0.5)
    assert main(["evaluate", str(BENCH), *logs, *options, "--out", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_log_without_a_stroke_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_log(tmp_path / "still.csv", 1, seed=4)
    lines = path.read_text("utf-8").splitlines()
    resting = lines[-1].split(",")
    still = [",".join([f"{PERIOD_S * k:.3f}", *resting[1:]]) for k in range(50)]
    path.write_text("\n".join([lines[0], *still]) + "\n", "utf-8")
    out = str(tmp_path / "out")
    assert main(["evaluate", str(BENCH), str(path), "--out", out, "--jobs", "1"]) == 2
    assert "still.csv: no complete primitive" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_bad_log_is_refused_in_the_readers_words(
    logs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "swapped.csv"
    text = Path(logs[0]).read_text("utf-8")
    path.write_text(text.replace("Swing Cmd", "x").replace("Swing Ms", "Swing Cmd"), "utf-8")
    assert main(["evaluate", str(BENCH), logs[0], str(path), "--out", str(tmp_path / "o")]) == 2
    assert "swapped.csv:1: no column 'Swing Ms'" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_a_missing_extra_is_named(logs: list[str], tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['river'] = None; from rampe_guard.cli import main;"
        " sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "evaluate", str(BENCH), logs[0], "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("evaluating ")  # before anything is loaded
    assert "needs river" in done.stderr
    assert "rampe-guard[eval]" in done.stderr
    assert "Traceback" not in done.stderr


def test_so_is_a_missing_library_of_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.axes", None)
    monkeypatch.delitem(sys.modules, "rampe_guard.evaluate.prediction_plot")
    with pytest.raises(RampeGuardError, match=r"needs matplotlib.*rampe-guard\[eval\]"):
        importlib.import_module("rampe_guard.evaluate.prediction_plot")


@pytest.mark.private_data
@pytest.mark.skipif(not LOGS.is_dir(), reason="no private logs at ../shared/data")
def test_a_persons_recorded_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = (LOGS / "operator3_run1.csv").read_text("utf-8").splitlines(keepends=True)
    (tmp_path / "end.csv").write_text(lines[0] + "".join(lines[-1500:]), "utf-8")
    found = evaluated(tmp_path, str(tmp_path / "end.csv"))
    assert "row left out" in capsys.readouterr().err  # the log ends in half a row
    errors = found["total"]["all"]
    assert errors["RAMPE"]["error"] < errors["zero"]["error"]
    trap = str(LOGS / "trap_columns_swapped.csv")
    assert main(["evaluate", str(BENCH), trap, "--out", str(tmp_path / "trap")]) == 2
    assert "swapped" in capsys.readouterr().err
