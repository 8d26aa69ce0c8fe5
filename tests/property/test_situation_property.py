"""The memory of situations against a search that looks at every node."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core import situation_memory
from rampe_guard.core.scenario import scenarios
from rampe_guard.core.situation import TRAVEL_S, Likeness
from rampe_guard.core.situation_memory import Analogue, SituationMemory
from rampe_guard.core.types import FloatArray

TOP = np.array([1.0, 0.2])
LIKENESS = Likeness(TOP)
HORIZON_S = 2.0
FREE = (np.full(2, -np.inf), np.full(2, np.inf))


def work(
    memory: SituationMemory, seed: int, seconds: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wander about for a while; returns times, positions and points of all that was seen."""
    rng = np.random.default_rng(seed)
    position, velocity = np.zeros(2), np.zeros(2)
    times, places, points = [], [], []
    for k in range(round(seconds / 0.05)):
        if k % 20 == 0:
            velocity = rng.choice([-1.0, 0.0, 1.0], 2) * rng.uniform(0.2, 1.0, 2) * TOP
        position = np.clip(position + 0.05 * velocity, -TOP, TOP)
        point = LIKENESS.point(position, velocity, np.sign(velocity))
        memory.see(k * 0.05, position, point)
        times.append(k * 0.05)
        places.append(position)
        points.append(point)
    return np.array(times), np.array(places), np.array(points)


