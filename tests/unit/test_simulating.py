"""`simulate` writes a log that can be read; commands find files that we ship by their names."""

from __future__ import annotations

import csv
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.errors import GeometryError, LogError, SettingsError
from rampe_guard.programs.simulating import Wishes, play, write_log
from rampe_guard.resources import data_dir, shipped_instead, shipped_site
from rampe_guard.runtime.stopping import StopFlag

ARM = """<robot name="arm">
  <link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
    <limit lower="0.2" upper="0.9" velocity="0.25" effort="0"/></joint>
  <joint name="follow" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" velocity="1" effort="0"/><mimic joint="slide"/></joint>
</robot>"""


def rows(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(newline="") as file:
        header, *values = csv.reader(file)
    return header, np.array(values, dtype=float)


def test_each_lever_of_a_urdf_moves_its_joint_alone_and_within_its_limits(tmp_path: Path) -> None:
    urdf, out = tmp_path / "arm.urdf", tmp_path / "log.csv"
    urdf.write_text(ARM)
    said = write_log(Wishes(str(urdf), 1, 0), str(out))
    header, values = rows(out)
    assert header == ["t", "u_turn", "u_slide", "turn", "slide"]
    assert f"{len(values)} rows" in said
    assert (np.diff(values[:, 0]) > 0).all()
    levers, positions = values[:, 1:3], values[:, 3:]
    assert not (np.abs(levers) > 0.05).all(axis=1).any()
    assert np.ptp(positions, axis=0).min() > 0.1
    assert positions[:, 1].min() > 0.2 - 0.01
    assert positions[:, 1].max() < 0.9 + 0.01
    fastest = np.abs(np.diff(positions[:, 1]) / np.diff(values[:, 0])).max()
    assert 0.2 < fastest < 0.3


def test_the_demo_works_and_other_sites_move_each_lever(tmp_path: Path) -> None:
    work, moved = tmp_path / "work.csv", tmp_path / "moved.csv"
    write_log(Wishes(str(shipped_site("demo")), 1, 1), str(work))
    write_log(Wishes(str(shipped_site("bench")), 1, 1), str(moved))
    at_once = [(np.abs(rows(path)[1][:, 1:5]) > 0.2).sum(axis=1).max() for path in (work, moved)]
    assert at_once[0] >= 2
    assert at_once[1] == 1


def test_nothing_is_written_over_and_a_urdf_names_no_keys(tmp_path: Path) -> None:
    urdf, out = tmp_path / "arm.urdf", tmp_path / "log.csv"
    urdf.write_text(ARM)
    out.write_text("mine")
    with pytest.raises(LogError, match="there already"):
        write_log(Wishes(str(urdf), 1, 0), str(out))
    assert out.read_text() == "mine"
    with pytest.raises(LogError, match="cannot be written"):
        write_log(Wishes(str(urdf), 1, 0), str(tmp_path / "none" / "log.csv"))
    with pytest.raises(SettingsError, match="--out"):
        play(Wishes(str(urdf), None, 0), [], StopFlag())
    urdf.write_text('<robot name="rock"><link name="rock"/></robot>')
    with pytest.raises(GeometryError, match="no joint"):
        write_log(Wishes(str(urdf), 1, 0), str(tmp_path / "rock.csv"))


def test_a_shipped_file_is_found_by_its_name_where_there_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    demo = "config/sites/demo.yaml"
    told: list[str] = []
    args = Namespace(site=demo, log=[demo, "a.csv"], out=demo, cycles=3, other=None)
    shipped_instead(args, told.append)
    ours = str(data_dir() / demo)
    assert vars(args) == {
        "site": ours,
        "log": [ours, "a.csv"],
        "out": demo,
        "cycles": 3,
        "other": None,
    }
    assert told == [f"{demo}: not here; the one that rampe-guard ships is taken"] * 2
    for name in ("config/nothing.yaml", "config/../pyproject.toml", "config/sites", "/etc/passwd"):
        args = Namespace(site=name)
        shipped_instead(args, told.append)
        assert args.site == name
    (tmp_path / "config" / "sites").mkdir(parents=True)
    (tmp_path / demo).write_text("mine")
    args = Namespace(site=demo)
    shipped_instead(args, told.append)
    assert args.site == demo
