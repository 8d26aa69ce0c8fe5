"""RAMPE as the paper has it: flow-chart blocks 5 to 19 (Fig. 4, Table I), equations (2) to (5).

Per category Ω, one weighted least-squares problem, solved recursively (``rls``). Nothing is
estimated before ``n_init`` occurrences; no prior, no limit, no knowledge of Ω's sign. Blocks
1 to 4 (what a category and a primitive are) stand in ``joystick`` and ``primitive``.

**R(Ω) may be learned** (``noise="learned"``) from the errors of earlier estimates, see
``noise``. When R changes, P changes its scale for the past as well: R is one constant of its
category, only better known now, so the first occurrences are not to be weighed by a first
guess for ever. Θ̂ and P are then those of all occurrences so far under the newest R. (If all
actuators have the same regressor, R cancels from Θ̂ and only P changes.)

Only categories that were seen cost memory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from rampe_guard.core.arrays import Arrays, Roll, check_settings, entry, flat
from rampe_guard.core.basis import Regressor, affine, same
from rampe_guard.core.faithful_memory import Group, Memory, Unpacker, pack
from rampe_guard.core.noise import LearnedNoise, Weighting, weighting
from rampe_guard.core.rls import Shared, Stacked
from rampe_guard.core.types import Category, FloatArray

Noise: TypeAlias = FloatArray | Mapping[Category, FloatArray] | Literal["learned"] | None

_LARGEST = 1e100
"""Values beyond are refused: their squares, and sums of these, must stay finite."""
_VERSION = 1


@dataclass(frozen=True, slots=True)
class _System:
    """What R makes of the regressors: groups, and R restricted to each."""

    noise: Weighting
    groups: tuple[Group, ...]
    weights: tuple[Weighting, ...]


class Faithful:
    """Recursive estimate of the next displacement, one model per category.

    Args:
        actuators: n.
        regressors: h_j of each actuator (n of them); [y, 1] with y = q if None.
        n_init: N_init, occurrences of a category before its first estimate.
        tol: relative size below which singular values of P count as zero.
        forgetting: λ in (0, 1].
        noise: R(Ω), equation (5): one (n, n) for all categories; or one for some categories,
            the others having the identity; or "learned"; the identity if None.

    Raises:
        ValueError: a setting is out of range, or an R not symmetric and positive definite.
    """

    def __init__(
        self,
        actuators: int,
        regressors: Sequence[Regressor] | None = None,
        n_init: int = 3,
        tol: float = 1e-9,
        forgetting: float = 1.0,
        noise: Noise = None,
    ) -> None:
        if actuators < 1 or n_init < 1:
            raise ValueError(f"actuators={actuators} and n_init={n_init} must be at least 1")
        if not (0.0 < forgetting <= 1.0 and 0.0 <= tol < 1.0):
            raise ValueError(f"need 0 < forgetting={forgetting} <= 1 and 0 <= tol={tol} < 1")
        if regressors is None:
            regressors = [affine(actuators)] * actuators
        if len(regressors) != actuators:
            raise ValueError(f"{len(regressors)} regressors for {actuators} actuators")
        self._n = actuators
        self._n_init = n_init
        self._tol = tol
        self._forgetting = forgetting
        self._distinct: list[Regressor] = []
        self._which = [self._number(regressor) for regressor in regressors]
        self._sizes = [int(r.size) for r in self._distinct]
        if min(self._sizes) < 1:
            raise ValueError(f"regressors have sizes {self._sizes}, need at least 1")
        self._learned = isinstance(noise, str)
        if isinstance(noise, str) and noise != "learned":
            raise ValueError(f"noise is {noise!r}, need a matrix, a mapping or 'learned'")
        given = noise if isinstance(noise, Mapping) else {}
        common = np.eye(actuators)
        if noise is not None and not isinstance(noise, str | Mapping):
            common = np.asarray(noise, dtype=np.float64)
        self._common = self._system(common)
        for category in given:
            self._check_category(category)
        self._special = {category: self._system(r) for category, r in given.items()}
        self._memory: dict[Category, Memory] = {}

    @property
    def categories(self) -> dict[Category, int]:
        """Occurrences per category seen."""
        return {category: memory.occurrences for category, memory in self._memory.items()}

    def occurrences(self, category: Category) -> int:
        """How often one category was seen."""
        memory = self._memory.get(category)
        return 0 if memory is None else memory.occurrences

    def predict(self, category: Category, y: FloatArray) -> FloatArray | None:
        """Blocks 16 and 19: x̂ (n,) for the observation y (m,); None before ``n_init``."""
        rows = self._rows(y)
        memory = self._ready(category)
        return None if memory is None else self._estimate(category, memory, rows)

    def observe(self, category: Category, y: FloatArray, x: FloatArray) -> None:
        """Blocks 5 to 15, 17 and 18: learn that the primitive seen as y (m,) went x (n,).

        Raises:
            ValueError: y or x have the wrong length or are not finite; nothing is learned.
        """
        rows = self._rows(y)
        x = np.asarray(x, dtype=np.float64)
        if x.shape != (self._n,) or not _moderate(x):
            raise ValueError(f"x={x} must be ({self._n},), finite and below {_LARGEST:g}")
        memory = self._memory.get(category)
        if memory is None:  # block 6: first time seen
            self._check_category(category)
            memory = Memory()
        if memory.states:
            self._recurse(category, memory, rows, x)
        else:  # block 5: still initialising
            self._initialise(category, memory, rows, x)
        memory.occurrences += 1  # block 17
        self._memory[category] = memory  # block 18

    def covariance(self, category: Category, y: FloatArray) -> FloatArray | None:
        """Predictive covariance H P⁻¹ Hᵀ + R (n, n) [unit²]; None before ``n_init``.

        It is as good as R. P⁻¹ is the pseudo-inverse: of a direction in which no occurrence
        has differed from another, nothing is known, and this sum does not say so.
        """
        rows = self._rows(y)
        memory = self._ready(category)
        if memory is None:
            return None
        system = self._noise_of(category, memory)
        return self._spread(system, memory, rows) + system.noise.covariance

    def noise(self, category: Category) -> FloatArray | None:
        """R(Ω) (n, n) in force [unit²]; None while there is none, if it is learned."""
        memory = self._memory.get(category)
        if self._learned and (memory is None or memory.noise is None):
            return None
        return self._noise_of(category, memory or Memory()).noise.covariance.copy()

    def parameters(self, category: Category) -> tuple[FloatArray, FloatArray] | None:
        """Θ̂ stacked by actuator (Σp_j,) and P (Σp_j, Σp_j); None before ``n_init``."""
        memory = self._ready(category)
        if memory is None:
            return None
        system = self._noise_of(category, memory)
        sizes = np.array([self._sizes[i] for i in self._which])
        ends = np.cumsum(sizes)
        theta, precision = np.zeros(ends[-1]), np.zeros((ends[-1], ends[-1]))
        for group, w, state in zip(system.groups, system.weights, memory.states, strict=True):
            at = np.concatenate([np.arange(ends[j] - sizes[j], ends[j]) for j in group.actuators])
            theta[at] = state.theta.ravel()
            precision[np.ix_(at, at)] = state.precision(w)
        return theta, precision

    def snapshot(self) -> dict[str, npt.NDArray[np.generic]]:
        """Settings and all that was learned, as plain numeric arrays.

        Regressors are functions and not part of it: only their sizes are.
        """
        packed = [pack(memory) for memory in self._memory.values()]
        counts = [memory.occurrences for memory in self._memory.values()]
        return self._settings() | {
            "categories": np.array(list(self._memory), dtype=np.int64).reshape(-1, self._n),
            "occurrences": np.array(counts, dtype=np.int64),
            "values": flat(packed),
        }

    def restore(self, snapshot: Arrays) -> None:
        """Go on, bit for bit, where the estimator stood that gave ``snapshot``.

        Raises:
            ValueError: it is of another estimator, or damaged; nothing has changed then.
        """
        check_settings(snapshot, self._settings())
        categories = _integers(snapshot, "categories")
        counts = _integers(snapshot, "occurrences")
        values = Roll("values", snapshot)
        if counts.ndim != 1 or categories.shape != (len(counts), self._n) or (counts < 1).any():
            raise ValueError(
                f"snapshot has categories of shape {categories.shape}, occurrences {counts}"
            )
        unpacker = Unpacker(values, self._n, sum(self._sizes), self._n_init, learned=self._learned)
        memory: dict[Category, Memory] = {}
        for row, count in zip(categories.tolist(), counts.tolist(), strict=True):
            category = tuple(row)
            self._check_category(category)
            groups = self._special.get(category, self._common).groups
            memory[category] = unpacker.memory(groups, count)
        values.end()
        if len(memory) != len(counts):
            raise ValueError(f"snapshot has {len(counts)} categories, of {len(memory)} names")
        self._memory = memory

    def _initialise(
        self, category: Category, memory: Memory, rows: list[FloatArray], x: FloatArray
    ) -> None:
        memory.first.append((np.concatenate(rows), x.copy()))  # blocks 7 and 8
        if len(memory.first) < self._n_init:  # block 9: first estimate?
            return
        age = np.arange(self._n_init - 1, -1, -1.0)[:, None]
        root = np.sqrt(self._forgetting**age)
        h = root * np.array([h for h, _ in memory.first])
        first_x = np.array([x for _, x in memory.first])
        if self._learned:
            memory.noise = LearnedNoise.begin(first_x)
        system = self._noise_of(category, memory)
        first_x = root * first_x
        columns = np.split(h, np.cumsum(self._sizes)[:-1], axis=1)
        states: list[Shared | Stacked] = []
        for group, w in zip(system.groups, system.weights, strict=True):  # blocks 10 to 12
            mine = np.concatenate([columns[i] for i in group.rows], axis=1)
            to = first_x[:, group.actuators]
            if group.owner is None:
                states.append(Shared.start(mine, to, w, self._tol))
            else:
                states.append(Stacked.start(mine, to, group.owner, w, self._tol))
        memory.states = tuple(states)
        memory.first = []

    def _recurse(
        self, category: Category, memory: Memory, rows: list[FloatArray], x: FloatArray
    ) -> None:
        if memory.noise is not None:
            before = self._noise_of(category, memory)
            spread = self._spread(before, memory, rows)
            error = x - self._estimate(category, memory, rows)
            memory.noise.learn(error, spread, before.noise, self._forgetting)
        system = self._noise_of(category, memory)
        states: list[Shared | Stacked] = []
        for group, w, state in zip(system.groups, system.weights, memory.states, strict=True):
            h = _row(group, rows)
            to = x if len(group.actuators) == self._n else x[group.actuators]
            # blocks 13 to 15
            updated = state.update(h, to, w, self._forgetting, self._tol)
            states.append(updated.reweighted(w, self._tol) if self._learned else updated)
        memory.states = tuple(states)

    def _estimate(self, category: Category, memory: Memory, rows: list[FloatArray]) -> FloatArray:
        """Equation (2)."""
        groups = self._special.get(category, self._common).groups
        if len(groups) == 1:
            return memory.states[0].predict(_row(groups[0], rows))
        x = np.empty(self._n)
        for group, state in zip(groups, memory.states, strict=True):
            x[group.actuators] = state.predict(_row(group, rows))
        return x

    def _spread(self, system: _System, memory: Memory, rows: list[FloatArray]) -> FloatArray:
        """H P⁻¹ Hᵀ (n, n)."""
        spread = np.zeros((self._n, self._n))
        for group, w, state in zip(system.groups, system.weights, memory.states, strict=True):
            block = np.ix_(group.actuators, group.actuators)
            spread[block] = state.spread(_row(group, rows), w, self._tol)
        return spread

    def _rows(self, y: FloatArray) -> list[FloatArray]:
        """Distinct regressors at y, each checked."""
        y = np.asarray(y, dtype=np.float64)
        if y.ndim != 1 or not _moderate(y):
            raise ValueError(f"y={y} must be one row, finite and below {_LARGEST:g}")
        rows = []
        for regressor, size in zip(self._distinct, self._sizes, strict=True):
            h = np.asarray(regressor(y), dtype=np.float64)
            if h.shape != (size,) or not _moderate(h):
                raise ValueError(
                    f"regressor {regressor} gave {h} for y={y},"
                    f" need ({size},), finite and below {_LARGEST:g}"
                )
            rows.append(h)
        return rows

    def _ready(self, category: Category) -> Memory | None:
        """Memory of a category that has an estimate."""
        memory = self._memory.get(category)
        if memory is None:
            self._check_category(category)
            return None
        return memory if memory.states else None  # block 5

    def _check_category(self, category: Category) -> None:
        if len(category) != self._n or any(sign not in (-1, 0, 1) for sign in category):
            raise ValueError(f"category {category} must be {self._n} signs of -1, 0 and 1")

    def _number(self, regressor: Regressor) -> int:
        for i, known in enumerate(self._distinct):
            if same(known, regressor):
                return i
        self._distinct.append(regressor)
        return len(self._distinct) - 1

    def _noise_of(self, category: Category, memory: Memory) -> _System:
        fixed = self._special.get(category, self._common)
        if memory.noise is None:
            return fixed
        w = weighting(memory.noise.covariance(), coupled=True)
        return _System(w, fixed.groups, tuple(w.restricted(g.actuators) for g in fixed.groups))

    def _system(self, covariance: FloatArray) -> _System:
        if np.shape(covariance) != (self._n, self._n):
            raise ValueError(f"R has shape {np.shape(covariance)}, need ({self._n}, {self._n})")
        w = weighting(covariance, coupled=self._learned)
        groups: list[Group] = []
        sharing: dict[int, list[int]] = {}
        for component in w.components:
            which = [self._which[j] for j in component]
            if len(set(which)) == 1:
                sharing.setdefault(which[0], []).extend(component.tolist())
                continue
            sizes = [self._sizes[i] for i in which]
            owner = np.repeat(np.arange(len(which)), sizes)
            groups.append(Group(component, tuple(which), owner, sum(sizes)))
        for i, actuators in sharing.items():
            at = np.array(sorted(actuators), dtype=np.intp)
            groups.append(Group(at, (i,), None, self._sizes[i]))
        return _System(w, tuple(groups), tuple(w.restricted(g.actuators) for g in groups))

    def _settings(self) -> dict[str, npt.NDArray[np.generic]]:
        """What must agree for a snapshot to fit."""
        special = sorted(self._special)
        matrices = [self._special[category].noise.covariance for category in special]
        return {
            "version": np.array([_VERSION]),
            "actuators": np.array([self._n]),
            "n_init": np.array([self._n_init]),
            "tol": np.array([self._tol]),
            "forgetting": np.array([self._forgetting]),
            "regressor_sizes": np.array([self._sizes[i] for i in self._which]),
            "regressor_of": np.array(self._which),
            "noise_learned": np.array([int(self._learned)]),
            "noise": self._common.noise.covariance.copy(),
            "noise_categories": np.array(special, dtype=np.int64).reshape(-1, self._n),
            "noise_special": np.array(matrices).reshape(-1, self._n, self._n),
        }


def _row(group: Group, rows: list[FloatArray]) -> FloatArray:
    """Regressors of a group in a row."""
    if group.owner is None:
        return rows[group.rows[0]]
    return np.concatenate([rows[i] for i in group.rows])


def _moderate(v: FloatArray) -> bool:
    """Whether v (p,) is finite and of a size that can be squared."""
    with np.errstate(over="ignore", invalid="ignore"):
        # one product is several times faster than isfinite; with nan it is False too
        return bool(v.dot(v) < _LARGEST**2)


def _integers(snapshot: Arrays, name: str) -> npt.NDArray[np.int64]:
    array = entry(snapshot, name)
    if array.dtype.kind not in "iu":
        raise ValueError(f"snapshot has {name} of type {array.dtype}, need integers")
    return array.astype(np.int64)
