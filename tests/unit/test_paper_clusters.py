"""Clusters of starts, and of ends from one place."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.paper_clusters import (
    TwoClusters,
    told_apart,
    two_clusters,
    two_ways,
)
from rampe_guard.evaluate.paper_estimates import Run
from tests.support.paper import SPAN, made_run, two_blobs

UP = (0, 1)


def blobs(said: FloatArray | None = None, seed: int = 0, count: int = 40) -> Run:
    category, start, x = two_blobs(np.random.default_rng(seed), count)
    return made_run(category, start, x, said)


def found(run: Run) -> TwoClusters:
    clusters = two_clusters(run, UP, SPAN)
    assert clusters is not None
    return clusters


@pytest.mark.parametrize("seed", range(5))
def test_two_places_with_their_own_displacements_are_found(seed: int) -> None:
    clusters = found(blobs(seed=seed))
    odd = np.arange(40) % 2 == 1
    assert np.array_equal(clusters.second, odd) or np.array_equal(clusters.second, ~odd)
    assert sorted(clusters.starts[:, 0].round(-1)) == [0.0, 20.0]
    assert sorted(clusters.displacements[:, 1]) == pytest.approx([0.02, 0.19], abs=0.005)


@pytest.mark.parametrize("seed", range(5))
def test_an_even_spread_and_one_heap_are_not_two_clusters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    along = rng.uniform(0.0, 60.0, 60)
    spread = np.column_stack([along, np.full(60, 2.8)])
    x = np.column_stack([np.where(along > 30.0, 20.0, 1.0), np.zeros(60)])
    assert two_clusters(made_run([UP] * 60, spread, x), UP, SPAN) is None
    heap = rng.normal([20.0, 2.8], [3.0, 0.02], (60, 2))
    assert two_clusters(made_run([UP] * 60, heap, x), UP, SPAN) is None


def test_two_places_with_one_displacement_leave_nothing_to_tell_apart() -> None:
    category, start, x = two_blobs(np.random.default_rng(1), 40)
    same = np.random.default_rng(2).normal([0.0, 0.1], [0.1, 0.01], x.shape)
    assert two_clusters(made_run(category, start, same), UP, SPAN) is None


def test_too_few_are_no_cluster() -> None:
    assert two_clusters(blobs(count=8), UP, SPAN) is None
    category, start, x = two_blobs(np.random.default_rng(3), 40)
    rare = np.r_[0:40:2, 1:8:2]  # four of the second place only
    assert two_clusters(made_run([category[0]] * 24, start[rare], x[rare]), UP, SPAN) is None


def test_told_apart_is_1_for_the_truth_half_for_a_constant_and_0_for_the_contrary() -> None:
    truth = blobs()
    x = truth.primitives.displacement
    assert told_apart(blobs(x), found(blobs(x)), "faithful", SPAN) == 1.0
    constant = blobs(np.full_like(x, x.mean()))
    assert told_apart(constant, found(constant), "faithful", SPAN) == 0.5
    contrary = blobs(np.roll(x, 1, axis=0))
    assert told_apart(contrary, found(contrary), "faithful", SPAN) == 0.0


def test_told_apart_weighs_both_clusters_alike() -> None:
    category, start, x = two_blobs(np.random.default_rng(4), 60)
    few = np.r_[0:60:2, 1:20:4]  # 30 of the first place, 5 of the second, at the end
    said = np.tile([0.0, 0.02], (35, 1))  # right for the many, wrong for the few
    run = made_run([category[0]] * 35, start[few], x[few], said)
    assert told_apart(run, found(run), "default", SPAN) == pytest.approx(0.5)


def test_two_ways_from_one_place_are_reported_and_from_two_places_not() -> None:
    rng = np.random.default_rng(6)
    start = rng.normal([0.0, 2.79], [1.0, 0.01], (40, 2))
    apart = np.where(np.arange(40) % 2 == 1, 0.19, 0.02)
    x = np.column_stack([np.zeros(40), apart + rng.normal(0.0, 0.005, 40)])
    assert two_ways(made_run([UP] * 40, start, x), UP, SPAN)
    assert not two_ways(blobs(), UP, SPAN)
    one = rng.normal([0.0, 0.1], [0.1, 0.01], (40, 2))
    assert not two_ways(made_run([UP] * 40, start, one), UP, SPAN)
    assert not two_ways(made_run([UP] * 6, start[:6], x[:6]), UP, SPAN)
