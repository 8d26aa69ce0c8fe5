"""Learned models for tests: headers, arrays, and a site whose models are kept in a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rampe_guard.collision import load_arm
from rampe_guard.core.types import FloatArray
from rampe_guard.runtime.store_format import Header, header_of
from rampe_guard.settings import Site, load_site
from tests.support.processes import BENCH

Arrays = Mapping[str, npt.NDArray[Any]]


def bench_site(folder: Path, *, operator: str = "anna", save_every_s: float = 30.0) -> Site:
    """The bench site with an operator, whose models are kept below ``folder``."""
    site = load_site(BENCH)
    memory = replace(site.memory, directory=str(folder), save_every_s=save_every_s)
    return replace(site, operator=operator, memory=memory)


def bench_limits(site: Site) -> FloatArray:
    """Limits of its actuators (4, 2) [unit]."""
    return load_arm(site.arm).limits


def some_header(site: Site) -> Header:
    """The header of a model of the site."""
    return header_of(site, bench_limits(site))


def some_arrays(seed: int = 0) -> dict[str, npt.NDArray[Any]]:
    """Arrays of every kind that a snapshot may hold."""
    rng = np.random.default_rng(seed)
    return {
        "category": rng.integers(-1, 2, (5, 4)).astype(np.int8),
        "theta": rng.normal(size=(5, 3)),
        "count": np.arange(seed, seed + 5),
        "known": np.array([True, False, True]),
        "none": np.empty((0, 4)),
        "scalar": np.array(0.1),
    }


def same_bits(a: Arrays, b: Arrays) -> bool:
    """Same names, types, shapes and bits (so that nan equals the same nan, and -0 is not 0)."""
    if list(a) != list(b):
        return False
    pairs = [(a[name], b[name]) for name in a]
    return all(
        x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes() for x, y in pairs
    )
