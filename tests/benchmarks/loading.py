"""Loading a mesh of a million triangles: the first time, from the cache, and the memory it takes.

Run it as ``python tests/benchmarks/loading.py`` from the project's root. Each load is a process
of its own, so that the peak of its memory is its own; the time is that of `load_shape` alone,
without starting Python. ``--triangles`` takes another size (2,000,000 is the most).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from rampe_guard.core.types import FloatArray  # noqa: E402

TRIANGLE = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def terrain(triangles: int) -> FloatArray:
    """A closed block with hills on it: about so many triangles (f, 3, 3) [m]."""
    n = int(np.sqrt(triangles / 2)) + 1
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.linspace(-100, 100, n), np.linspace(-100, 100, n), indexing="ij")
    z = 3 * np.sin(0.05 * x) * np.cos(0.07 * y) + 0.3 * np.sin(0.8 * x + y)
    z += 0.01 * rng.normal(size=x.shape)
    top = np.stack([x, y, z], axis=-1).astype(np.float32)
    a, b, c, d = top[:-1, :-1], top[1:, :-1], top[1:, 1:], top[:-1, 1:]
    parts = [np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))]
    rim = np.concatenate([top[:-1, 0], top[-1, :-1], top[:0:-1, -1], top[0, :0:-1]])
    low = rim.copy()
    low[:, 2] = -20.0
    after, low_after = np.roll(rim, -1, axis=0), np.roll(low, -1, axis=0)
    middle = np.broadcast_to(np.array([0, 0, -20], dtype=np.float32), rim.shape)
    parts += [
        np.stack(t, axis=1)
        for t in ((after, rim, low), (after, low, low_after), (low_after, low, middle))
    ]
    return np.concatenate(parts)


def ball(triangles: int) -> FloatArray:
    """A fine ball of 20·4^k triangles (f, 3, 3): every vertex is on the hull, which is hardest."""
    import trimesh  # noqa: PLC0415  # only this case needs it

    level = max(int(np.log(triangles / 20) / np.log(4.0)), 0)
    mesh = trimesh.creation.icosphere(subdivisions=level)
    return np.asarray(mesh.vertices[mesh.faces])


def write(path: Path, triangles: FloatArray) -> None:
    """Write a binary STL."""
    data = np.zeros(len(triangles), dtype=TRIANGLE)
    data["corners"] = triangles
    path.write_bytes(b"\0" * 80 + len(data).to_bytes(4, "little") + data.tobytes())


def load(file: str) -> None:
    """In a process of its own: load, and print what it took."""
    from rampe_guard.collision.shape_cache import load_shape  # noqa: PLC0415

    begin, busy = time.perf_counter(), time.process_time()
    shape = load_shape(file)
    took = {
        "wall_s": time.perf_counter() - begin,
        "busy_s": time.process_time() - busy,
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "triangles": shape.triangles,
        "closed": shape.closed,
    }
    print(json.dumps(took))


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--load", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.load:
        load(arguments.load)
        return
    table = Table(title="Loading a mesh (STL) and its bounding tree")
    for column in ("mesh", "triangles", "", "time [s]", "of it busy [s]", "peak memory [MiB]"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "RAMPE_GUARD_CACHE": str(Path(folder) / "cache")}
        for name, make in (("terrain", terrain), ("ball", ball)):
            file = Path(folder) / f"{name}.stl"
            write(file, make(arguments.triangles))
            for what in ("first time", "from the cache", "from the cache"):
                done = subprocess.run(
                    [sys.executable, __file__, "--load", str(file)],
                    env=environment,
                    cwd=ROOT,
                    check=True,
                    capture_output=True,
                    text=True,
                )
                took = json.loads(done.stdout)
                table.add_row(
                    name,
                    f"{took['triangles']:,}",
                    what,
                    f"{took['wall_s']:.2f}",
                    f"{took['busy_s']:.2f}",
                    f"{took['peak_mib']:.0f}",
                )
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
