"""The mean displacement of each category so far, wherever it began."""

from __future__ import annotations

import numpy as np

from rampe_guard.core.types import Category, FloatArray


class MeanByCategory:
    """Mean displacements, learned one by one."""

    def __init__(self) -> None:
        self._known: dict[Category, tuple[int, FloatArray]] = {}

    def of(self, category: Category) -> FloatArray | None:
        """The mean (n,) [unit]; None for a category never seen."""
        known = self._known.get(category)
        return None if known is None else known[1]

    def learn(self, category: Category, x: FloatArray) -> None:
        """Take a displacement (n,) [unit]."""
        count, mean = self._known.get(category, (0, np.zeros_like(x)))
        self._known[category] = (count + 1, mean + (x - mean) / (count + 1))
