"""What the paper's algorithm knows of one category, and the same as a row of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rampe_guard.core.arrays import Roll, flat
from rampe_guard.core.noise import LearnedNoise
from rampe_guard.core.rls import Shared, Stacked
from rampe_guard.core.types import FloatArray, Indices


@dataclass(frozen=True, slots=True)
class Group:
    """Actuators that are estimated together.

    Attributes:
        actuators: which (g,), ascending.
        rows: of each of them, or of all (shared), the number of its distinct regressor.
        owner: actuator within the group of each parameter (Σp_j,); None if shared.
        size: parameters of one actuator (shared), or of all.
    """

    actuators: Indices
    rows: tuple[int, ...]
    owner: Indices | None
    size: int


@dataclass(slots=True)
class Memory:
    """What is known of one category Ω.

    Attributes:
        occurrences: how often it was seen (block 17).
        first: regressors (distinct ones in a row) and x of the initialising phase.
        states: least squares of each group; empty while initialising.
        noise: R(Ω), where it is learned.
    """

    occurrences: int = 0
    first: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    states: tuple[Shared | Stacked, ...] = ()
    noise: LearnedNoise | None = None


def pack(memory: Memory) -> FloatArray:
    """All that a category has learned, in a row."""
    parts = [part for pair in memory.first for part in pair]
    for state in memory.states:
        parts += [state.theta, state.moment]
        if isinstance(state, Stacked):
            parts.append(state.cross)
    if memory.noise is not None:
        noise = memory.noise
        parts += [noise.prior, noise.scatter, np.array([noise.weight])]
    return flat(parts)


class Unpacker:
    """Takes memories off a row of numbers, in the order in which ``pack`` laid them down.

    Args:
        row: the numbers.
        n: actuators.
        width: length of all distinct regressors together.
        n_init: occurrences before the first estimate.
        learned: whether each category has a noise of its own.
    """

    def __init__(self, row: Roll, n: int, width: int, n_init: int, *, learned: bool) -> None:
        self._take = row.take
        self._n = n
        self._width = width
        self._n_init = n_init
        self._learned = learned

    def memory(self, groups: Sequence[Group], occurrences: int) -> Memory:
        """The next memory, of a category with these groups.

        Raises:
            ValueError: the row ends before it does.
        """
        memory, n = Memory(occurrences), self._n
        if occurrences < self._n_init:
            memory.first = [(self._take(self._width), self._take(n)) for _ in range(occurrences)]
            return memory
        memory.states = tuple(self._state(group) for group in groups)
        if self._learned:
            prior, scatter = self._take(n), self._take(n, n)
            memory.noise = LearnedNoise(prior, scatter, float(self._take(1)[0]))
        return memory

    def _state(self, group: Group) -> Shared | Stacked:
        p, n = group.size, len(group.actuators)
        if group.owner is None:
            return Shared(self._take(n, p), self._take(p, p))
        return Stacked(self._take(p), self._take(p, p), self._take(p, n), group.owner)
