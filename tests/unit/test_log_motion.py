"""What the motion in a log says against the site file."""

from __future__ import annotations

from pathlib import Path

import pytest

from rampe_guard.collision import load_arm
from rampe_guard.programs.log_motion import motion_warnings
from rampe_guard.programs.replaying import tell_warnings
from rampe_guard.recording import open_log
from rampe_guard.settings import Site, load_site
from tests.support.bench_log import bench_mapping, write_log
from tests.support.processes import BENCH

CYCLES = 6


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site(BENCH)


@pytest.fixture(scope="module")
def lines(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    path = write_log(tmp_path_factory.mktemp("log") / "day.csv", CYCLES, seed=5)
    return path.read_text("utf-8").splitlines()


def warned(site: Site, path: Path, lines: list[str]) -> tuple[str, ...]:
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return motion_warnings(site, open_log(site, path, load_arm(site.arm).limits))


def test_a_log_that_is_as_the_site_file_says_is_not_talked_about(
    site: Site, lines: list[str], tmp_path: Path
) -> None:
    assert warned(site, tmp_path / "log.csv", lines) == ()


def test_swapped_levers_are_told_by_the_axes_that_move_what(
    site: Site, lines: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    swing, boom = (bench_mapping().joystick[name].column for name in ("swing", "boom"))
    names = [{swing: boom, boom: swing}.get(name, name) for name in lines[0].split(",")]
    path = tmp_path / "swapped.csv"
    found = warned(site, path, [",".join(names), *lines[1:]])
    axes = {actuator.name: actuator.axis for actuator in site.guard.actuators}
    for text, name, other in zip(found, ("swing", "boom"), ("boom", "swing"), strict=True):
        assert f"swapped.csv: {name}: axis {axes[other]} moves it, and the site file says" in text
    tell_warnings(site, open_log(site, path, load_arm(site.arm).limits))
    assert capsys.readouterr().err == "".join(f"warning: {text}\n" for text in found)


def test_levers_that_rest_while_the_arm_works_are_told(
    site: Site, lines: list[str], tmp_path: Path
) -> None:
    mapping = bench_mapping()
    names = lines[0].split(",")
    neutral = {c.column: -c.offset / c.scale for c in mapping.joystick.values()}
    rows = [line.split(",") for line in lines[1:]]
    for row in rows:
        for k, name in enumerate(names):
            row[k] = f"{neutral[name]:.9g}" if name in neutral else row[k]
    (text,) = warned(site, tmp_path / "rest.csv", [lines[0], *map(",".join, rows)])
    assert "rest.csv: swing, boom move, and their levers never do" in text


def test_a_few_rows_tell_nothing(site: Site, lines: list[str], tmp_path: Path) -> None:
    assert warned(site, tmp_path / "log.csv", lines[:6]) == ()
