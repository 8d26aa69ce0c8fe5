"""``rampe-guard evaluate`` on a log of one's own: files, table, refusals."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rampe_guard.cli import main
from rampe_guard.evaluate.prediction import FORECASTERS
from rampe_guard.settings import LogMapping, load_site
from tests.support.processes import BENCH, ROOT

LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"
PERIOD_S = 0.05
REST_S = 0.6


def bench_mapping() -> LogMapping:
    mapping = load_site(BENCH).log
    assert mapping is not None
    return mapping


def write_log(path: Path, cycles: int, seed: int) -> Path:
    """An operator who swings to and fro and lifts and lowers, never twice quite alike.

    He aims at places, so that how far he goes follows from where he starts.
    """
    rng = np.random.default_rng(seed)
    mapping = bench_mapping()
    names = ("swing", "boom", "stick", "bucket")
    speed = np.array([0.6, 0.02, 0.03, 0.03])
    q = np.array([0.0, 0.05, 0.07, 0.05])
    goals = [(0, 0.8, 0.15), (1, 0.08, 0.004), (0, -0.8, 0.15), (1, 0.04, 0.004)]
    columns = [mapping.joystick[n] for n in names] + [mapping.actuators[n] for n in names]
    lines = [",".join([mapping.time.column, *(c.column for c in columns)])]
    t = 0.0
    for j, goal, spread in goals * cycles:
        aim = rng.normal(goal, spread)
        lever = np.zeros(4)
        lever[j] = np.sign(aim - q[j])
        moving = round(abs(aim - q[j]) / (speed[j] * PERIOD_S))
        for u in [lever] * moving + [np.zeros(4)] * round(REST_S / PERIOD_S):
            q = q + u * speed * PERIOD_S
            values = zip([*u, *q], columns, strict=True)
            raw = [(value - c.offset) / c.scale for value, c in values]
            lines.append(",".join(f"{v:.9g}" for v in (t, *raw)))
            t += PERIOD_S
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("logs")
    return [str(write_log(folder / f"day{k}.csv", 6, seed=k)) for k in (1, 2)]


def evaluated(out: Path, *args: str) -> dict[str, Any]:
    assert main(["evaluate", str(BENCH), *args, "--out", str(out)]) == 0
    found: dict[str, Any] = json.loads((out / "prediction.json").read_text("utf-8"))
    assert (out / "prediction.png").read_bytes().startswith(b"\x89PNG")
    return found


@dataclass(frozen=True)
class Told:
    """What an evaluation wrote and showed."""

    found: dict[str, Any]
    content: bytes
    shown: str


@pytest.fixture(scope="module")
def told(logs: list[str], tmp_path_factory: pytest.TempPathFactory) -> Told:
    """Both logs evaluated, knowledge carried over."""
    out = tmp_path_factory.mktemp("out") / "new" / "folder"
    with contextlib.redirect_stdout(io.StringIO()) as shown:
        found = evaluated(out, *logs)
    return Told(found, (out / "prediction.json").read_bytes(), shown.getvalue())


def test_a_log_is_evaluated(told: Told) -> None:
    found, shown = told.found, told.shown
    assert [run["log"] for run in found["logs"]] == ["day1.csv", "day2.csv"]
    # the last stroke of a log ends with its rest
    assert [run["primitives"] for run in found["logs"]] == [24, 24]
    assert found["total"]["primitives"] == 48
    assert found["total"]["primitives_known"] == 48 - 4 * 5
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
    assert "folder" not in told.content.decode()  # nor any other path of this machine
    assert {"rampe-guard", "river", "scikit-learn"} <= found["versions"].keys()


def test_the_same_logs_give_the_same_bytes(tmp_path: Path) -> None:
    log = str(write_log(tmp_path / "short.csv", 2, seed=5))
    for out in ("a", "b"):
        evaluated(tmp_path / out, log)
    first, again = ((tmp_path / out / "prediction.json").read_bytes() for out in ("a", "b"))
    assert first == again


def test_fresh_means_that_a_log_knows_nothing_of_those_before(
    told: Told, logs: list[str], tmp_path: Path
) -> None:
    fresh, carried = evaluated(tmp_path, *logs, "--fresh"), told.found
    assert fresh["total"]["primitives_known"] == 48 - 2 * 4 * 5
    assert fresh["logs"][0] == carried["logs"][0]  # the first knows nothing either way
    before, after = (found["logs"][1]["all"] for found in (fresh, carried))
    assert before["zero"] == after["zero"]
    for name in ("running mean", "RAMPE, faithful"):
        assert before[name]["answered"] < after[name]["answered"] == 1.0


def test_a_short_log_has_no_known_categories_and_is_no_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = evaluated(tmp_path, str(write_log(tmp_path / "short.csv", 2, seed=3)))
    assert found["total"]["known"] == {}
    assert found["ratios"]["known"] == {}
    assert found["calibration"]["known"]["coverage"][0]["overall"] is None
    assert "—" in capsys.readouterr().out


def test_a_log_without_a_stroke_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_log(tmp_path / "still.csv", 1, seed=4)
    lines = path.read_text("utf-8").splitlines()
    resting = lines[-1].split(",")
    still = [",".join([f"{PERIOD_S * k:.3f}", *resting[1:]]) for k in range(50)]
    path.write_text("\n".join([lines[0], *still]) + "\n", "utf-8")
    assert main(["evaluate", str(BENCH), str(path), "--out", str(tmp_path / "out")]) == 2
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


@pytest.mark.parametrize("library", ["river", "matplotlib"])
def test_a_missing_extra_is_named(library: str, logs: list[str], tmp_path: Path) -> None:
    code = (
        f"import sys; sys.modules[{library!r}] = None; from rampe_guard.cli import main;"
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
    assert f"needs {library}" in done.stderr
    assert "rampe-guard[eval]" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.private_data
@pytest.mark.skipif(not LOGS.is_dir(), reason="no private logs at ../shared/data")
def test_a_persons_recorded_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = (LOGS / "operator3_run1.csv").read_text("utf-8").splitlines(keepends=True)
    (tmp_path / "end.csv").write_text(lines[0] + "".join(lines[-2500:]), "utf-8")
    found = evaluated(tmp_path, str(tmp_path / "end.csv"))
    assert "row left out" in capsys.readouterr().err  # the log ends in half a row
    known = found["total"]["known"]
    assert known["running mean"]["error"] < known["zero"]["error"]
    assert known["RAMPE"]["error"] < known["running mean"]["error"]
    trap = str(LOGS / "trap_columns_swapped.csv")
    assert main(["evaluate", str(BENCH), trap, "--out", str(tmp_path / "trap")]) == 2
    assert "swapped" in capsys.readouterr().err
