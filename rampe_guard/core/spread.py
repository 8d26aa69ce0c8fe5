"""How far off forecasts are: R(Ω), learned from the errors that were made.

The spread of a person's displacement grows with its size: a tap is repeated to a hair, a long
swing is not. On real operators the variance is about proportional to the mean. So errors e
are standardised by it and by the variance v of the estimate itself,

    z = e / sqrt(u (x̂ + ε u) (1 + v)),    u the actuator's usual displacement,

and the mean of z² is learned per actuator, and for each category on top of that (inverse
gamma: Student-t). Products of the z of different actuators give R(Ω) its correlations. What a
Student-t about the mean cannot say (many displacements are near zero, few are very long) is
learned too: a histogram of where displacements fell in their forecast distribution, for
short, usual and long forecasts of each actuator.
"""

from __future__ import annotations

import numpy as np

from rampe_guard.core.experience import Experience
from rampe_guard.core.types import FloatArray, Indices

BINS = 10
"""Resolution of the learned shape."""
_SMALL = 0.1
"""ε: below this share of the usual displacement the spread stops shrinking."""
_POOL = 6.0
"""Errors of a category that the actuator's own spread is worth; least degrees of freedom."""
_PRIOR_ERRORS = 3.0
"""Errors that the prior spread is worth."""
_MOST_DOF = 60.0
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
        errors: number of errors per actuator (n,), with the prior's.
        squares: sum of their z² (n,), with the prior's.
        shape: counts (n, 3, BINS) of displacements by class and by where they fell.
    """

    def __init__(self, actuators: int, prior: float) -> None:
        self.errors: FloatArray = np.full(actuators, _PRIOR_ERRORS)
        self.squares: FloatArray = np.full(actuators, _PRIOR_ERRORS * prior * prior)
        self.shape: FloatArray = np.full((actuators, len(_CLASSES) + 1, BINS), _SHAPE_WEIGHT / BINS)

    def unit(self, mean: FloatArray, variance: FloatArray, usual: FloatArray) -> FloatArray:
        """What errors are standardised by (m,) [unit], from x̂, v and u (m,)."""
        result: FloatArray = np.sqrt(usual * (mean + _SMALL * usual) * (1.0 + variance))
        return result

    def standard(self, experience: Experience | None, active: Indices) -> tuple[FloatArray, float]:
        """Learned scale of z (m,) and its degrees of freedom."""
        pooled = self.squares[active] / self.errors[active]
        if experience is None:
            return np.sqrt(pooled), _POOL
        own = np.diagonal(experience.surprise)
        dof = _POOL + experience.evidence
        return np.sqrt((_POOL * pooled + own) / dof), min(dof, _MOST_DOF)

    def correlation(self, experience: Experience | None, size: int) -> FloatArray:
        """Correlation of the errors (m, m), drawn towards none."""
        if experience is None:
            return np.eye(size)
        pooled = self.squares[experience.active] / self.errors[experience.active]
        total = experience.surprise + np.diag(_POOL * pooled)
        root = np.sqrt(np.diagonal(total))
        result: FloatArray = total / np.outer(root, root)
        return result

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
        self.errors[active] += 1.0
        self.squares[active] += z * z
        bins = np.minimum((passed * BINS).astype(np.intp), BINS - 1)
        self.shape[active, self._classes(mean, usual), bins] += 1.0
        experience.surprise = forgetting * experience.surprise + np.outer(z, z)
        experience.evidence = forgetting * experience.evidence + 1.0

    def _classes(self, mean: FloatArray, usual: FloatArray) -> Indices:
        return np.searchsorted(_CLASSES, mean / usual)
