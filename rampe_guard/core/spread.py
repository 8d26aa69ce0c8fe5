"""How far off forecasts are: R(Ω), learned from the errors that were made.

The spread of a person's displacement grows with its size: a tap is repeated to a hair, a long
swing is not. On real operators the variance is about proportional to the mean. So errors e
are standardised by it and by the variance v of the estimate itself,

    z = e / sqrt(u (x̂ + ε u) (1 + v)),    u the actuator's usual displacement,

and a category's own scatter is the root mean square of its z (large ones cut off), drawn
towards what is typical of its actuators, for which the median of |z| stands. Of the z divided
by that, the sizes are counted: scale and degrees of freedom of the Student-t are those that
put half of them inside its central 50 % interval and nine tenths inside its 90 % interval.
Products of the z of different actuators give R(Ω) its correlations.

What a symmetric law about the mean cannot say (many displacements are near zero, few are very
long) is learned too: a histogram of where displacements fell in their forecast distribution,
for short, usual and long forecasts of each actuator.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtr, stdtrit

from rampe_guard.core.experience import Experience
from rampe_guard.core.types import FloatArray, Indices

BINS = 10
"""Resolution of the learned shape."""
_SMALL = 0.1
"""ε: below this share of the usual displacement the spread stops shrinking."""
_POOL = 6.0
"""Errors of a category that its actuators' own spread is worth."""
_PRIOR_ERRORS = 6.0
"""Errors that the prior spread is worth."""
_PRIOR_DOF = 4.0
_MOST_DOF = 60.0
_FRESH = 1.02
"""Growth of the number of errors after which scale and degrees of freedom are reckoned anew."""
_SETTLED = 10.0
"""Errors of an actuator from which their law is learned, and not only their size."""
_CUT = 6.0
"""z² beyond this many times the category's own counts no more for its spread."""
_NORMAL = 1.0 / stdtrit(1e9, 0.75)
"""Standard deviation of a normal law over its median size."""
_EDGES = np.concatenate(([0.0], np.geomspace(0.005, 50.0, 41), [np.inf]))
"""Borders of the histogram of |z|."""
_DOF = np.array([1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 30.0, _MOST_DOF])
_EDGES_IN_USE = np.append(_EDGES[1:-1], 2.0 * _EDGES[-2])
_TAIL_RATIO = stdtrit(_DOF, 0.95) / stdtrit(_DOF, 0.75)
"""Half width of the central 90 % over that of the central 50 %: tells degrees of freedom."""
_SHAPE_WEIGHT = 10.0
"""Displacements that the belief in the plain Student-t is worth."""
_CLASSES = np.array([0.5, 1.5])
"""Borders between short, usual and long forecasts [usual displacements]."""


