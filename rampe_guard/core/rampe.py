"""RAMPE: per category Ω, learn the displacement x of a primitive from its start.

Two modes behind one face:

* ``faithful`` (`core.faithful`): the paper to the letter, for the reproduction and for checks.
* ``bayesian`` (default, `core.adaptive`): the same least squares begun from a prior on scaled
  observations, with a predictive distribution, borrowing, and refusal of bad data.

Only categories that were seen cost memory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from rampe_guard.core.adaptive import Adaptive
from rampe_guard.core.adaptive_state import restore, snapshot
from rampe_guard.core.arrays import Arrays
from rampe_guard.core.basis import Regressor, affine
from rampe_guard.core.config import Basis, PriorConfig, RampeConfig
from rampe_guard.core.displacement import DisplacementForecast
from rampe_guard.core.faithful import Faithful
from rampe_guard.core.passing import Moment
from rampe_guard.core.screening import Refusal
from rampe_guard.core.types import Category, FloatArray

__all__ = ["CategoryRow", "DisplacementForecast", "Rampe"]

_N_INIT = 3
"""Of the paper's test."""
_SIGNS = frozenset((-1, 0, 1))
_LARGEST = 1e50
"""Limits beyond are none: the squares of what lies between must stay finite."""


@dataclass(frozen=True, slots=True)
class CategoryRow:
    """One category, for people.

    Attributes:
        category: Ω.
        occurrences: primitives learned.
        mean_displacement: mean of the remembered ones (n,) [unit].
        spread: their standard deviation (n,) [unit].
    """

    category: Category
    occurrences: int
    mean_displacement: FloatArray
    spread: FloatArray


