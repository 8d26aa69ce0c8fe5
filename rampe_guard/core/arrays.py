"""Snapshots of an estimator: plain arrays by name, read with suspicion.

What differs in size from category to category is laid end to end in one array, and cut off it
again piece by piece.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray

Arrays: TypeAlias = Mapping[str, npt.NDArray[np.generic]]


def entry(arrays: Arrays, name: str) -> npt.NDArray[np.generic]:
    """The array of that name.

    Raises:
        ValueError: there is none, or it holds no numbers.
    """
    if name not in arrays:
        raise ValueError(f"snapshot has no {name}")
    values = np.asarray(arrays[name])
    if values.dtype.kind not in "biuf":
        raise ValueError(f"snapshot has {name} of type {values.dtype}, need numbers")
    return values


def check_settings(arrays: Arrays, settings: Arrays) -> None:
    """See that a snapshot is of an estimator with these ``settings``.

    Raises:
        ValueError: one of them is missing or another.
    """
    for name, mine in settings.items():
        theirs = entry(arrays, name)
        if not np.array_equal(theirs, mine):
            raise ValueError(f"snapshot has {name} {theirs.tolist()}, need {mine.tolist()}")


class Roll:
    """The array ``name``, pieces of it laid end to end.

    Raises:
        ValueError: it is not one row of finite numbers.
    """

    def __init__(self, name: str, arrays: Arrays) -> None:
        self._name = name
        self._values = entry(arrays, name).astype(np.float64)
        self._taken = 0
        if self._values.ndim != 1 or not np.isfinite(self._values).all():
            raise ValueError(
                f"snapshot has {name} {self._values.shape}, need finite numbers in a row"
            )

    def take(self, *shape: int) -> FloatArray:
        """The next piece.

        Raises:
            ValueError: the row ends before it does.
        """
        begin, self._taken = self._taken, self._taken + math.prod(shape)
        if self._taken > len(self._values):
            raise ValueError(
                f"snapshot's {self._name} ends at value {len(self._values)}, too early"
            )
        # a copy, so that its arithmetic is that of any array of this shape
        return self._values[begin : self._taken].reshape(shape).copy()

    def end(self) -> None:
        """See that nothing is left.

        Raises:
            ValueError: something is.
        """
        if self._taken != len(self._values):
            raise ValueError(
                f"snapshot's {self._name} has {len(self._values)} values, need {self._taken}"
            )


def flat(pieces: list[FloatArray]) -> FloatArray:
    """Pieces laid end to end, what a `Roll` takes apart."""
    return np.concatenate([np.zeros(0), *(piece.ravel() for piece in pieces)])
