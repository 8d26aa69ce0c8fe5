"""How far off forecasts are: R(Ω), learned from the errors that were made.

The spread of a person's displacement grows with its size: a tap is repeated to a hair, a long
swing is not. On real operators the variance is about proportional to the mean. So errors e
are standardised by it and by the variance v of the estimate itself,

    z = e / sqrt(u (x̂ + ε u) (1 + v)),    u the actuator's usual displacement,

and the sizes |z| of each actuator are counted. Scale and degrees of freedom of the Student-t
are those that put half of them inside its central 50 % interval and nine tenths inside its
90 % interval. A category scatters more or less than its actuators do on average: by the ratio
of its z² to theirs, drawn towards 1 (large z cut off, so that no single one decides).
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
_POOL = 12.0
"""Errors of a category that its actuators' own spread is worth."""
_PRIOR_ERRORS = 6.0
"""Errors that the prior spread is worth."""
_PRIOR_DOF = 4.0
_MOST_DOF = 60.0
_FRESH = 1.02
"""Growth of the number of errors after which scale and degrees of freedom are reckoned anew."""
_CUT = 6.0
"""z² beyond this many times the category's own counts no more for its spread."""
_BEGUN = 2.0
"""Errors that the scale is worth in the mean of z²."""
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
        squares: sum of the z², cut off, and their number (n, 2).
        scale: scale of z (n,).
        dof: degrees of freedom of z (n,).
        due: number of errors from which both are reckoned anew (n,).
        shape: counts (n, 3, BINS) of displacements by class and by where they fell.
    """

    def __init__(self, actuators: int, prior: float) -> None:
        borders = 2.0 * stdtr(_PRIOR_DOF, _EDGES / prior) - 1.0
        self.sizes: FloatArray = np.tile(_PRIOR_ERRORS * np.diff(borders), (actuators, 1))
        self.squares: FloatArray = np.zeros((actuators, 2))
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
        scale, dof = self.scale[active], self.dof[active]
        if experience is None:
            return scale, dof
        ratio = np.diagonal(experience.surprise) / self._pooled(active)
        return scale * np.sqrt((_POOL + ratio) / (_POOL + experience.evidence)), dof

    def deviation(self, experience: Experience) -> tuple[FloatArray, float]:
        """Root mean square of z (m,), the large ones cut off, and its degrees of freedom.

        The measure for what is no error at all: the tails of `standard` tell what large errors
        do happen, and with few counted they would let anything pass.
        """
        active = experience.active
        count = _POOL + experience.evidence
        mean = (_POOL * self._pooled(active) + np.diagonal(experience.surprise)) / count
        return np.sqrt(mean), min(count, _MOST_DOF)

    def correlation(self, experience: Experience | None, size: int) -> FloatArray:
        """Correlation of the errors (m, m), drawn towards none."""
        if experience is None or size == 1:
            return np.eye(size)
        active = experience.active
        total = experience.surprise + np.diag(_POOL * self._pooled(active))
        root = np.sqrt(np.diagonal(total))
        result: FloatArray = total / (root[:, None] * root)
        return result

    def refresh(self, active: Indices) -> None:
        """Scale and degrees of freedom from the counted sizes."""
        for j in active:
            cumulated = np.cumsum(self.sizes[j])
            cumulated /= cumulated[-1]
            half, most = np.interp((0.5, 0.9), cumulated, _EDGES_IN_USE)
            self.dof[j] = np.interp(-most / half, -_TAIL_RATIO, _DOF)
            self.scale[j] = half / stdtrit(self.dof[j], 0.75)
            self.due[j] = _FRESH * self.squares[j, 1]

    def shapes(self, active: Indices, mean: FloatArray, usual: FloatArray) -> FloatArray:
        """Cumulated shape (m, BINS + 1) of forecasts of size ``mean`` (m,), from 0 to 1."""
        counts = self.shape[active, self._classes(mean, usual)]
        cumulated = np.zeros((len(mean), BINS + 1))
        np.cumsum(counts, axis=1, out=cumulated[:, 1:])
        return cumulated / cumulated[:, -1:]

    def learn(
        self,
        experience: Experience,
        z: FloatArray,
        passed: FloatArray,
        mean: FloatArray,
        usual: FloatArray,
        forgetting: float,
    ) -> None:
        """Take standardised errors z (m,) that fell at the quantiles ``passed`` (m,)."""
        active = experience.active
        self.sizes[active, np.searchsorted(_EDGES, np.abs(z), side="right") - 1] += 1.0
        due = active[self.squares[active, 1] >= self.due[active]]
        if len(due):
            self.refresh(due)
        limit = np.sqrt(_CUT) * self.deviation(experience)[0]
        cut = np.clip(z, -limit, limit)
        self.squares[active, 0] += cut * cut
        self.squares[active, 1] += 1.0
        bins = np.minimum((passed * BINS).astype(np.intp), BINS - 1)
        self.shape[active, self._classes(mean, usual), bins] += 1.0
        experience.surprise = forgetting * experience.surprise + cut[:, None] * cut
        experience.evidence = forgetting * experience.evidence + 1.0

    def _pooled(self, active: Indices) -> FloatArray:
        """Mean of z² (m,), cut off, of all categories; begun from the scale that holds now.

        A prior many times too wide would stay in a mean for hundreds of errors, but not in
        the median that the scale follows.
        """
        total, count = self.squares[active].T
        result: FloatArray = (total + _BEGUN * self.scale[active] ** 2) / (count + _BEGUN)
        return result

    def _classes(self, mean: FloatArray, usual: FloatArray) -> Indices:
        return np.searchsorted(_CLASSES, mean / usual)
