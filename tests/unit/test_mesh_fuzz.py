from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from rampe_guard.collision.mesh import load_mesh
from rampe_guard.collision.shape import shape_of
from rampe_guard.errors import GeometryError
from tests.support.arms import box_triangles, write_stl
from tests.support.depth import depth

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[2]
EXAMPLES = depth(80, 500)


def run(arguments: list[str], case: Path) -> str:
    """Run a program that FCL may kill, and say of which mesh it died."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if done.returncode:
        held = dict(np.load(case)) if case.exists() else "none"
        pytest.fail(f"exit code {done.returncode} on mesh {held}\n{done.stderr[-3000:]}")
    return done.stdout


def test_no_mesh_that_is_let_through_brings_fcl_or_the_builder_down(tmp_path: Path) -> None:
    case = tmp_path / "case.npz"
    let_through, refused = run(
        ["-m", "tests.support.mesh_fuzz", str(case), str(EXAMPLES)], case
    ).split()
    # both must happen, or nothing was tried
    assert int(let_through) > EXAMPLES // 4
    assert int(refused) > EXAMPLES // 50


def _tiny(path: Path) -> None:
    write_stl(path, 1e-30 * box_triangles((1, 1, 1)))


def _needles(path: Path) -> None:
    rng = np.random.default_rng(0)
    a, way = rng.random((60, 3)), rng.random((60, 3))
    write_stl(path, np.stack([a, a + way, a + 2 * way + 1e-9 * rng.random((60, 3))], axis=1))


def _points(path: Path) -> None:
    rng = np.random.default_rng(0)
    one = np.repeat(rng.random((50, 1, 3)), 3, axis=1)
    write_stl(path, np.concatenate([one, box_triangles((1, 1, 1))]))


def _stacked(path: Path) -> None:
    write_stl(path, np.concatenate([box_triangles((1, 1, 1))] * 40))


def _infinite(path: Path) -> None:
    path.write_text(write_stl(path, box_triangles((1, 1, 1))).read_text().replace("-0.5", "inf", 1))


def _not_a_number(path: Path) -> None:
    path.write_text(write_stl(path, box_triangles((1, 1, 1))).read_text().replace("0.5", "nan", 3))


def _binary_rubbish(path: Path) -> None:
    rng = np.random.default_rng(1)
    path.write_bytes(b"\0" * 80 + (100).to_bytes(4, "little") + rng.bytes(5000))


def _no_faces(path: Path) -> None:
    path.write_bytes(b"\0" * 84)


def _lying_count(path: Path) -> None:
    good = trimesh.creation.box().export(file_type="stl")
    path.write_bytes(good[:80] + (2**32 - 1).to_bytes(4, "little") + good[84:])


FILES: list[Callable[[Path], None]] = [
    *(_tiny, _needles, _points, _stacked, _infinite, _not_a_number),
    *(_binary_rubbish, _no_faces, _lying_count),
]


@pytest.mark.parametrize("write", FILES, ids=lambda write: write.__name__.strip("_"))
def test_nasty_files_are_refused_by_name_or_stand_the_trial(
    tmp_path: Path, write: Callable[[Path], None]
) -> None:
    file, case = tmp_path / "nasty.stl", tmp_path / "case.npz"
    write(file)
    try:
        mesh = load_mesh(file)
    except GeometryError as error:
        assert str(file) in str(error)  # noqa: PT017
        return
    assert shape_of(mesh).triangles == len(mesh.faces)
    np.savez(case, vertices=mesh.vertices, faces=mesh.faces)
    program = (
        "import sys, numpy as np; from tests.support.mesh_fuzz import try_out, TriangleMesh\n"
        "case = np.load(sys.argv[1]); try_out(TriangleMesh(case['vertices'], case['faces']))\n"
    )
    run(["-c", program, str(case)], case)
