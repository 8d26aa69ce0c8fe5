"""The sweep against the dense oracle on hard motions; tests/benchmarks/oracle.py does thousands."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.support.depth import depth
from tests.support.hard_cases import KINDS, PER_BATCH
from tests.support.machines import AbsentError, machine
from tests.support.oracle_run import kind_of, run_batch

if TYPE_CHECKING:
    from rampe_guard.collision.urdf import Arm
    from tests.support.hard_cases import Machine

MOTIONS = {"six_axis": depth(2, 5), "excavator": depth(2, 5), "zx200": depth(1, 3)}
SEED = 3
NEVER = {"missed", "false", "late", "clearance", "now", "place", "any_path"}
EARLY_M = 0.01
"""Motion of a grazing link from where it is within the tolerance to where it touches [m]."""


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@cache
def _machine(name: str, folder: Path) -> tuple[Machine, Arm]:
    return machine(name, folder)


@pytest.mark.no_cover  # dense sampling
@pytest.mark.parametrize("batch", range(len(KINDS)), ids=kind_of)
@pytest.mark.parametrize("name", MOTIONS)
def test_dense_search_refutes_no_certificate(name: str, batch: int, folder: Path) -> None:
    try:
        arms = _machine(name, folder)
    except AbsentError as why:
        pytest.skip(str(why))
    tally = run_batch(*arms, SEED, batch, folder, motions=MOTIONS[name])
    assert tally.motions == MOTIONS[name] <= PER_BATCH
    broken = [story for story in tally.stories if story.split(":")[0] in NEVER]
    assert not broken
    assert tally.early <= EARLY_M
