"""What is remembered of one category: its newest occurrences, as they were.

Observations are kept raw (start y[k], displacement along Ω) and not only their sums: what is
made of them may then depend on scales that are learned later, and a saved model can be read.
Memory is bounded: the newest ``capacity`` occurrences, and of each only the actuators that the
category moves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rampe_guard.core.ridge import Ridge
from rampe_guard.core.types import Category, FloatArray, Indices

_CHANGE_TRUST = 0.1
"""What an occurrence from before a seen change of habit still counts."""
_KEPT = 2
"""The newest occurrences, which showed the change, keep their weight."""


@dataclass(slots=True)
class Experience:
    """Memory of one category.

    Attributes:
        category: Ω.
        active: indices of the actuators it moves (m,).
        starts: observations y at the starts (k, d), oldest first.
        moves: displacements along Ω (k, m) [unit], oldest first.
        trust: weight of each (k,), 1 when new, λ^age later.
        occurrences: primitives of this category ever learned.
        surprise: sum of zzᵀ (m, m) of standardised errors, for R(Ω).
        evidence: how many of them, discounted.
        drift: running sum of standardised errors (m,), for changes of habit.
        version: grows with every change.
        ridges: recursions of the actuators with a basis of finitely many functions.
        suspect: displacement (m,) of an outlier that was set aside, or None.
    """

    category: Category
    active: Indices
    starts: FloatArray
    moves: FloatArray
    trust: FloatArray
    surprise: FloatArray
    drift: FloatArray
    occurrences: int = 0
    evidence: float = 0.0
    version: int = 0
    ridges: list[Ridge] = field(default_factory=list)
    suspect: FloatArray | None = None

    @staticmethod
    def of(category: Category, width: int) -> Experience:
        """An empty memory for observations y of length ``width``."""
        active = np.flatnonzero(category)
        m = len(active)
        return Experience(
            category,
            active,
            starts=np.empty((0, width)),
            moves=np.empty((0, m)),
            trust=np.empty(0),
            surprise=np.zeros((m, m)),
            drift=np.zeros(m),
        )

    def add(self, y: FloatArray, move: FloatArray, capacity: int, forgetting: float) -> None:
        """Keep the occurrence that began at y (d,) and went ``move`` (m,) along Ω."""
        drop = max(len(self.trust) + 1 - capacity, 0)
        self.starts = np.vstack((self.starts[drop:], y))
        self.moves = np.vstack((self.moves[drop:], move))
        self.trust = np.append(forgetting * self.trust[drop:], 1.0)
        for ridge in self.ridges:
            ridge.learn(y, move, forgetting)
        self.occurrences += 1
        self.version += 1

    def distrust(self) -> None:
        """The habit has changed: what was before the newest occurrences counts little."""
        self.trust = self.trust.copy()
        self.trust[:-_KEPT] *= _CHANGE_TRUST
        for ridge in self.ridges:
            ridge.discount(_CHANGE_TRUST)
        self.surprise *= _CHANGE_TRUST
        self.evidence *= _CHANGE_TRUST
        self.drift[:] = 0.0
        self.version += 1