class Rampe:
    """Recursive estimate of the next displacement, one model per category.

    Args:
        actuators: n.
        mode: "bayesian" or "faithful".
        n_init: own occurrences before the first forecast of a category (faithful: 3; bayesian:
            0, a category never seen borrows from related ones).
        tol: relative threshold of the pseudo-inverse (faithful).
        forgetting: λ in (0, 1] (faithful: 1; bayesian: 0.98).
        limits: (n, 2) [unit], scale q and bound predictions; None or infinite without
            (bayesian).
        prior: what is believed before the first occurrence (bayesian).
        basis: "affine", "quadratic" or "radial", or one for each actuator (bayesian).
        config: all settings of the bayesian mode at once, instead of those above.
        observations: length of ξ, what is observed beside q.
        regressors: h_j(y) per actuator (faithful); affine in y for all if None.
        noise: R (n, n), R per category, or "learned" (faithful); identity if None.

    Raises:
        ValueError: a setting that cannot be.
    """

    def __init__(
        self,
        actuators: int,
        mode: Literal["bayesian", "faithful"] = "bayesian",
        n_init: int | None = None,
        tol: float = 1e-9,
        forgetting: float | None = None,
        limits: npt.ArrayLike | None = None,
        prior: PriorConfig | None = None,
        *,
        basis: Basis | Sequence[Basis] | None = None,
        config: RampeConfig | None = None,
        observations: int = 0,
        regressors: Sequence[Regressor] | None = None,
        noise: FloatArray | Mapping[Category, FloatArray] | Literal["learned"] | None = None,
    ) -> None:
        if actuators < 1 or observations < 0:
            raise ValueError(f"{actuators} actuators and {observations} observations cannot be")
        self._n = actuators
        self._observations = observations
        if mode == "bayesian":
            _foreign("faithful", regressors=regressors, noise=noise)
        else:
            _foreign("bayesian", prior=prior, basis=basis, config=config)
        self._faithful: Faithful | None = None
        self._adaptive: Adaptive | None = None
        if mode == "faithful":
            self._faithful = Faithful(
                actuators,
                regressors=regressors or [affine(actuators + observations)] * actuators,
                n_init=_N_INIT if n_init is None else n_init,
                tol=tol,
                forgetting=1.0 if forgetting is None else forgetting,
                noise=noise,
            )
        elif mode == "bayesian":
            settings = config or RampeConfig()
            if n_init is not None:
                settings = replace(settings, n_init=n_init)
            if forgetting is not None:
                settings = replace(settings, forgetting=forgetting)
            if prior is not None:
                settings = replace(settings, prior=prior)
            if basis is not None:
                settings = replace(
                    settings, basis=basis if isinstance(basis, str) else tuple(basis)
                )
            self._adaptive = Adaptive(actuators, _bounds(actuators, limits), settings, observations)
        else:
            raise ValueError(f"mode is {mode!r}, must be 'bayesian' or 'faithful'")

    @property
    def categories(self) -> dict[Category, int]:
        """Occurrences per category seen."""
        if self._adaptive is not None:
            return {
                c: e.occurrences for c, e in self._adaptive.experiences.items() if e.occurrences
            }
        return dict(self._model.categories)

    def occurrences(self, category: Category) -> int:
        """How often a category was seen; unlike `categories` it looks at no other."""
        if self._adaptive is None:
            return self._model.occurrences(category)
        own = self._adaptive.experiences.get(category)
        return 0 if own is None else own.occurrences

    @property
    def refused(self) -> dict[str, int]:
        """Primitives that were not learned, by reason (see `core.screening`)."""
        return {} if self._adaptive is None else dict(self._adaptive.refused)

    def predict(
        self, category: Category, q: npt.ArrayLike, xi: npt.ArrayLike = ()
    ) -> DisplacementForecast | None:
        """Blocks 16 and 19: forecast at the start q (n,), with ξ if the estimator has any.

        Returns:
            The forecast; None before ``n_init`` occurrences, and while nothing is known.

        Raises:
            ValueError: a wrong length, or Ω is no category of these actuators.
        """
        category, y = self._observation(category, q, xi)
        if self._adaptive is not None:
            return self._adaptive.predict(category, y)
        model = self._model
        mean = model.predict(category, y)
        if mean is None:
            return None
        covariance = model.covariance(category, y)
        unknown = np.full(self._n, np.nan)
        return DisplacementForecast(
            category,
            mean,
            scale=unknown,
            dof=unknown,
            occurrences=model.occurrences(category),
            covariance=np.full((self._n, self._n), np.nan) if covariance is None else covariance,
        )

    def observe(
        self, category: Category, q: npt.ArrayLike, x: npt.ArrayLike, xi: npt.ArrayLike = ()
    ) -> Refusal | None:
        """Blocks 5 to 15, 17 and 18: learn that the primitive from q (n,) went x (n,).

        Returns:
            None if it was learned, else why not (bayesian; counted in `refused`).

        Raises:
            ValueError: a wrong length, or Ω is no category of these actuators; faithful: a
                value is not finite. Nothing is learned.
        """
        category, y = self._observation(category, q, xi)
        moved = np.asarray(x, dtype=np.float64)
        if moved.shape != (self._n,):
            raise ValueError(f"x has shape {moved.shape}, need ({self._n},)")
        if self._adaptive is not None:
            return self._adaptive.observe(category, y, moved)
        self._model.observe(category, y, moved)
        return None

    def learn_passing(
        self, forecast: DisplacementForecast, moments: Sequence[Moment], x: FloatArray
    ) -> None:
        """Learn from a finished primitive what lever and speed said about its length.

        Args:
            forecast: that was made at its start.
            moments: on the way, some 0.1 s apart.
            x: its displacement (n,) [unit].
        """
        if self._adaptive is not None:
            self._adaptive.learn_passing(forecast, moments, x)

    def table(self) -> list[CategoryRow]:
        """Every category seen, the most frequent first (bayesian)."""
        if self._adaptive is None:
            return []
        rows = []
        for category, own in self._adaptive.experiences.items():
            if own.occurrences:
                mean, spread = np.zeros(self._n), np.zeros(self._n)
                signs = np.array(category, dtype=np.float64)[own.active]
                mean[own.active] = signs * own.moves.mean(axis=0)
                spread[own.active] = own.moves.std(axis=0)
                rows.append(CategoryRow(category, own.occurrences, mean, spread))
        return sorted(rows, key=lambda row: -row.occurrences)

    def snapshot(self) -> dict[str, npt.NDArray[np.generic]]:
        """All that was learned, as plain numeric arrays."""
        return self._model.snapshot() if self._adaptive is None else snapshot(self._adaptive)

    def restore(self, arrays: Arrays) -> None:
        """Go on where a `snapshot` was taken.

        Raises:
            ValueError: it is of another estimator, or damaged; nothing has changed then.
        """
        if self._adaptive is None:
            self._model.restore(arrays)
        else:
            self._adaptive = restore(self._adaptive, arrays)

    @property
    def _model(self) -> Faithful:
        if self._faithful is None:
            raise AssertionError("one of the two modes is always there")
        return self._faithful

    def _observation(
        self, category: Category, q: npt.ArrayLike, xi: npt.ArrayLike
    ) -> tuple[Category, FloatArray]:
        """Ω as a tuple and the vector y = [q, ξ], checked."""
        y = np.concatenate((np.asarray(q, dtype=np.float64), np.asarray(xi, dtype=np.float64)))
        if len(y) != self._n + self._observations:
            raise ValueError(
                f"q and ξ have {len(y)} values together, need {self._n} + {self._observations}"
            )
        signs = tuple(category)
        if len(signs) != self._n or not any(signs) or not _SIGNS.issuperset(signs):
            raise ValueError(f"category {signs} is not {self._n} signs -1, 0, 1, one of them not 0")
        return tuple(map(int, signs)), y


def _bounds(actuators: int, limits: npt.ArrayLike | None) -> FloatArray:
    """Limits (n, 2), infinite where there are none."""
    if limits is None:
        return np.tile([-np.inf, np.inf], (actuators, 1))
    bounds = np.asarray(limits, dtype=np.float64)
    if bounds.shape != (actuators, 2):
        raise ValueError(f"limits have shape {bounds.shape}, need ({actuators}, 2)")
    sized = np.where(np.isfinite(bounds), bounds, np.array([-_LARGEST, _LARGEST]))
    turned = bounds[:, 0] < bounds[:, 1]  # False for NaN
    if not (turned & (np.abs(sized) <= _LARGEST).all(axis=1)).all():
        raise ValueError(f"limits are {bounds.tolist()}, need lower < upper, within {_LARGEST:g}")
    return bounds


def _foreign(mode: str, **settings: object) -> None:
    """Refuse settings that only the other ``mode`` has, rather than ignore them."""
    given = [name for name, value in settings.items() if value is not None]
    if given:
        raise ValueError(f"{', '.join(given)}: only in mode {mode!r}")
