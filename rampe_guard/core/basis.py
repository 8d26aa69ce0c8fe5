"""Regressors h_j(y): which functions of an observation a displacement is linear in.

The paper models the displacement of actuator j as x_j = h_j(y) Θ_j, where y = [q, ξ] (m,)
holds the position at the start of the primitive and whatever else was observed. Each h_j may
have a structure of its own; the paper's test uses h_j = [qᵀ, 1].

A regressor is any object with a ``size`` p that maps y to an array (p,), always the same
one for the same y. The ones made here compare by value, so that an estimator can tell that
two actuators have the same (``same``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray


class Regressor(Protocol):
    """Row regressor h of one actuator."""

    @property
    def size(self) -> int:
        """Number p of parameters."""
        ...

    def __call__(self, y: FloatArray, /) -> FloatArray:
        """Regressor (p,) at the observation y (m,)."""
        ...


def affine(m: int) -> Regressor:
    """[y, 1]: linear in each of the ``m`` observed values, p = m + 1."""
    return _Affine(_count(m))


def quadratic(m: int) -> Regressor:
    """[y_a y_b for all a <= b, y, 1]: p = (m + 1)(m + 2) / 2."""
    return _Quadratic(_count(m))


def constant() -> Regressor:
    """[1]: the mean displacement, whatever was observed."""
    return _Constant()


def subset(indices: Sequence[int], inner: Regressor) -> Regressor:
    """``inner`` of the entries ``indices`` of y, in that order."""
    if any(i < 0 for i in indices):
        raise ValueError(f"indices {tuple(indices)} must not be negative")
    return _Subset(tuple(int(i) for i in indices), inner)


def same(a: Regressor, b: Regressor) -> bool:
    """Whether two regressors are known to be one function; False in doubt."""
    if isinstance(a, _Subset) and isinstance(b, _Subset):
        return a.indices == b.indices and same(a.inner, b.inner)
    return a is b or (isinstance(a, _Affine | _Quadratic | _Constant) and a == b)


def _count(m: int) -> int:
    if m < 0:
        raise ValueError(f"an observation cannot have {m} values")
    return int(m)


def _check(y: FloatArray, m: int) -> None:
    # a single value would broadcast and pass for m equal ones
    if y.shape != (m,):
        raise ValueError(f"the observation {y} has shape {y.shape}, need ({m},)")


@dataclass(frozen=True, slots=True)
class _Affine:
    m: int

    @property
    def size(self) -> int:
        return self.m + 1

    def __call__(self, y: FloatArray, /) -> FloatArray:
        _check(y, self.m)
        h = np.empty(self.m + 1)
        h[:-1] = y
        h[-1] = 1.0
        return h


@cache
def _pairs(m: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Indices a <= b of all products of m values."""
    return np.triu_indices(m)


@dataclass(frozen=True, slots=True)
class _Quadratic:
    m: int

    @property
    def size(self) -> int:
        return (self.m + 1) * (self.m + 2) // 2

    def __call__(self, y: FloatArray, /) -> FloatArray:
        _check(y, self.m)
        first, second = _pairs(self.m)
        h = np.empty(self.size)
        np.multiply(y[first], y[second], out=h[: len(first)])
        h[len(first) : -1] = y
        h[-1] = 1.0
        return h


@dataclass(frozen=True, slots=True)
class _Constant:
    @property
    def size(self) -> int:
        return 1

    def __call__(self, y: FloatArray, /) -> FloatArray:  # noqa: ARG002 - that is its point
        return np.ones(1)


@dataclass(frozen=True, slots=True, eq=False)
class _Subset:
    indices: tuple[int, ...]
    inner: Regressor

    @property
    def size(self) -> int:
        return self.inner.size

    def __call__(self, y: FloatArray, /) -> FloatArray:
        if self.indices and max(self.indices) >= len(y):
            raise ValueError(f"the observation {y} has {len(y)} values, need entry {self.indices}")
        return self.inner(y[list(self.indices)])
