"""Compiled kernels belong to what they were compiled from, not to where the package lies."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rampe_guard as rg
from rampe_guard import kernel_cache
from rampe_guard.core.search_kernel import search
from rampe_guard.kernel_cache import KEPT_FOLDERS, UNUSED_S, forget_old

ROOT = Path(__file__).parents[2]
NEWEST_S = 1_700_000_000.0
SWEEP = """
import sys
from pathlib import Path
import rampe_guard as rg
assert Path(rg.__file__).is_relative_to(sys.argv[1]), rg.__file__
rg.Sweeper(rg.load_site(sys.argv[2]))
from rampe_guard.core.search_kernel import search
print(sum(search.stats.cache_hits.values()), sum(search.stats.cache_misses.values()))
"""
KEPT = "from rampe_guard import kernel_cache; print(kernel_cache.kept())"


def run_in(copy: Path, program: str, *args: Path) -> str:
    """What a program prints that finds its rampe_guard in ``copy``."""
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, args)],
        cwd=copy,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with the package in it, as another installation would have it."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "rampe_guard", tmp_path / "rampe_guard", ignore=ignored)
    return tmp_path


def test_the_same_kernels_elsewhere_are_not_compiled_again(copy: Path) -> None:
    site = ROOT / "config" / "sites" / "bench.yaml"
    rg.Sweeper(rg.load_site(site))  # compiled here, if nobody did before
    assert run_in(copy, SWEEP, copy, site) == "1 0"


def test_only_all_kernels_are_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else who comes second compiles the last ones beside the first."""
    rg.Sweeper(rg.load_site(ROOT / "config" / "sites" / "bench.yaml"))
    folder = Path(str(search.stats.cache_path))  # type: ignore[attr-defined]
    monkeypatch.setattr(kernel_cache, "_folder", lambda: tmp_path)
    kept = {path.name.partition("-")[0]: path for path in folder.glob("*.nbi")}
    assert len(kept) == len(kernel_cache.COMPILED)
    for path in kept.values():
        assert not kernel_cache.kept()
        (tmp_path / path.name).touch()
    assert kernel_cache.kept()


@pytest.mark.parametrize("name", ["gjk.py", "arm_kernel.py", "compiled.py"])
def test_other_kernels_are_not_taken_for_those_compiled(copy: Path, name: str) -> None:
    with (copy / "rampe_guard" / "core" / name).open("a") as file:
        file.write("\n# another release\n")
    assert run_in(copy, KEPT) == "False"


def test_another_compiler_has_a_folder_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAMPE_GUARD_CACHE", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    kernel_cache.choose_folder()
    first = os.environ["NUMBA_CACHE_DIR"]
    monkeypatch.setitem(kernel_cache.COMPILER, "numba", "__init__.py")  # other bytes
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    kernel_cache.choose_folder()
    assert {first, os.environ["NUMBA_CACHE_DIR"]} == set(map(str, tmp_path.iterdir()))


def test_where_no_link_can_be_made_each_place_keeps_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise OSError("this file system has no links")

    monkeypatch.setenv("RAMPE_GUARD_CACHE", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(Path, "symlink_to", refused)
    kernel_cache.choose_folder()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).parent == tmp_path


def test_a_folder_that_the_user_gave_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kernel_cache.choose_folder()
    assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path)
    assert not list(tmp_path.iterdir())


def test_only_folders_that_nobody_uses_are_forgotten(tmp_path: Path) -> None:
    ages_s = [0.0, 1.0, UNUSED_S - 1.0, 3 * UNUSED_S, 4 * UNUSED_S, 5 * UNUSED_S]
    for number, age_s in enumerate(ages_s):
        folder = tmp_path / f"kernels-{number}"
        (folder / "shared").mkdir(parents=True)
        (folder / "core_1").symlink_to("shared")
        os.utime(folder, (NEWEST_S - age_s,) * 2)
    (tmp_path / "wall.shape").touch()
    os.utime(tmp_path / "wall.shape", (0.0, 0.0))
    forget_old(tmp_path)
    left = sorted(path.name for path in tmp_path.iterdir())
    assert left == [*(f"kernels-{number}" for number in range(KEPT_FOLDERS)), "wall.shape"]


def test_many_folders_used_within_a_day_all_stay(tmp_path: Path) -> None:
    for number in range(KEPT_FOLDERS + 3):
        (tmp_path / f"kernels-{number}").mkdir()
        os.utime(tmp_path / f"kernels-{number}", (NEWEST_S - number,) * 2)
    forget_old(tmp_path)
    assert len(list(tmp_path.iterdir())) == KEPT_FOLDERS + 3
