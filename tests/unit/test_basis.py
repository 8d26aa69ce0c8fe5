"""Regressors: their entries, their sizes, and when two are one."""

import numpy as np
import pytest

from rampe_guard.core.basis import Regressor, affine, constant, quadratic, same, subset
from rampe_guard.core.types import FloatArray

Y = np.array([2.0, 3.0, 5.0])


class Cosine:
    """A user's own."""

    size = 2

    def __call__(self, y: FloatArray, /) -> FloatArray:
        return np.array([np.cos(y[0]), 1.0])


@pytest.mark.parametrize(
    ("regressor", "expected"),
    [
        (affine(3), [2, 3, 5, 1]),
        (quadratic(3), [4, 6, 10, 9, 15, 25, 2, 3, 5, 1]),
        (constant(), [1]),
        (subset([2, 0], affine(2)), [5, 2, 1]),
        (subset([1], quadratic(1)), [9, 3, 1]),
        (subset([], constant()), [1]),
        (subset([0], Cosine()), [np.cos(2), 1]),
        (affine(0), None),
    ],
)
def test_entries_and_size(regressor: Regressor, expected: list[float] | None) -> None:
    h = regressor(Y if expected else np.zeros(0))
    np.testing.assert_array_equal(h, expected or [1.0])
    assert h.shape == (regressor.size,)


def test_quadratic_of_seven_values_has_36() -> None:
    assert quadratic(7).size == 36
    assert quadratic(7)(np.arange(7.0)).shape == (36,)


def test_a_regressor_does_not_keep_what_it_returned() -> None:
    regressor = affine(3)
    first = regressor(Y)
    regressor(np.zeros(3))
    np.testing.assert_array_equal(first, [2, 3, 5, 1])


@pytest.mark.parametrize("regressor", [affine(2), quadratic(4), subset([3], affine(1))])
def test_an_observation_of_the_wrong_length_is_refused(regressor: Regressor) -> None:
    with pytest.raises(ValueError, match="3"):
        regressor(Y)


def test_one_value_does_not_pass_for_many() -> None:
    with pytest.raises(ValueError, match=r"\(1,\), need \(2,\)"):
        affine(2)(np.ones(1))


def test_impossible_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match="-1"):
        affine(-1)
    with pytest.raises(ValueError, match="-2"):
        subset([0, -2], affine(2))


def test_same_tells_equal_functions_and_doubts_the_rest() -> None:
    own = Cosine()
    assert same(affine(2), affine(2))
    assert same(subset([1], affine(1)), subset([1], affine(1)))
    assert same(own, own)
    assert same(subset([0], own), subset([0], own))
    assert not same(affine(2), affine(3))
    assert not same(affine(0), constant())
    assert not same(subset([0], affine(1)), subset([1], affine(1)))
    assert not same(own, Cosine())
    assert not same(subset([0], own), subset([0], Cosine()))