class Spread:
    """Learned spread of n actuators.

    Args:
        actuators: n.
        prior: standard deviation of a displacement about its model [share of its size].

    Attributes:
        sizes: counts (n, bins) of |z|, with the prior's.
        ratios: counts (n, bins) of |z| / own scatter, with the prior's.
        typical: scatter of z that is typical of an actuator (n,).
        scale: scale of z / own scatter (n,).
        dof: its degrees of freedom (n,).
        errors: number of errors (n,).
        due: number from which the three above are reckoned anew (n,).
        shape: counts (n, 3, BINS) of displacements by class and by where they fell.
    """

    def __init__(self, actuators: int, prior: float) -> None:
        self.sizes: FloatArray = np.tile(_prior_counts(prior), (actuators, 1))
        self.ratios: FloatArray = np.tile(_prior_counts(1.0), (actuators, 1))
        self.errors: FloatArray = np.zeros(actuators)
        self.typical: FloatArray = np.empty(actuators)
        self.scale: FloatArray = np.empty(actuators)
        self.dof: FloatArray = np.empty(actuators)
        self.due: FloatArray = np.zeros(actuators)
        self.refresh(np.arange(actuators))
        self.shape: FloatArray = np.full((actuators, len(_CLASSES) + 1, BINS), _SHAPE_WEIGHT / BINS)

    def unit(self, mean: FloatArray, variance: FloatArray, usual: FloatArray) -> FloatArray:
        """What errors are standardised by (m,) [unit], from x̂, v and u (m,)."""
        result: FloatArray = np.sqrt(usual * (mean + _SMALL * usual) * (1.0 + variance))
        return result

    def standard(
        self, experience: Experience | None, active: Indices
    ) -> tuple[FloatArray, FloatArray]:
        """Learned scale of z and its degrees of freedom (m,) each."""
        scatter = self.typical[active] if experience is None else self.deviation(experience)[0]
        return scatter * self.scale[active], self.dof[active]

    def deviation(self, experience: Experience) -> tuple[FloatArray, float]:
        """A category's own scatter of z (m,), the large ones cut off, and its degrees of freedom.

        Also the measure for what is no error at all: the tails of `standard` tell what large
        errors do happen, and with few counted they would let anything pass.
        """
        count = _POOL + experience.evidence
        typical = self.typical[experience.active]
        mean = (_POOL * typical * typical + np.diagonal(experience.surprise)) / count
        return np.sqrt(mean), min(count, _MOST_DOF)

    def correlation(self, experience: Experience | None, size: int) -> FloatArray:
        """Correlation of the errors (m, m), drawn towards none."""
        if experience is None or size == 1:
            return np.eye(size)
        active = experience.active
        total = experience.surprise + np.diag(_POOL * self.typical[active] ** 2)
        root = np.sqrt(np.diagonal(total))
        result: FloatArray = total / (root[:, None] * root)
        return result

    def refresh(self, active: Indices) -> None:
        """Scatter, scale and degrees of freedom from what was counted."""
        for j in active:
            self.typical[j] = _NORMAL * _quantiles(self.sizes[j])[0]
            half, most = _quantiles(self.ratios[j])
            self.dof[j] = np.interp(-most / half, -_TAIL_RATIO, _DOF)
            self.scale[j] = half / stdtrit(self.dof[j], 0.75)
            self.due[j] = _FRESH * self.errors[j]

    def shapes(self, active: Indices, mean: FloatArray, usual: FloatArray) -> FloatArray:
        """Cumulated shape (m, BINS + 1) of forecasts of size ``mean`` (m,), from 0 to 1."""
        counts = self.shape[active, np.searchsorted(_CLASSES, mean / usual)]
        cumulated = np.zeros((len(mean), BINS + 1))
        np.cumsum(counts, axis=1, out=cumulated[:, 1:])
        return cumulated / cumulated[:, -1:]

    def learn(
        self,
        experience: Experience,
        z: FloatArray,
        scatter: FloatArray,
        length: FloatArray,
        forgetting: float,
    ) -> None:
        """Take standardised errors z (m,) of a category.

        Args:
            experience: its memory.
            z: errors, standardised by `unit`.
            scatter: the category's own (`deviation`) before this one (m,).
            length: of the forecasts (m,) [usual displacements].
            forgetting: λ.
        """
        active = experience.active
        ratio = z / scatter
        # where they fell in what was forecast
        passed = stdtr(self.dof[active], ratio / self.scale[active])
        size = np.abs(z)
        self.sizes[active, _bins(size)] += 1.0
        self.errors[active] += 1.0
        # before the prior's scatter is overcome, errors look smaller or larger than they are
        settled = self.errors[active] > _SETTLED
        self.ratios[active, _bins(np.abs(ratio))] += settled
        due = active[self.errors[active] >= self.due[active]]
        if len(due):
            self.refresh(due)
        limit = np.sqrt(_CUT) * scatter
        cut = np.minimum(np.maximum(z, -limit), limit)
        bins = np.minimum((passed * BINS).astype(np.intp), BINS - 1)
        self.shape[active, np.searchsorted(_CLASSES, length), bins] += settled
        experience.surprise = forgetting * experience.surprise + cut[:, None] * cut
        experience.evidence = forgetting * experience.evidence + 1.0


def _prior_counts(deviation: float) -> FloatArray:
    """Counts (bins,) of |z| that are believed before any was seen."""
    scale = deviation * np.sqrt((_PRIOR_DOF - 2.0) / _PRIOR_DOF)
    result: FloatArray = _PRIOR_ERRORS * np.diff(2.0 * stdtr(_PRIOR_DOF, _EDGES / scale) - 1.0)
    return result


def _bins(size: FloatArray) -> Indices:
    return np.searchsorted(_EDGES, size, side="right") - 1


def _quantiles(counts: FloatArray) -> tuple[float, float]:
    """Median and 90 % quantile of counted sizes."""
    cumulated = np.cumsum(counts)
    half, most = np.interp((0.5, 0.9), cumulated / cumulated[-1], _EDGES_IN_USE)
    return float(half), float(most)
