"""The default mode: the best forecast of the next displacement that the evidence allows.

Per category Ω, each step on its own and each learned online::

    experience   newest occurrences (start y, displacement along Ω), weighted λ^age
        │
        ├── radial / ridge      x̂ and variance v from this category alone, from a prior
        │        └── committee  the same from categories that differ in one actuator
        │                                  │
    scales  (usual displacement) ──► mean, never against Ω, nor past a limit
    spread  (errors made)        ──► scale, degrees of freedom, covariance, shape
    modes   (two futures?)       ──► both ends
    passing (what became of it)  ──► within the primitive: lever and speed

Changes of habit: λ lets old occurrences fade, and a run of errors to one side, or a second
outlier like the first, makes the older ones count little at once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtr

from rampe_guard.core.basis import affine, quadratic
from rampe_guard.core.committee import Committee, Estimate
from rampe_guard.core.config import Basis, RampeConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.experience import Experience
from rampe_guard.core.modes import TwoFutures, two_futures
from rampe_guard.core.passing import Moment, PassingModel, UnderWay
from rampe_guard.core.ridge import Ridge
from rampe_guard.core.scales import Scales
from rampe_guard.core.screening import MOST_TAPS, Refusal, is_still, screen
from rampe_guard.core.spread import BINS, Spread
from rampe_guard.core.types import Category, FloatArray, Indices

_BASES: tuple[Basis, ...] = ("affine", "quadratic", "radial")
_OUTLIER = 1e-6
"""A displacement less likely than this, by all that is known, is set aside."""
_ALIKE = 0.25
"""Two outliers that differ less than this share of the usual displacement are a habit."""
_DRIFT_MEMORY = 0.8
_DRIFT_LIMIT = 7.5
"""Sum of standardised errors, fading, that chance hardly reaches (some 4 standard deviations)."""
_QUESTIONS = np.array([0.25, 0.5, 1.0, 2.0])
"""Ways ahead of which it is learned whether they were passed [usual displacements]."""
_MODE_DOF = 4.0
_NO_DOF = 4.0
"""Of an actuator that does not move: any will do."""
_LEAST_SCATTER = 0.05


class Adaptive:
    """Bounded, online, per category; see the module.

    Args:
        actuators: n.
        limits: (n, 2) [unit], infinite where there are none.
        config: the estimator's settings.
        observations: length of ξ.
    """

    def __init__(
        self, actuators: int, limits: FloatArray, config: RampeConfig, observations: int = 0
    ) -> None:
        self.n = actuators
        self.width = actuators + observations
        self.limits = limits
        self._config = config
        basis = config.basis
        self._bases = (basis,) * actuators if isinstance(basis, str) else tuple(basis)
        if len(self._bases) != actuators or not set(self._bases) <= set(_BASES):
            raise ValueError(f"basis is {basis}, must be one of {_BASES} or {actuators} of them")
        prior = config.prior
        self.scales = Scales(limits, prior.displacement, observations)
        self.spread = Spread(actuators, prior.spread)
        self.passing = PassingModel(actuators)
        self.refused: Counter[str] = Counter()
        self._committee = Committee(config, self.scales)
        self._taps: list[tuple[Category, FloatArray, FloatArray]] = []
        self._plain = np.tile(np.linspace(0.0, 1.0, BINS + 1), (actuators, 1))
        self._still = 0
        self._lessons = 0
        self._latest: tuple[Category, FloatArray, int, Estimate] | None = None

    @property
    def experiences(self) -> dict[Category, Experience]:
        """All categories seen."""
        return self._committee.experiences

    @property
    def basis_codes(self) -> tuple[int, ...]:
        """The basis of each actuator, as a number."""
        return tuple(_BASES.index(basis) for basis in self._bases)

    def empty(self) -> Adaptive:
        """The same estimator before its first lesson."""
        return Adaptive(self.n, self.limits, self._config, self.width - self.n)

    def predict(self, category: Category, y: FloatArray) -> DisplacementForecast | None:
        """Blocks 16 and 19: forecast at the start y (n + len(ξ),); None if nothing is known."""
        active = np.flatnonzero(category)
        own = self.experiences.get(category)
        occurrences = 0 if own is None else own.occurrences
        if occurrences < self._config.n_init or not np.isfinite(y).all():
            return None
        if not (self.scales.moved[active] > 0.0).all() or np.isnan(self.scales.usual[active]).any():
            return None  # an actuator that has never moved: nothing to borrow
        estimate = self._committee.estimate(category, active, own, y)
        self._latest = (category, y, self._lessons, estimate)
        return self._forecast(category, active, own, y, estimate)

    def observe(self, category: Category, y: FloatArray, x: FloatArray) -> Refusal | None:
        """Blocks 5 to 15, 17, 18: learn that a primitive from y went x (n,), or say why not."""
        refusal = screen(category, y[: self.n], x, self.scales)
        if refusal is None and not np.isfinite(y).all():
            refusal = "not_finite"
        if refusal is None and is_still(x, self.scales):
            return self._still_primitive(category, y, x)
        if refusal is None:
            for tap in self._taps:
                late = self._learn(*tap)
                if late is not None:
                    self.refused[late] += 1
            self._taps, self._still = [], 0
            refusal = self._learn(category, y, x)
        if refusal is not None:
            self.refused[refusal] += 1
        return refusal

    def _recall(
        self, category: Category, own: Experience, known: Experience | None, y: FloatArray
    ) -> Estimate:
        """The estimate that was forecast, if nothing was learned since, else a new one."""
        if self._latest is not None:
            asked, start, lessons, estimate = self._latest
            if asked == category and lessons == self._lessons and np.array_equal(start, y):
                return estimate
        return self._committee.estimate(category, own.active, known, y)

    def learn_passing(
        self, forecast: DisplacementForecast, moments: Sequence[Moment], x: FloatArray
    ) -> None:
        """Learn what lever and speed said, at ``moments``, about a primitive that went x (n,)."""
        active = np.flatnonzero(forecast.category)
        usual = self.scales.usual
        if not moments or not np.isfinite(usual[active]).all() or not np.isfinite(x).all():
            return
        along = np.array(forecast.category, dtype=np.float64) * x
        # (moments, questions, actuators), all at once
        progress = np.stack([moment.progress for moment in moments])[:, None, :]
        distance = progress + _QUESTIONS[:, None] * np.nan_to_num(usual)
        ratio = forecast.passing(distance, progress)
        shape, chosen = ratio.shape, np.s_[:, :, active]

        def rows(values: FloatArray) -> FloatArray:
            result: FloatArray = np.broadcast_to(values, shape)[chosen].ravel()
            return result

        lever = [moment.under_way for moment in moments]
        under_way = UnderWay(
            rows(np.stack([u.command for u in lever])[:, None, :]),
            rows(np.stack([u.peak for u in lever])[:, None, :]),
            rows(np.stack([u.speed for u in lever])[:, None, :]),
        )
        passed = (along >= distance).astype(np.float64)
        self.passing.learn(rows(ratio), under_way, rows(np.arange(float(self.n))), rows(passed))

    def _still_primitive(self, category: Category, y: FloatArray, x: FloatArray) -> Refusal | None:
        self._still += 1
        if self._still <= MOST_TAPS:
            self._taps.append((category, y, x))
            return None
        self.refused["no_motion"] += 1 + len(self._taps)
        self._taps = []
        return "no_motion"

    def _learn(self, category: Category, y: FloatArray, x: FloatArray) -> Refusal | None:
        known = self.experiences.get(category)
        own = known or self.begin(category, y)
        move = np.array(category, dtype=np.float64)[own.active] * x[own.active]
        estimate = self._recall(category, own, known, y)
        if np.isfinite(estimate.usual).all():
            refusal = self._take_error(own, move, estimate)
            if refusal is not None:
                self.add(own)
                return refusal
        own.add(y, move, self._config.memory, self._config.forgetting)
        self.scales.learn(y, x, own.active, move)
        self._lessons += 1
        self.add(own)
        return None

    def _take_error(self, own: Experience, move: FloatArray, estimate: Estimate) -> Refusal | None:
        """Learn from how wrong the forecast was; refuse a first outlier."""
        unit = self.spread.unit(estimate.mean, estimate.variance, estimate.usual)
        z = (move - estimate.mean) / unit
        deviation, count = self.spread.deviation(own)
        if 2.0 * stdtr(count, -np.abs(z) / deviation).min() < _OUTLIER / len(z):
            before, own.suspect = own.suspect, move
            alike = before is not None and bool(
                (np.abs(move - before) <= _ALIKE * np.maximum(estimate.usual, before)).all()
            )
            if not alike:
                return "outlier"
            own.distrust()  # the suspect stays: a third one like it is not held up again
            return None  # a new habit; its distance from the old one is no spread
        own.suspect = None
        self.spread.learn(
            own, z, deviation, estimate.mean / estimate.usual, self._config.forgetting
        )
        own.drift = _DRIFT_MEMORY * own.drift + z / deviation
        if np.abs(own.drift).max() > _DRIFT_LIMIT:
            own.distrust()
        return None

    def add(self, own: Experience) -> None:
        """Make a category known."""
        if own.category not in self.experiences:
            self._committee.join(own)

    def begin(self, category: Category, y: FloatArray) -> Experience:
        """An empty memory for a category that is first seen at y (n + len(ξ),)."""
        own = Experience.of(category, self.width)
        prior = self._config.prior
        low, high = self.scales.low, self.scales.high
        center = np.where(np.isfinite(low), (low + np.where(np.isfinite(low), high, 0.0)) / 2.0, y)
        for name, basis in (("affine", affine(self.width)), ("quadratic", quadratic(self.width))):
            columns = np.flatnonzero([self._bases[j] == name for j in own.active])
            if len(columns):
                weights = (prior.weight, prior.slope_weight)
                own.ridges.append(Ridge.begin(basis, columns, center, *weights))
        return own

    def _forecast(
        self,
        category: Category,
        active: Indices,
        own: Experience | None,
        y: FloatArray,
        estimate: Estimate,
    ) -> DisplacementForecast | None:
        n, q = self.n, y[: self.n]
        sign = np.array(category, dtype=np.float64)
        room = np.where(sign > 0, self.limits[:, 1] - q, q - self.limits[:, 0])
        room = np.where(sign != 0.0, np.maximum(room, 0.0), 0.0)
        standard, dof = self.spread.standard(own, active)
        unit = self.spread.unit(estimate.mean, estimate.variance, estimate.usual)
        mean, scale = np.zeros(n), np.zeros(n)
        mean[active] = np.minimum(estimate.mean, room[active])
        scale[active] = standard * unit
        shape = self._plain.copy()
        shape[active] = self.spread.shapes(active, estimate.mean, estimate.usual)
        degrees = np.full(n, _NO_DOF)
        degrees[active] = dof
        modes, weights = None, np.ones(1)
        futures = self._futures(own, y, estimate.usual)
        if futures is not None:
            modes = np.zeros((2, n))
            modes[:, active] = np.clip(futures.ends, 0.0, room[active])
            weights = futures.shares
            scale[active] = np.maximum(futures.scatter, _LEAST_SCATTER * estimate.usual)
            degrees = np.full(n, _MODE_DOF)
            modes = sign * modes
        signed = sign[active] * scale[active] * _deviation(degrees[active])
        covariance = np.zeros((n, n))
        covariance[np.ix_(active, active)] = np.outer(signed, signed) * self.spread.correlation(
            own, len(active)
        )
        if modes is not None:
            between = modes[0] - modes[1]
            covariance += weights[0] * weights[1] * np.outer(between, between)
        return DisplacementForecast(
            category=category,
            mean=sign * mean,
            scale=scale,
            dof=degrees,
            occurrences=0 if own is None else own.occurrences,
            related=estimate.related,
            covariance=covariance,
            shape=shape,
            modes=modes,
            mode_weights=weights,
            room=room,
            weights=self.passing.weights,
        )

    def _futures(
        self, own: Experience | None, y: FloatArray, usual: FloatArray
    ) -> TwoFutures | None:
        if own is None or len(own.trust) < self._config.two_futures_from:
            return None
        near = self._committee.closeness(own, y)
        return two_futures(own.moves, near * np.minimum(own.trust * 2.0, 1.0), usual)


def _deviation(dof: FloatArray) -> FloatArray:
    """Standard deviation of a Student-t of scale 1; below 3 degrees it is that of 3."""
    freedom = np.maximum(dof, 3.0)
    result: FloatArray = np.sqrt(freedom / (freedom - 2.0))
    return result
