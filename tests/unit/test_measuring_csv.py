"""A CSV log of a machine that nobody has described: which columns, which rows, and what is said."""

from __future__ import annotations

import io
from argparse import ArgumentTypeError
from pathlib import Path

import pytest
from rich.console import Console

from rampe_guard.core.identify import identify
from rampe_guard.errors import LogError
from rampe_guard.options_init import names
from rampe_guard.programs.initing_source import tell_heard
from rampe_guard.programs.measuring import reasons
from rampe_guard.programs.measuring_csv import column_maps, heard_in_csv
from rampe_guard.settings import ColumnMap

HEADER = "t,u_turn,u_lift,turn,lift"
ROWS = [f"{0.04 * k:.2f},0,{k % 2},0.1,0.2" for k in range(40)]


def _log(folder: Path, rows: list[str] = ROWS, header: str = HEADER) -> str:
    path = folder / "log.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return str(path)


def _refused(path: str, *columns: str | None) -> str:
    with pytest.raises(LogError) as caught:
        heard_in_csv(path, *(*columns, None, None, None)[:3])
    return str(caught.value)


def test_columns_that_are_not_named_are_guessed_each_for_itself(tmp_path: Path) -> None:
    path = _log(tmp_path)
    assert heard_in_csv(path, None, None, None).column_names == ["turn", "lift"]
    in_ms = heard_in_csv(path, "t:0.5", None, None)
    assert in_ms.traces.time_s[-1] == pytest.approx(0.78)
    assert in_ms.traces.axes.shape == (40, 2)
    turned = heard_in_csv(path, None, None, "lift,turn")
    assert turned.column_names == ["lift", "turn"]
    assert turned.joystick == "u_turn, u_lift"


@pytest.mark.parametrize("name", ["Heb: 1, links", 'a "big" one', " "])
def test_a_log_of_ours_may_have_any_names(tmp_path: Path, name: str) -> None:
    quoted = name.replace('"', '""')
    path = _log(tmp_path, header=f't,"u_{quoted}",u_lift,"{quoted}",lift')
    heard = heard_in_csv(path, None, None, None)
    assert heard.column_names == [name, "lift"]
    assert heard.traces.axes.shape == (40, 2)


def test_a_name_with_commas_is_quoted() -> None:
    assert column_maps('"Heb: 1, links":0.1:-2, b ,c:3', "--actuators") == [
        ColumnMap("Heb: 1, links", 0.1, -2.0),
        ColumnMap("b"),
        ColumnMap("c", 3.0),
    ]


def test_names_of_joints_are_quoted_alike() -> None:
    assert names('"Heb: 1, links", b') == ("Heb: 1, links", "b")
    for text in ("", "a,,b", "a\rb"):
        with pytest.raises(ArgumentTypeError, match="empty name"):
            names(text)


def test_a_long_silence_is_told(tmp_path: Path) -> None:
    late = [",".join([f"{60 + 0.04 * k:.2f}", *ROWS[k].split(",")[1:]]) for k in range(40)]
    heard = heard_in_csv(_log(tmp_path, [*ROWS, *late]), None, None, None)
    console = Console(file=io.StringIO(), width=200)
    tell_heard(heard, identify(heard.traces), console)
    assert isinstance(console.file, io.StringIO)
    assert "note: no rows for 58 s, 2 s after the first" in console.file.getvalue()


@pytest.mark.parametrize("text", ['"a', 'a"b', '"a"b', "a:", ",a", "a,"])
def test_what_is_no_list_of_columns(text: str) -> None:
    with pytest.raises(LogError, match="is no column; write NAME"):
        column_maps(text, "--actuators")


def test_what_is_missing_is_named_with_the_header(tmp_path: Path) -> None:
    path = _log(tmp_path, header="Time,a0,a1,turn,lift")
    told = _refused(path)
    assert "log.csv:1: no column 't'; name the column of time with --time COLUMN" in told
    assert "the header has Time, a0, a1, turn, lift" in told
    told = _refused(path, "Time")
    assert "no column NAME with a column u_NAME" in told
    assert "with --joystick and --actuators; the header has Time, a0" in told
    assert "with --actuators; the header" in _refused(path, "Time", "a0,a1")
    assert "--time 'Time,a0': names 2 columns" in _refused(path, "Time,a0", "a0", "turn")


@pytest.mark.parametrize(
    ("factor", "why"), [(1e3, "rows are 40 s apart"), (1e6, "rows are 4e+04 s apart")]
)
def test_a_time_that_is_not_in_seconds_is_refused(tmp_path: Path, factor: float, why: str) -> None:
    rows = [",".join([f"{0.04 * k * factor:.1f}", *ROWS[k].split(",")[1:]]) for k in range(40)]
    path = _log(tmp_path, rows)
    told = _refused(path)
    assert f"column 't': {why}: is time in seconds? Give its scale: --time t:SCALE" in told
    assert heard_in_csv(path, f"t:{1 / factor}", None, None).seconds == pytest.approx(1.56)


def test_two_clocks_in_a_file_are_refused(tmp_path: Path) -> None:
    rows = [*ROWS, *(f"{1.7e9 + 0.04 * k:.2f},0,0,0.1,0.2" for k in range(40))]
    assert "time jumps by 1.7e+09 s after 1.56 s" in _refused(_log(tmp_path, rows))


def test_rows_left_out_are_told_with_the_first_line_and_why(tmp_path: Path) -> None:
    heard = heard_in_csv(_log(tmp_path, [*ROWS, "2,0,0,1e300,0"]), None, None, None)
    assert reasons(heard.refused) == (
        " (refused: 1 row, line 42: column 'turn': 1e+300 is beyond 1e+06)"
    )
    heard = heard_in_csv(_log(tmp_path, [*ROWS, "2,0,0,,0", "3,0"]), None, None, None)
    assert reasons(heard.refused) == (
        " (refused: 2 rows, the first in line 42: column 'turn': is empty)"
    )
