"""What was read of a URDF is kept, and is the same when it comes back."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rampe_guard.collision import load_arm, urdf_tree
from rampe_guard.collision.shape_cache import ENVIRONMENT, TREE_SUFFIX
from rampe_guard.collision.urdf_tree import read_tree
from tests.support.arms import pendulum, six_axis

ROOT = Path(__file__).parents[2]
EXCAVATOR = ROOT / "geometry/excavator/excavator.urdf"
ODD = """<robot name="odd">
  <link name="a"><visual><origin xyz="nan 0 inf" rpy="0.1 0.2 0.3"/>
    <geometry><mesh filename="b.stl" scale="2 1 -1"/></geometry></visual></link>
  <link name="b"><collision><geometry><mesh filename="c.stl"/></geometry></collision></link>
  <joint name="j" type="prismatic"><parent link="a"/><child link="b"/>
    <mimic joint="k" multiplier="-2"/></joint>
</robot>"""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(ENVIRONMENT, str(folder))
    return folder


def forbidden(*_: object) -> None:
    raise AssertionError("it was kept, yet it is read anew")


@pytest.mark.parametrize("name", ["excavator", "six_axis", "odd"])
def test_what_is_kept_is_what_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = EXCAVATOR
    if name == "six_axis":
        path = Path(six_axis(tmp_path).urdf)
    elif name == "odd":
        path = tmp_path / "odd.urdf"
        path.write_text(ODD)
    first = read_tree(path)
    monkeypatch.setattr(urdf_tree, "parse_urdf", forbidden)
    # to the bit, and what is not finite stays so
    assert msgspec.msgpack.encode(read_tree(path)) == msgspec.msgpack.encode(first)
    assert [joint.name for joint in read_tree(path).joints] == [j.name for j in first.joints]


def test_another_file_under_the_same_name_is_read(tmp_path: Path) -> None:
    description = pendulum(tmp_path)
    path = Path(description.urdf)
    before = load_arm(description)
    path.write_text(path.read_text().replace('lower="-3"', 'lower="-2"'))
    assert (before.limits[0, 0], load_arm(description).limits[0, 0]) == (-3.0, -2.0)


@pytest.mark.parametrize("spoil", ["flip", "cut", "foreign"])
def test_a_damaged_one_is_read_anew(tmp_path: Path, cache: Path, spoil: str) -> None:
    description = pendulum(tmp_path)
    good = load_arm(description)
    (kept,) = cache.glob(f"*{TREE_SUFFIX}")
    content = bytearray(kept.read_bytes())
    if spoil == "flip":
        content[-20] ^= 1
    elif spoil == "cut":
        del content[-20:]
    else:
        content = bytearray(b"no tree at all")
    kept.write_bytes(content)
    again = load_arm(description)
    assert np.array_equal(again.chain.origin, good.chain.origin)
    assert np.array_equal(again.limits, good.limits)
    assert kept.read_bytes() != bytes(content)  # mended


def test_a_machine_whose_shapes_are_kept_starts_without_the_slow_libraries() -> None:
    program = (
        "import sys, rampe_guard as rg\n"
        "rg.Sweeper(rg.load_site(sys.argv[1]))\n"
        "slow = {'trimesh', 'yourdfpy', 'collada', 'networkx', 'shapely'}\n"
        "print(sorted(slow & sys.modules.keys()))"
    )
    site = str(ROOT / "config" / "sites" / "bench.yaml")
    said = [
        subprocess.run(
            [sys.executable, "-c", program, site],
            env=dict(os.environ),
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for _ in range(2)
    ]
    assert "yourdfpy" not in said[0]
    assert said[1] == "[]\n"
