"""The estimator through a file: it goes on bit by bit as if nothing had happened."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.intention import Intention
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.store_format import Header, decode, encode
from rampe_guard.runtime.store_keeper import counted, recall
from tests.support.models import bench_limits, bench_site, same_bits, some_header

LIMITS = np.array([[-3.0, 3.0], [0.0, 1.2]])
HEADER = Header(site="s", machine="m", operator="o", actuators=(), settings={})
SIGNS: tuple[Category, ...] = ((1, 0), (1, 1), (-1, 1), (0, -1))
PRIMITIVES = st.lists(
    st.tuples(
        st.sampled_from(SIGNS),
        st.tuples(st.floats(-2.0, 2.0), st.floats(0.2, 1.0)),
        st.floats(0.02, 0.4),
    ),
    max_size=40,
)
Primitives = list[tuple[Category, tuple[float, float], float]]
Maker = Callable[[], Rampe]


def bayesian() -> Rampe:
    return Rampe(2, limits=LIMITS)


def affine() -> Rampe:
    return Rampe(2, limits=LIMITS, basis="affine")


def faithful() -> Rampe:
    return Rampe(2, mode="faithful")


def faithful_that_learns_noise() -> Rampe:
    return Rampe(2, mode="faithful", noise="learned")


MAKERS = (bayesian, affine, faithful, faithful_that_learns_noise)


def learn(rampe: Rampe, primitives: Primitives) -> None:
    for category, q, size in primitives:
        rampe.observe(category, np.array(q), size * np.array(category) * (1.0 + 0.1 * q[0]))


def told(rampe: Rampe) -> list[Any]:
    """What it forecasts for every category, as bytes."""
    forecasts = [rampe.predict(category, np.array([0.5, 0.6])) for category in SIGNS]
    return [f and (f.mean.tobytes(), f.scale.tobytes(), f.occurrences) for f in forecasts]


def through_a_file(rampe: Rampe) -> tuple[Header, dict[str, npt.NDArray[Any]]]:
    return decode(encode(counted(HEADER, rampe), rampe.snapshot()))


@pytest.mark.parametrize("make", MAKERS)
@settings(max_examples=40, deadline=None)
@given(before=PRIMITIVES, after=PRIMITIVES)
def test_it_goes_on_bit_by_bit(make: Maker, before: Primitives, after: Primitives) -> None:
    first, second = make(), make()
    learn(first, before)
    arrays = through_a_file(first)[1]
    assert same_bits(arrays, first.snapshot())
    second.restore(arrays)
    assert same_bits(second.snapshot(), arrays)
    assert told(second) == told(first)
    # primitives without motion that still wait for the next are not in a snapshot: none here
    learn(first, after)
    learn(second, after)
    assert second.categories == first.categories
    assert told(second) == told(first)
    assert same_bits(second.snapshot(), first.snapshot())


@pytest.mark.parametrize("make", MAKERS)
def test_a_model_of_another_kind_is_refused_and_nothing_has_changed(make: Maker) -> None:
    rampe = make()
    learn(rampe, [((1, 0), (0.1, 0.5), 0.2)] * 5)
    before = rampe.snapshot()
    strangers: list[Rampe] = [Rampe(3), Rampe(3, mode="faithful")]
    for stranger in strangers:
        category = (1, 0, -1)
        for k in range(5):
            stranger.observe(category, np.full(3, 0.1 * k), 0.2 * np.array(category))
        content = encode(counted(HEADER, stranger), stranger.snapshot())
        with pytest.raises(ModelFileError, match="its numbers cannot be"):
            recall(content, HEADER, rampe)
        assert same_bits(rampe.snapshot(), before)


@pytest.mark.parametrize("make", MAKERS)
def test_any_array_that_is_missing_or_cut_is_refused(make: Maker) -> None:
    rampe = make()
    learn(rampe, [((1, 1), (0.1 * k, 0.5), 0.2) for k in range(6)])
    header, arrays = through_a_file(rampe)
    empty = make().snapshot()
    for name, array in arrays.items():
        without = {n: a for n, a in arrays.items() if n != name}
        spoilt = [without]
        if array.ndim and len(array):
            spoilt.append({**arrays, name: array[:-1]})
        for bad in spoilt:
            fresh = make()
            with pytest.raises(ModelFileError, match="its numbers cannot be"):
                recall(encode(header, bad), header, fresh)
            assert same_bits(fresh.snapshot(), empty)


def test_the_guards_own_estimator_is_understood(tmp_path: Path) -> None:
    site = bench_site(tmp_path)
    limits, needed = bench_limits(site), some_header(site)
    first, second = (Intention(site.guard, limits).rampe for _ in range(2))
    for k in range(5):
        first.observe((1, 0, 0, 0), np.array([0.1 * k, 0.05, 0.05, 0.05]), np.array([0.3, 0, 0, 0]))
    header = counted(needed, first)
    recalled = recall(encode(header, first.snapshot()), needed, second)
    assert recalled.occurrences == 5
    assert second.categories == {(1, 0, 0, 0): 5}
    assert same_bits(second.snapshot(), first.snapshot())
