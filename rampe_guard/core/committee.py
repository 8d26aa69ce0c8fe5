"""Who knows something about this category: itself, and those that differ in one actuator.

Neighbours in Ω are taken to be correlated by c. What a neighbour knows, a deviation f with
variance v against its prior variance k, is to this category a witness with mean c f and
variance k - c²(k - v). Witnesses add up by precision, the prior counted once (a Bayesian
committee machine). An actuator in which the neighbour differs takes nothing from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rampe_guard.core.config import RampeConfig
from rampe_guard.core.experience import Experience
from rampe_guard.core.radial import RadialFit, RadialKernel
from rampe_guard.core.scales import Scales
from rampe_guard.core.types import Category, FloatArray, Indices

_WITNESSES = 4
"""Most neighbours that are heard: the most experienced ones."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """x̂ along Ω of the actuators that a category moves.

    Attributes:
        mean: x̂ (m,) [unit], not against Ω.
        variance: of the estimate (m,) [variance of the noise].
        usual: usual displacement (m,) [unit]; nan where unknown, and then all is.
        related: the witnesses.
    """

    mean: FloatArray
    variance: FloatArray
    usual: FloatArray
    related: tuple[Category, ...]


@dataclass(frozen=True, slots=True)
class _Neighbour:
    """A category one actuator away, and which of the active actuators both move alike."""

    experience: Experience
    here: Indices
    there: Indices


class Committee:
    """Estimates from experiences.

    Args:
        config: the estimator's settings.
        scales: learned units.

    Attributes:
        experiences: all categories seen.
    """

    def __init__(self, config: RampeConfig, scales: Scales) -> None:
        self._borrow = config.borrow
        self._kernel = RadialKernel(1.0 / config.prior.weight)
        self._scales = scales
        self.experiences: dict[Category, Experience] = {}
        self._fits: dict[Category, RadialFit] = {}
        self._neighbours: dict[Category, list[_Neighbour]] = {}

    def join(self, own: Experience) -> None:
        """From now on a category is heard, and hears: both ways, once for all."""
        found = self._look_round(own.category, own.active)
        for neighbour in found:
            other = neighbour.experience
            back = _Neighbour(own, neighbour.there, neighbour.here)
            self._neighbours[other.category].append(back)
        self._neighbours[own.category] = found
        self.experiences[own.category] = own

    def estimate(
        self, category: Category, active: Indices, own: Experience | None, y: FloatArray
    ) -> Estimate:
        """x̂ at the start y (d,) of a category that moves ``active`` (m,)."""
        usual = self._scales.usual[active]
        weighed = np.zeros(len(active))
        precision: FloatArray = np.full(len(active), 1.0 / self._kernel.variance)
        if own is not None and own.occurrences:
            f, v, _ = self._alone(own, y)
            weighed += f / v
            precision = 1.0 / v  # with the prior of its own basis, counted once
        witnesses = self._witnesses(category, active) if self._borrow > 0.0 else []
        share = self._borrow * self._borrow
        for witness in witnesses:
            f, v, k = self._alone(witness.experience, y)
            v = k - share * (k - v)
            here, there = witness.here, witness.there
            weighed[here] += self._borrow * (f / v)[there]
            precision[here] += (1.0 / v - 1.0 / k)[there]
        mean = np.maximum(usual + weighed / precision, 0.0)
        related = tuple(w.experience.category for w in witnesses)
        return Estimate(mean, 1.0 / precision, usual, related)

    def closeness(self, own: Experience, y: FloatArray) -> FloatArray:
        """How near a category's remembered starts are to y (d,), 0 to 1 (k,)."""
        return self._kernel.closeness(self._fit(own), y * self._scales.inverse)

    def _alone(self, own: Experience, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Deviation from usual, variance and prior variance (m,) by one category alone."""
        usual = self._scales.usual[own.active]
        k: FloatArray = np.full(len(usual), self._kernel.variance)
        f, v = np.zeros(len(usual)), k.copy()
        if sum(len(ridge.columns) for ridge in own.ridges) < len(usual):
            f, v[:] = self._kernel.predict(self._fit(own), y * self._scales.inverse, usual)
        for ridge in own.ridges:
            at = ridge.columns
            f[at], v[at], k[at] = ridge.predict(y, self._scales.slope, usual[at])
        return f, v, k

    def _fit(self, own: Experience) -> RadialFit:
        version = (own.version, self._scales.version)
        fit = self._fits.get(own.category)
        if fit is None or fit.version != version:
            fit = self._kernel.fit(own, self._scales.inverse, version)
            self._fits[own.category] = fit
        return fit

    def _witnesses(self, category: Category, active: Indices) -> list[_Neighbour]:
        """The most experienced neighbours."""
        known = self._neighbours.get(category)
        if known is None:  # never seen
            known = self._look_round(category, active)
        seen = [n for n in known if n.experience.occurrences]
        if len(seen) > _WITNESSES:
            seen.sort(key=lambda n: -n.experience.occurrences)
        return seen[:_WITNESSES]

    def _look_round(self, category: Category, active: Indices) -> list[_Neighbour]:
        signs = np.array(category)
        found = []
        for j, sign in enumerate(category):
            for other in (-1, 0, 1):
                if other == sign:
                    continue
                known = self.experiences.get((*category[:j], other, *category[j + 1 :]))
                if known is not None:
                    here = np.flatnonzero(np.array(known.category)[active] == signs[active])
                    there = np.searchsorted(known.active, active[here])
                    found.append(_Neighbour(known, here, there))
        return found
