"""Reading a CSV file: what is refused, and by which words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rampe_guard.errors import LogError
from rampe_guard.runtime.csv_rows import header_of, mapped_rows, time_problems
from rampe_guard.settings import ColumnMap

COLUMNS = [ColumnMap("t"), ColumnMap("a", scale=2.0, offset=1.0)]


def _file(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "log.csv"
    path.write_text(text, encoding=encoding)
    return path


def test_the_mark_of_excel_is_no_part_of_a_name(tmp_path: Path) -> None:
    path = _file(tmp_path, "t,a\r\n0,1\r\n", "utf-8-sig")
    assert header_of(path) == ["t", "a"]
    rows, warnings = mapped_rows(path, COLUMNS)
    assert rows.tolist() == [[0.0, 3.0]]
    assert warnings == []


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("1,2,3", "it has 3 fields, and the header 2"),
        ("1", "cut off before column 'a'"),
        ("1,", "column 'a': is empty"),
        ("1,two", "column 'a': 'two' is no number"),
        ("1,inf", "column 'a': 'inf' is not finite"),
        ("1,1e300", "column 'a': 2e+300 is beyond 1e+06"),
    ],
)
def test_a_row_that_is_left_out_is_told_with_line_and_reason(
    tmp_path: Path, line: str, why: str
) -> None:
    rows, warnings = mapped_rows(_file(tmp_path, f"t,a\n0,0\n{line}\n2,0\n"), COLUMNS)
    assert rows[:, 0].tolist() == [0.0, 2.0]
    assert warnings == [f"{tmp_path / 'log.csv'}:3: row left out: {why}"]


def test_a_comma_at_the_end_of_every_line_is_no_field(tmp_path: Path) -> None:
    rows, warnings = mapped_rows(_file(tmp_path, "t,a\n0,0,\n1,0, ,\n"), COLUMNS)
    assert len(rows) == 2
    assert warnings == []


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", ":1: is empty"),
        ("\n\n", ":1: is empty"),
        ("t,b\n0,0\n", ":1: no column 'a'; the header has t, b"),
        ("t,a,a\n0,0,1\n", ":1: 2 columns are called 'a'"),
        ("t;a\n0,5;1,0\n", ":1: the columns are separated by semicolons: t, a; save it"),
        ("t\ta\n0\t1\n", "separated by tabs"),
        ("<robot name='r'>\n</robot>\n", ":1: is no CSV file; it begins with"),
        ("t,a\n", "no usable row"),
    ],
)
def test_what_is_no_log_is_refused_for_what_it_is(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(LogError) as caught:
        mapped_rows(_file(tmp_path, text), COLUMNS)
    assert why in str(caught.value)


def test_a_time_may_be_as_large_as_it_likes(tmp_path: Path) -> None:
    columns = [ColumnMap("t", scale=1e-9), COLUMNS[1]]
    rows, warnings = mapped_rows(_file(tmp_path, "t,a\n1800000000500000000,0\n"), columns)
    assert rows[0, 0] == pytest.approx(1_800_000_000.5)
    assert warnings == []


def test_another_encoding_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot be read: it is not UTF-8 text"):
        header_of(_file(tmp_path, "t,a\n0,1\n", "utf-16"))


@pytest.mark.parametrize(
    ("time_s", "why"),
    [
        (np.arange(50) * 0.02, None),
        (np.arange(50) * 20.0, "rows are 20 s apart: is time in seconds?"),
        (np.arange(50) * 2e4, "rows are 2e+04 s apart: is time in seconds?"),
        (np.array([0.0, 0.02, 0.01]), "time does not go on after 0.02 s"),
        (np.array([0.0, 0.02, 0.04, 1.7e9, 1.7e9 + 0.02]), "time jumps by 1.7e+09 s after 0.04 s"),
        (np.array([0.0, 0.02, 0.04, 3600.0, 3600.02]), None),
    ],
)
def test_what_is_no_time_of_a_run(time_s: np.ndarray, why: str | None) -> None:
    told = time_problems(ColumnMap("t"), time_s)
    assert len(told) == (why is not None)
    assert why is None or why in told[0]
