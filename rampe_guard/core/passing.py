"""Within a primitive: what progress, lever and speed say about how far it will still go.

Progress p alone gives the survival form P(X ≥ d | X ≥ p) = S(d)/S(p). The lever says more: who
has begun to let it go will not go much further. A logistic correction learns how much more,
on the log-odds of the survival form:

    logit P = w₀ logit(S(d)/S(p)) + w₁ (u/u_max - 1) + w₂ |u| + w₃ |v|/v_max + b_j

with u the lever now, u_max its largest push in this primitive, and an offset b_j per actuator.
w₀ stays positive, so P falls with d as it must. Learned online by Newton steps on the
penalised likelihood of what became of each primitive. Every moment counts alike: at a moment
taken at random, a long primitive is more likely under way than a short one, and that is the
moment at which a guard asks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit

from rampe_guard.core.types import FloatArray

SHARED = 4
"""Weights that all actuators share: w₀ to w₃."""
_CLIP = 1e-4
_LEAST_SLOPE = 0.2
_PRIOR_MEAN = (1.0, 4.0, 0.0, 0.0)
"""Before any experience: the survival form, less what a released lever says."""
_PRIOR_PRECISION = (4.0, 1.0, 1.0, 1.0)
_OFFSET_PRECISION = 3.0
_COUNT = 0.1
"""Observations that one question at one moment counts as: those of a primitive share one end."""
_FORGETTING = 0.999


@dataclass(frozen=True, slots=True)
class UnderWay:
    """Lever and speed at one moment of a primitive.

    Attributes:
        command: |lever| per actuator (n,) [-].
        peak: its largest value in this primitive (n,) [-].
        speed: speed along Ω (n,) [share of the top speed].
    """

    command: FloatArray
    peak: FloatArray
    speed: FloatArray


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of a primitive under way: progress along Ω (n,) [unit], lever and speed."""

    progress: FloatArray
    under_way: UnderWay


@dataclass(frozen=True, slots=True)
class PassingWeights:
    """w₀ to w₃ (4,) and b (n,)."""

    shared: FloatArray
    offset: FloatArray


class PassingModel:
    """Learns the weights.

    Args:
        actuators: n.

    Attributes:
        weights: as learned.
    """

    def __init__(self, actuators: int) -> None:
        self._prior = np.diag(np.append(_PRIOR_PRECISION, np.full(actuators, _OFFSET_PRECISION)))
        self.mean: FloatArray = np.append(_PRIOR_MEAN, np.zeros(actuators))
        self.precision: FloatArray = self._prior.copy()

    @property
    def weights(self) -> PassingWeights:
        """The weights in force."""
        return PassingWeights(self.mean[:SHARED].copy(), self.mean[SHARED:].copy())

    def learn(
        self, ratio: FloatArray, under_way: UnderWay, actuator: FloatArray, passed: FloatArray
    ) -> None:
        """Take what became of one primitive.

        Args:
            ratio: S(d)/S(p) of k questions (k,).
            under_way: lever and speed at each of them, (k,) each.
            actuator: index of the actuator of each (k,).
            passed: 1 where d was passed, else 0 (k,).
        """
        if len(ratio) == 0:
            return
        rows = np.zeros((len(ratio), len(self.mean)))
        rows[:, 0] = logit(np.clip(ratio, _CLIP, 1.0 - _CLIP))
        rows[:, 1:SHARED] = _lever(under_way).T
        index = actuator.astype(np.intp)
        rows[np.arange(len(ratio)), SHARED + index] = 1.0
        p = expit(rows @ self.mean)
        kept = self._prior + _FORGETTING * (self.precision - self._prior)
        self.precision = kept + (rows.T * (_COUNT * p * (1.0 - p))) @ rows
        step = np.linalg.solve(self.precision, _COUNT * (rows.T @ (passed - p)))
        self.mean = self.mean + step
        self.mean[0] = max(self.mean[0], _LEAST_SLOPE)


def condition(ratio: FloatArray, weights: PassingWeights, under_way: UnderWay) -> FloatArray:
    """P (n,) from the survival form's (n,)."""
    odds = logit(np.clip(ratio, _CLIP, 1.0 - _CLIP))
    result: FloatArray = expit(weights.shared[0] * odds + _bearing(weights, under_way))
    # what is impossible by the limits stays impossible
    return np.where(ratio > 0.0, result, 0.0)


def uncondition(
    probability: FloatArray, weights: PassingWeights, under_way: UnderWay
) -> FloatArray:
    """The survival form's probability (n,) at which P is ``probability`` (n,)."""
    odds = logit(np.clip(probability, _CLIP, 1.0 - _CLIP))
    result: FloatArray = expit((odds - _bearing(weights, under_way)) / weights.shared[0])
    return result


def _bearing(weights: PassingWeights, under_way: UnderWay) -> FloatArray:
    result: FloatArray = weights.shared[1:] @ _lever(under_way) + weights.offset
    return result


def _lever(under_way: UnderWay) -> FloatArray:
    released = under_way.command / np.maximum(under_way.peak, 1e-9) - 1.0
    # centred where a lever held hard stands, so that the weights mean what they say
    return np.stack((np.minimum(released, 0.0), under_way.command - 1.0, under_way.speed - 0.5))
