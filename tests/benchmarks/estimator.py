"""The estimator: time of a predict and an observe, and memory of a 28-axis glove.

Run it as ``python tests/benchmarks/estimator.py`` from the project's root. Beside each time of
the paper's recursion stands that of ``numpy.linalg.lstsq`` on all occurrences so far.
"""

from __future__ import annotations

import os
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads only wait for each other here

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from rampe_guard.core.basis import Regressor, affine, quadratic, subset  # noqa: E402
from rampe_guard.core.faithful import Faithful  # noqa: E402
from rampe_guard.core.rampe import Rampe  # noqa: E402
from rampe_guard.core.types import Category, FloatArray  # noqa: E402

WARM = 60
TIMED = 400
LSTSQ_ROWS = (50, 100)
GLOVE_AXES = 28
GLOVE_CATEGORIES = 3_684
GLOVE_PRIMITIVES = 20_000
Step = tuple[Category, FloatArray, FloatArray]


def occurrences(n: int, count: int, seed: int = 0) -> Iterator[Step]:
    """One category, starts in [-1, 1], displacements nearly linear in them."""
    rng = np.random.default_rng(seed)
    slopes = 0.1 * rng.normal(size=(n, n))
    for _ in range(count):
        q = rng.uniform(-1.0, 1.0, n)
        yield (1,) * n, q, np.maximum(0.5 + q @ slopes + 0.05 * rng.normal(size=n), 0.05)


def glove(seed: int = 0) -> Iterator[Step]:
    """1 to 6 of 28 axes move; a few categories come again and again, most hardly ever."""
    rng = np.random.default_rng(seed)
    names: dict[Category, FloatArray] = {}
    while len(names) < GLOVE_CATEGORIES:
        name = np.zeros(GLOVE_AXES, dtype=int)
        moving = rng.choice(GLOVE_AXES, rng.integers(1, 7), replace=False)
        name[moving] = rng.choice([-1, 1], len(moving))
        names[tuple(name.tolist())] = 0.3 + 0.1 * rng.random(GLOVE_AXES)
    frequency = 1.0 / np.arange(1, GLOVE_CATEGORIES + 1)
    again = rng.choice(
        GLOVE_CATEGORIES, GLOVE_PRIMITIVES - GLOVE_CATEGORIES, p=frequency / frequency.sum()
    )
    order = rng.permutation(np.concatenate([np.arange(GLOVE_CATEGORIES), again]))
    known = list(names)
    for i in order:
        name_, size = known[i], names[known[i]]
        q = rng.uniform(0.0, 1.0, GLOVE_AXES)
        x = np.array(name_) * np.maximum(size + 0.03 * rng.normal(size=GLOVE_AXES), 0.02)
        yield name_, q, x


def times_us(model: Any, steps: Iterator[Step]) -> FloatArray:
    """Predict and observe together, each step [µs]."""
    spent = []
    for category, q, x in steps:
        begin = time.perf_counter()
        model.predict(category, q)
        model.observe(category, q, x)
        spent.append(time.perf_counter() - begin)
    return 1e6 * np.array(spent)


def lstsq_us(regressor: Regressor, n: int, rows: int) -> float:
    """Median time of one least-squares solution of ``rows`` occurrences [µs]."""
    steps = list(occurrences(n, rows))
    h = np.array([regressor(q) for _, q, _ in steps])
    x = np.array([x for _, _, x in steps])
    spent = []
    for _ in range(100):
        begin = time.perf_counter()
        np.linalg.lstsq(h, x, rcond=None)
        spent.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(spent))


def covariance(n: int) -> FloatArray:
    """An R that couples all actuators."""
    a = np.random.default_rng(1).normal(size=(n, n))
    return a @ a.T + np.eye(n)


