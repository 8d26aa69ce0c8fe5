"""The sweep against dense sampling on random motions; tests/benchmarks/oracle.py does many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.core.scene import Scene
from rampe_guard.core.types import Certificate
from tests.support.arms import six_axis
from tests.support.compare import compare
from tests.support.dense import DenseArm
from tests.support.scenes import random_motion, random_scene

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.types import FloatArray


@pytest.mark.parametrize("seed", range(6))
def test_dense_sampling_finds_nothing_that_the_sweep_calls_free(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    description = six_axis(tmp_path)
    arm, dense = load_arm(description), DenseArm(description)
    items = random_scene(rng, tmp_path, 1.0)
    sweeper = FclSweeper(arm, Scene(tuple(items)))
    for _ in range(3):
        start, displacement = random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.25)
        wrong = [v for v in compare(sweeper, dense, items, start, displacement) if v.wrong]
        assert not wrong


class _Liar:
    """An oracle whose directions are noise; only its exact distances are true."""

    def __init__(self, true: object, seed: int) -> None:
        self._true = true
        self._rng = np.random.default_rng(seed)

    def __getattr__(self, name: str) -> object:
        return getattr(self._true, name)

    def direction(self, *_: object, swapped: bool) -> FloatArray:
        del swapped
        n = self._rng.normal(size=3)
        return np.asarray(n / np.linalg.norm(n))


def test_lying_directions_cost_queries_but_never_the_truth(tmp_path: Path) -> None:
    rng = np.random.default_rng(21)
    arm = load_arm(six_axis(tmp_path))
    items = random_scene(rng, tmp_path, 0.9)
    honest, fooled = (FclSweeper(arm, Scene(tuple(items))) for _ in range(2))
    fooled._oracle = _Liar(fooled._oracle, 0)  # type: ignore[assignment]
    contacts = 0
    for _ in range(6):
        start, displacement = random_motion(rng, np.full(6, -2.0), np.full(6, 2.0), 0.25)
        truth = honest.sweep(start, displacement)
        result = fooled.sweep(start, displacement)
        for a, b in zip(truth.zones, result.zones, strict=True):
            if b.certificate is Certificate.FREE:
                assert a.certificate is Certificate.FREE
            if a.certificate is Certificate.CONTACT:
                contacts += 1
                assert a.contact_fraction is not None
                assert b.contact_fraction is not None
                assert b.contact_fraction <= a.contact_fraction + 1e-3
    assert contacts
