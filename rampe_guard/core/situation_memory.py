"""The memory of situations: what this operator and machine did, and how it went on.

It is one long trace of nodes, each a time of work, a position and a situation's point. A node
is kept every tenth of a second while something moves, and once a second while nothing does.
*Similar* are the nodes nearest to the present point, no two of them of the same pass; how it
went on then is the trace behind them.

Nodes lie in chunks in the order of time. A full chunk is never changed again, so its k-d tree
is built once; the newest is looked through as it is. What is old counts as less alike: the
square of its distance grows by (0.1 ln(1 + age/600 s))², so habits that have changed give way to
new ones wherever there are any. The oldest chunk goes when the memory is full.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from rampe_guard.core.arrays import Arrays, entry
from rampe_guard.core.situation import Likeness
from rampe_guard.core.types import FloatArray, Indices

CHUNK: Final = 4096
"""Nodes in a chunk."""
NODE_S: Final = 0.1
"""Time between two nodes while something moves [s]."""
_IDLE_S: Final = 1.0
_STILL: Final = 0.01
"""A point that moved by less since the last node is at rest."""
_GAP_S: Final = 60.0
"""Time of work put where the trace is broken [s]."""
_BROKEN_S: Final = 1.5
"""Nodes further apart than this are not one motion [s]."""
_PASS_S: Final = 2.0
"""Nodes nearer in time than this are of one pass [s]."""
_SPREAD: Final = 0.2
"""Distance at which a situation counts exp(-1/2)."""
_REACH: Final = 3.0 * _SPREAD
_AGEING: Final = 0.1
_AGE_S: Final = 600.0
_CANDIDATES: Final = 32
"""Nodes looked at in each chunk: a pass has several."""
_SPARE: Final = 2
"""Finds kept beyond those wanted: the future of some is not known."""
VERSION: Final = 2
"""Of what a snapshot means."""


@dataclass(frozen=True, slots=True)
class Analogue:
    """A similar situation and how it went on.

    Attributes:
        weight: how much it counts, 1 for one that is the same.
        time_s: of its nodes since then (m,), from 0 on [s].
        path: displacement since then (m, n) [unit].
    """

    weight: float
    time_s: FloatArray
    path: FloatArray


_Find: TypeAlias = tuple[float, float, int, int]
"""A node that was found: how unlike, when [s], where in its chunk, which chunk."""


class _Chunk:
    """Up to `CHUNK` nodes of n actuators."""

    __slots__ = ("clock", "count", "points", "position", "tree")

    def __init__(self, n: int, size: int) -> None:
        self.clock = np.empty(CHUNK)
        self.position = np.empty((CHUNK, n))
        self.points = np.empty((CHUNK, size))
        self.count = 0
        self.tree: cKDTree | None = None

    def add(self, clock: float, position: FloatArray, point: FloatArray) -> None:
        i = self.count
        self.clock[i], self.position[i], self.points[i] = clock, position, point
        self.count += 1
        if self.count == CHUNK:
            # a midpoint tree is built in a third of the time, and these points are no lattice
            self.tree = cKDTree(self.points, balanced_tree=False, compact_nodes=False)

    def near(self, point: FloatArray, reach: float) -> tuple[FloatArray, Indices]:
        """Distance and index of the nearest nodes within reach."""
        if self.tree is not None:
            told = self.tree.query(point, k=_CANDIDATES, distance_upper_bound=reach)
            distance, where = np.asarray(told[0]), np.asarray(told[1], dtype=np.intp)
            found = where < CHUNK
            return distance[found], where[found]
        apart = self.points[: self.count] - point
        square = np.einsum("ij,ij->i", apart, apart)
        index = np.flatnonzero(square < reach * reach)
        if len(index) > _CANDIDATES:
            index = index[np.argpartition(square[index], _CANDIDATES)[:_CANDIDATES]]
        return np.sqrt(square[index]), index


class SituationMemory:
    """Remembers situations and finds similar ones.

    Args:
        likeness: makes their points.
        actuators: n.
        horizon_s: how long a situation's future must be to be of use [s].
        capacity: largest number of nodes; the oldest give way, a chunk at a time.
    """

    def __init__(self, likeness: Likeness, actuators: int, horizon_s: float, capacity: int) -> None:
        self._likeness = likeness
        self._n = actuators
        self._horizon_s = horizon_s
        self._most = max(2, capacity // CHUNK)
        self._chunks: list[_Chunk] = [_Chunk(actuators, likeness.size)]
        self._clock = 0.0
        self._stamp_s: float | None = None
        self._last: tuple[float, FloatArray] | None = None

    @property
    def count(self) -> int:
        """Nodes remembered."""
        return sum(chunk.count for chunk in self._chunks)

    @property
    def hours(self) -> float:
        """Time of work since the first node that is remembered [h]."""
        first = self._chunks[0]
        return (self._clock - float(first.clock[0])) / 3600.0 if first.count else 0.0

    def interrupt(self) -> None:
        """Something was missing: what comes is not how it went on."""
        if self._stamp_s is not None:
            self._stamp_s = None
            self._clock += _GAP_S

    def see(self, stamp_s: float, position: FloatArray, point: FloatArray) -> None:
        """Take the present situation: position (n,) and point (3n + 1,), at a stamp [s]."""
        if self._stamp_s is not None:
            self._clock += max(stamp_s - self._stamp_s, 0.0)
        self._stamp_s = stamp_s
        if self._last is not None:
            clock, before = self._last
            since_s = self._clock - clock
            if since_s < NODE_S - 1e-6:
                return
            if since_s < _IDLE_S and float(np.abs(point - before).max()) < _STILL:
                return
        self._add(position, point)

    def similar(self, point: FloatArray, most: int) -> list[Analogue]:
        """At most ``most`` similar situations of the past, the most alike first."""
        best: list[_Find] = []
        reach = _REACH
        for number in range(len(self._chunks) - 1, -1, -1):
            chunk = self._chunks[number]
            if not chunk.count:
                continue
            # its newest node is the least aged: further than this none of it can be of use
            ageing = _ageing(self._clock - chunk.clock[chunk.count - 1])
            if ageing >= reach:
                break
            near, index = chunk.near(point, float(np.sqrt(reach * reach - ageing * ageing)))
            clock = chunk.clock[index]
            unlike = np.hypot(near, _ageing(self._clock - clock))
            kept = (unlike < reach) & (clock <= self._clock - self._horizon_s)
            columns = unlike[kept].tolist(), clock[kept].tolist(), index[kept].tolist()
            best += [(*find, number) for find in zip(*columns, strict=True)]
            best = _of_distinct_passes(best, most + _SPARE)
            if len(best) == most + _SPARE:
                reach = best[-1][0]
        return self._continued(best, most)

    def snapshot(self) -> dict[str, FloatArray]:
        """All that is remembered; see `restore`."""
        clock, position, points = zip(*self.pieces(), strict=True)
        return {
            "next_version": np.array(VERSION),
            "next_clock": np.concatenate(clock),
            "next_position": np.concatenate(position),
            "next_point": np.concatenate(points).astype(np.float32),
        }

    def pieces(self) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        """The same chunk by chunk: clock (k,) [s], position (k, n) and points (k, 3n + 1).

        What they hold is never written again, so another thread may take its time over them.
        """
        return [
            (c.clock[: c.count], c.position[: c.count], c.points[: c.count]) for c in self._chunks
        ]

    def restore(self, arrays: Arrays | Mapping[str, FloatArray]) -> None:
        """Go on from a snapshot.

        Raises:
            ValueError: it is not of such a memory.
        """
        version = entry(arrays, "next_version")
        if version.shape != () or int(version) != VERSION:
            raise ValueError(f"snapshot has next_version {version.tolist()}, need {VERSION}")
        clock = entry(arrays, "next_clock").astype(np.float64)
        position = entry(arrays, "next_position").astype(np.float64)
        points = entry(arrays, "next_point").astype(np.float64)
        k, n = len(clock) if clock.ndim == 1 else -1, self._n
        if position.shape != (k, n) or points.shape != (k, self._likeness.size):
            raise ValueError(
                f"snapshot has next_position {position.shape} and next_point {points.shape},"
                f" need ({k}, {n}) and ({k}, {self._likeness.size})"
            )
        finite = all(np.isfinite(values).all() for values in (clock, position, points))
        if not finite or (np.diff(clock) < 0.0).any():
            raise ValueError("snapshot's situations are not finite and in order of time")
        self._chunks = [_Chunk(n, self._likeness.size)]
        self._last = self._stamp_s = None
        for now, where, point in zip(clock.tolist(), position, points, strict=True):
            self._clock = now
            self._add(where, point)
        self._clock += _GAP_S

    def _add(self, position: FloatArray, point: FloatArray) -> None:
        if self._chunks[-1].count == CHUNK:
            self._chunks.append(_Chunk(self._n, self._likeness.size))
            if len(self._chunks) > self._most:
                del self._chunks[0]
        self._chunks[-1].add(self._clock, position, point)
        self._last = (self._clock, point)

    def _continued(self, finds: list[_Find], most: int) -> list[Analogue]:
        """The first of them whose future is known."""
        result = []
        for unlike, _, index, number in finds:
            future = self._future(number, index)
            if future is not None:
                weight = math.exp(-0.5 * (unlike / _SPREAD) ** 2)
                result.append(Analogue(weight, *future))
                if len(result) == most:
                    break
        return result

    def _future(self, number: int, index: int) -> tuple[FloatArray, FloatArray] | None:
        """Times (m,) and displacements (m, n) from a node on; None if its trace breaks off."""
        steps = int(self._horizon_s / NODE_S) + 2
        chunk = self._chunks[number]
        end = min(index + steps, chunk.count)
        clock, position = chunk.clock[index:end], chunk.position[index:end]
        if end - index < steps and number + 1 < len(self._chunks):
            after = self._chunks[number + 1]
            rest = min(steps - (end - index), after.count)
            clock = np.concatenate((clock, after.clock[:rest]))
            position = np.concatenate((position, after.position[:rest]))
        time_s = clock - clock[0]
        last = int(np.searchsorted(time_s, self._horizon_s))
        if last == len(time_s) or (np.diff(time_s[: last + 1]) > _BROKEN_S).any():
            return None
        return time_s[: last + 1], position[: last + 1] - position[0]


def _ageing(age_s: Any) -> Any:
    """How unlike age alone makes a node [-], from seconds of work."""
    return _AGEING * np.log1p(np.maximum(age_s, 0.0) / _AGE_S)


def _of_distinct_passes(finds: list[_Find], most: int) -> list[_Find]:
    """The most alike, no two of one pass, most alike first."""
    kept: list[_Find] = []
    for find in sorted(finds):
        clock = find[1]
        for other in kept:
            if -_PASS_S < clock - other[1] < _PASS_S:
                break
        else:
            kept.append(find)
            if len(kept) == most:
                break
    return kept