def faithful_table() -> Table:
    """The paper's recursion, after WARM occurrences and in the first 36."""
    seven, different = quadratic(7), [quadratic(7) if j % 2 else affine(7) for j in range(7)]
    reordered = [subset([(j + k) % 7 for k in range(7)], quadratic(7)) for j in range(7)]
    rows: list[tuple[str, int, Faithful, Regressor, float | None]] = [
        ("n 2, p 3 each", 2, Faithful(2), affine(2), 50.0),
        ("  R full", 2, Faithful(2, noise=covariance(2)), affine(2), None),
        ("  R learned", 2, Faithful(2, noise="learned"), affine(2), None),
        ("n 7, p 36 each", 7, Faithful(7, [seven] * 7), seven, 1000.0),
        ("  R full", 7, Faithful(7, [seven] * 7, noise=covariance(7)), seven, 1000.0),
        ("  R learned", 7, Faithful(7, [seven] * 7, noise="learned"), seven, None),
        (
            "  R full, p 36 and 8 in turn",
            7,
            Faithful(7, different, noise=covariance(7)),
            seven,
            None,
        ),
        ("  R full, 7 different h", 7, Faithful(7, reordered, noise=covariance(7)), seven, None),
    ]
    table = Table("faithful: predict + observe")
    for name in ("median [µs]", "p99 [µs]", "target [µs]", "first 36 [µs]"):
        table.add_column(name, justify="right")
    for count in LSTSQ_ROWS:
        table.add_column(f"/ lstsq of {count}", justify="right")
    for label, n, model, regressor, target in rows:
        spent = times_us(model, occurrences(n, WARM + TIMED))
        median, p99 = np.percentile(spent[WARM:], [50, 99])
        ratios = [f"{median / lstsq_us(regressor, n, count):.2f}" for count in LSTSQ_ROWS]
        goal = "" if target is None else f"{target:g}"
        first = f"{np.median(spent[3:36]):.0f}"
        table.add_row(label, f"{median:.0f}", f"{p99:.0f}", goal, first, *ratios)
    return table


def default_table() -> Table:
    """The default mode."""
    table = Table("default: predict + observe", "basis")
    for name in ("median [µs]", "p99 [µs]"):
        table.add_column(name, justify="right")
    for n in (2, 4, 7):
        for basis in ("affine", "quadratic", "radial"):
            model = Rampe(n, basis=basis, limits=np.tile([-2.0, 2.0], (n, 1)))
            spent = times_us(model, occurrences(n, WARM + TIMED))[WARM:]
            median, p99 = np.percentile(spent, [50, 99])
            table.add_row(f"n {n}", basis, f"{median:.0f}", f"{p99:.0f}")
    return table


def glove_table() -> Table:
    """Memory and time of a glove whose categories are mostly rare."""
    table = Table("glove, 28 axes", "categories", "primitives")
    names = ("memory [MB]", "target [MB]", "median [µs]", "p99 [µs]", "target [µs]")
    for name in names:
        table.add_column(name, justify="right")
    limits = np.tile([-2.0, 2.0], (GLOVE_AXES, 1))
    makers: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("default", lambda: Rampe(GLOVE_AXES, limits=limits)),
        ("faithful", lambda: Faithful(GLOVE_AXES)),
    )
    for label, make in makers:
        steps = list(glove())
        spent = update_us(make(), steps)
        tracemalloc.start()
        model = make()
        for category, q, x in steps:
            model.observe(category, q, x)
        taken = tracemalloc.get_traced_memory()[0] / 1e6
        tracemalloc.stop()
        median, p99 = np.percentile(spent, [50, 99])
        table.add_row(
            label,
            str(len(model.categories)),
            str(len(steps)),
            f"{taken:.1f}",
            "50",
            f"{median:.0f}",
            f"{p99:.0f}",
            "200",
        )
    return table


def update_us(model: Any, steps: list[Step]) -> FloatArray:
    """Observe alone, each step [µs]."""
    spent = []
    for category, q, x in steps:
        begin = time.perf_counter()
        model.observe(category, q, x)
        spent.append(time.perf_counter() - begin)
    return 1e6 * np.array(spent)


def main() -> None:
    """All tables."""
    console = Console(width=132)
    console.print(f"medians of {TIMED} occurrences after {WARM}, arguments checked")
    for table in (faithful_table, default_table, glove_table):
        console.print(table())


if __name__ == "__main__":
    main()