@pytest.fixture(autouse=True, scope="module")
def small_chunks() -> Iterator[None]:
    """Many chunks in a short while; all nodes of each are looked at."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(situation_memory, "CHUNK", 64)
        patch.setattr(situation_memory, "_CANDIDATES", 64)
        yield


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_nearest_of_each_pass_are_found_as_by_looking_at_all(seed: int) -> None:
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 100_000)
    work(memory, seed, 60.0)
    asked = LIKENESS.point(np.array([0.3, 0.0]), np.array([0.5, 0.1]), np.array([1.0, 1.0]))
    kept = memory.snapshot()
    clock = kept["next_clock"]
    apart = np.sqrt(((kept["next_point"] - asked) ** 2).sum(axis=1))
    age = clock[-1] - clock
    unlike = np.hypot(apart, 0.1 * np.log1p(age / 600.0))
    unlike[(clock > clock[-1] - HORIZON_S) | (unlike >= 0.6)] = np.inf
    best: list[int] = []
    for i in np.argsort(unlike):
        if np.isfinite(unlike[i]) and all(abs(clock[i] - clock[j]) >= 2.0 for j in best):
            best.append(int(i))
    found = memory.similar(asked, 4)
    expected = np.exp(-0.5 * (unlike[best[:4]] / 0.2) ** 2)
    weights = [a.weight for a in found]
    assert weights == sorted(weights, reverse=True)
    np.testing.assert_allclose(weights[:1], expected[:1], atol=1e-3)
    # at the seam of two chunks a pass may be told by another of its nodes
    assert sum(weights) == pytest.approx(expected.sum(), rel=0.1, abs=0.05)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_what_is_told_to_go_on_is_what_truly_went_on(seed: int) -> None:
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 100_000)
    _, _, points = work(memory, seed, 60.0)
    kept = memory.snapshot()
    clock, position = kept["next_clock"], kept["next_position"]
    for analogue in memory.similar(points[400], 8):
        assert analogue.time_s[0] == 0.0
        assert analogue.time_s[-2] < HORIZON_S <= analogue.time_s[-1] + 1e-9
        m = len(analogue.time_s)
        assert any(
            np.allclose(clock[i : i + m] - clock[i], analogue.time_s)
            and np.allclose(position[i : i + m] - position[i], analogue.path)
            for i in range(len(clock) - m + 1)
        )


def test_a_snapshot_goes_on_where_it_was() -> None:
    memory, other = (SituationMemory(LIKENESS, 2, HORIZON_S, 100_000) for _ in range(2))
    _, _, points = work(memory, 3, 60.0)
    memory.interrupt()
    other.restore(memory.snapshot())
    assert other.count == memory.count
    for point in points[::50]:
        mine, theirs = memory.similar(point, 8), other.similar(point, 8)
        np.testing.assert_allclose([a.weight for a in mine], [a.weight for a in theirs], atol=1e-4)


@pytest.mark.parametrize("spoil", ["next_version", "next_clock", "next_position", "next_point"])
def test_a_snapshot_that_does_not_fit_is_refused(spoil: str) -> None:
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 100_000)
    work(memory, 3, 10.0)
    kept = memory.snapshot()
    bad = {**kept, spoil: kept[spoil][..., :-1] if kept[spoil].ndim else np.array(99)}
    with pytest.raises(ValueError, match="snapshot"):
        SituationMemory(LIKENESS, 2, HORIZON_S, 100_000).restore(bad)
    del bad[spoil]
    with pytest.raises(ValueError, match="snapshot"):
        SituationMemory(LIKENESS, 2, HORIZON_S, 100_000).restore(bad)


def test_memory_is_bounded_and_the_oldest_goes() -> None:
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 256)
    work(memory, 5, 120.0)
    assert 192 <= memory.count <= 256
    assert memory.hours < 120.0 / 3600.0


def test_nothing_is_told_across_an_interruption() -> None:
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 100_000)
    point = LIKENESS.point(np.zeros(2), TOP, np.ones(2))
    for k in range(100):
        memory.see(k * 0.1, 0.01 * k * TOP, point + 0.02 * (k % 2))
        if k == 50:
            memory.interrupt()
    for analogue in memory.similar(point, 32):
        assert np.diff(analogue.time_s).max() < 0.5


def test_new_habits_take_the_place_of_old_ones() -> None:
    """An hour of going on to the right, then some minutes of going on to the left."""
    memory = SituationMemory(LIKENESS, 2, HORIZON_S, 100_000)
    start = LIKENESS.point(np.zeros(2), np.zeros(2), np.array([1.0, 0.0]))
    stamp = 0.0

    def cycle(side: float) -> None:
        nonlocal stamp
        for k in range(40):
            stamp += 0.1
            place = np.array([side * min(k * 0.05, 1.0), 0.0])
            spread = LIKENESS.point(place, side * TOP, np.array([1.0, side]))
            memory.see(stamp, place, start if k == 0 else spread + 0.02 * (k % 2))

    def to_the_left() -> float:
        found = memory.similar(start, 8)
        left = sum(a.weight for a in found if a.path[-1][0] < 0.0)
        return left / sum(a.weight for a in found)

    for _ in range(900):
        cycle(1.0)
    assert to_the_left() == 0.0
    for _ in range(30):
        cycle(-1.0)
    assert to_the_left() > 0.9


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 8))
def test_scenarios_keep_all_weight_and_stay_near_their_ways(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    time_s: FloatArray = np.arange(21, dtype=np.float64) * 0.1
    analogues = [
        Analogue(
            float(rng.uniform(0.1, 1.0)),
            time_s,
            np.vstack((np.zeros(2), np.cumsum(rng.normal(0.0, 0.05, (20, 2)) * TOP, axis=0))),
        )
        for _ in range(count)
    ]
    found = scenarios(analogues, FREE, LIKENESS.travel)
    assert sum(s.weight for s in found) == pytest.approx(sum(a.weight for a in analogues))
    assert sum(s.count for s in found) == count
    for scenario in found:
        near = min(
            float(
                np.abs(
                    (_along(scenario.time_s, scenario.corners, time_s) - a.path) / LIKENESS.travel
                ).max()
            )
            for a in analogues
        )
        assert near <= 0.03 + 1e-9
    room = (np.full(2, -0.01), np.full(2, 0.02))
    for scenario in scenarios(analogues, room, LIKENESS.travel):
        assert (scenario.corners >= room[0]).all()
        assert (scenario.corners <= room[1]).all()


def _along(time_s: FloatArray, corners: FloatArray, at: FloatArray) -> FloatArray:
    return np.stack([np.interp(at, time_s, column) for column in corners.T], axis=1)


def test_distance_is_in_seconds_of_travel_whatever_the_machine() -> None:
    small, large = Likeness(np.array([0.01])), Likeness(np.array([2.0]))
    still = np.zeros(1)
    a = small.point(np.array([0.01 * TRAVEL_S]), still, still)
    b = large.point(np.array([2.0 * TRAVEL_S]), still, still)
    np.testing.assert_allclose(a, b)
