import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.errors import LogError
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.csv_log import read_csv_log
from rampe_guard.runtime.log_lines import complaint
from rampe_guard.settings import ColumnMap, LogMapping, Site, load_site

HEADER = "t,u_swing,u_boom,u_stick,u_bucket,swing,boom,stick,bucket"
NAMES = ("swing", "boom", "stick", "bucket")
LIMITS = np.array([[-3.2, 3.2], [0.0, 0.12], [0.0, 0.145], [0.0, 0.11]])


@pytest.fixture(scope="module")
def site() -> Site:
    mapping = LogMapping(
        time=ColumnMap("t"),
        joystick={n: ColumnMap(f"u_{n}") for n in NAMES},
        actuators={n: ColumnMap(n, scale=1.0 if n == "swing" else 0.01) for n in NAMES},
    )
    return replace(load_site(shipped_site("bench")), log=mapping)


def rows(count: int = 200) -> list[list[float]]:
    """The boom goes up and down as its lever says; the rest stays."""
    made = []
    boom = 4.0
    for k in range(count):
        u = 1.0 if (k // 50) % 2 == 0 else -1.0
        boom += 0.1 * u
        made.append([0.05 * k, 0.0, u, 0.0, 0.0, 0.1, boom, 5.0, 5.0])
    return made


def write(path: Path, data: list[list[float]], header: str = HEADER, tail: str = "") -> Path:
    lines = [header, *(",".join(f"{v:.6g}" for v in row) for row in data)]
    path.write_text("\n".join(lines) + "\n" + tail)
    return path


def test_values_are_mapped(site: Site, tmp_path: Path) -> None:
    log = read_csv_log(site, write(tmp_path / "a.csv", rows()), LIMITS)
    assert log.warnings == ()
    np.testing.assert_allclose(log.position[0], [0.1, 0.041, 0.05, 0.05])
    np.testing.assert_allclose(log.axes[0], [0.0, 1.0, 0.0, 0.0])
    joystick, actuators = next(log.samples())
    assert joystick.stamp_s == actuators.stamp_s == 0.0


def test_columns_are_found_by_name_in_any_order(site: Site, tmp_path: Path) -> None:
    order = [8, 0, 3, 1, 2, 7, 5, 6, 4]
    header = ",".join(np.array(HEADER.split(","))[order])
    shuffled = [[row[k] for k in order] for row in rows()]
    a = read_csv_log(site, write(tmp_path / "a.csv", rows()), LIMITS)
    b = read_csv_log(site, write(tmp_path / "b.csv", shuffled, header), LIMITS)
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.axes, b.axes)


def test_a_last_line_cut_off_costs_one_warning(site: Site, tmp_path: Path) -> None:
    log = read_csv_log(site, write(tmp_path / "a.csv", rows(), tail="10.0,0,0.5"), LIMITS)
    (warning,) = log.warnings
    assert "a.csv:202" in warning
    assert "cut off before column 'u_stick'" in warning
    assert len(log.time_s) == 200


@pytest.mark.parametrize("value", ["", "abc", "nan", "inf"])
def test_an_unusable_cell_costs_its_row(site: Site, tmp_path: Path, value: str) -> None:
    tail = f"10.0,0,0,0,0,{value},4,5,5\n"
    log = read_csv_log(site, write(tmp_path / "a.csv", rows(), tail=tail), LIMITS)
    assert len(log.warnings) == 1
    assert len(log.time_s) == 200


def refusal(site: Site, path: Path) -> str:
    with pytest.raises(LogError) as caught:
        read_csv_log(site, path, LIMITS)
    return str(caught.value)


def test_a_missing_column_is_named(site: Site, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows(), HEADER.replace("u_stick", "stick_cmd"))
    assert "a.csv:1: no column 'u_stick'" in refusal(site, path)


def test_swapped_columns_are_refused_with_values(site: Site, tmp_path: Path) -> None:
    header = "t,swing,boom,stick,bucket,u_swing,u_boom,u_stick,u_bucket"
    text = refusal(site, write(tmp_path / "a.csv", rows(), header))
    assert "column 'u_stick': 100% of the rows are outside an axis" in text
    assert "logged as 5" in text
    assert "swapped" in text


def test_a_wrong_scale_is_refused(site: Site, tmp_path: Path) -> None:
    data = [[*row[:6], row[6] * 10.0, *row[7:]] for row in rows()]
    assert "outside the limits of 'boom'" in refusal(site, write(tmp_path / "a.csv", data))


def test_a_wrong_sign_is_refused(site: Site, tmp_path: Path) -> None:
    data = [[row[0], row[1], -row[2], *row[3:]] for row in rows()]
    text = refusal(site, write(tmp_path / "a.csv", data))
    assert "'boom' moves against its command" in text


def test_no_rows_no_file_no_mapping(site: Site, tmp_path: Path) -> None:
    assert "no usable row" in refusal(site, write(tmp_path / "a.csv", []))
    assert "cannot be read" in refusal(site, tmp_path / "absent.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x01")
    assert "cannot be read" in refusal(site, tmp_path / "b.csv")
    assert "no 'log' mapping" in refusal(replace(site, log=None), tmp_path / "a.csv")


def test_two_runs_in_one_file_are_refused(site: Site, tmp_path: Path) -> None:
    text = refusal(site, write(tmp_path / "a.csv", rows(100) + rows(100)))
    assert "time does not go on after 4.95 s" in text


def test_time_in_milliseconds_is_refused(site: Site, tmp_path: Path) -> None:
    data = [[row[0] * 1000.0, *row[1:]] for row in rows()]
    assert "rows are 50 s apart: is time in seconds?" in refusal(
        site, write(tmp_path / "a.csv", data)
    )


def test_a_refusal_is_told_line_by_line_in_whatever_process_it_arose(
    site: Site, tmp_path: Path
) -> None:
    data = [[row[0] * 1000.0, *row[1:6], row[6] * 10.0, *row[7:]] for row in rows()]
    with pytest.raises(LogError) as caught:
        read_csv_log(site, write(tmp_path / "a.csv", data), LIMITS)
    error = pickle.loads(pickle.dumps(caught.value))  # noqa: S301 - our own
    assert len(error.lines) == 4
    assert "rows are 50 s apart" in error.lines[1]
    assert "limits of 'boom'" in error.lines[2]
    told = complaint(error.lines)
    assert told.count("\n") == 3
    assert "\\x0a" not in told


def test_a_row_that_a_guard_refuses_is_no_position_of_the_arm(site: Site, tmp_path: Path) -> None:
    data = rows()
    for k in (50, 60):
        data[k][5] = 3.0  # the swing is elsewhere for one row
    data[70][2] = 1.4  # a lever beyond its end says nothing of the arm
    log = read_csv_log(site, write(tmp_path / "a.csv", data), LIMITS)
    seen = dict(log.positions())
    assert len(seen) == 198
    assert all(q[0] == pytest.approx(0.1) for q in seen.values())
    kept = [inputs for _, inputs in log.steps() if inputs.actuators]
    assert len(kept) == 200  # the guard refuses it again, as it would live
    jump, lever = log.warnings
    assert "a.csv:52: a guard refuses this row (actuators: position_jump: actuator 0" in jump
    assert "and 1 more for this reason" in jump
    assert "a.csv:72: a guard refuses this row (joystick: axis_out_of_range" in lever
    assert log.left_out == ()
