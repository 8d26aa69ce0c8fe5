"""What the default mode has learned, as plain arrays, and back.

Categories differ in how many actuators they move and how often they were seen, so their
arrays are laid end to end, and cut again by the sizes that stand beside them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, get_args

import numpy as np
import numpy.typing as npt

from rampe_guard.core.experience import Experience
from rampe_guard.core.scales import Scales
from rampe_guard.core.screening import Refusal
from rampe_guard.core.types import FloatArray

if TYPE_CHECKING:
    from rampe_guard.core.adaptive import Adaptive

Arrays = Mapping[str, npt.NDArray[np.generic]]
_VERSION = 1
_REASONS: tuple[str, ...] = get_args(Refusal)


def snapshot(model: Adaptive) -> dict[str, npt.NDArray[np.generic]]:
    """All that ``model`` has learned; primitives without motion that wait are left out."""
    own = list(model.experiences.values())
    # copies: the model may learn on while another thread writes them
    return {name: np.array(values) for name, values in _views(model, own).items()}


def _views(model: Adaptive, own: list[Experience]) -> dict[str, npt.NDArray[np.generic]]:
    ridges = [r for e in own for r in e.ridges]
    scales, spread, passing = model.scales, model.spread, model.passing
    return {
        **_settings(model),
        "categories": np.array([e.category for e in own], dtype=np.int8).reshape(-1, model.n),
        "occurrences": np.array([e.occurrences for e in own], dtype=np.int64),
        "remembered": np.array([len(e.trust) for e in own], dtype=np.int64),
        "evidence": np.array([e.evidence for e in own], dtype=np.float64),
        "starts": _flat([e.starts for e in own]),
        "moves": _flat([e.moves for e in own]),
        "trust": _flat([e.trust for e in own]),
        "surprise": _flat([e.surprise for e in own]),
        "drift": _flat([e.drift for e in own]),
        "suspected": np.array([e.suspect is not None for e in own], dtype=np.bool_),
        "suspects": _flat([e.suspect for e in own if e.suspect is not None]),
        "ridge_centers": _flat([r.center for r in ridges]),
        "ridge_sums": _flat([a for r in ridges for a in (r.precision, r.moment)]),
        "scale_low": scales.low,
        "scale_high": scales.high,
        "scale_inverse": scales.inverse,
        "scale_moved": scales.moved,
        "scale_count": scales.count,
        "scale_total": scales.total,
        "scale_largest": scales.largest,
        "spread_sizes": spread.sizes,
        "spread_ratios": spread.ratios,
        "spread_errors": spread.errors,
        "spread_typical": spread.typical,
        "spread_shape": spread.shape,
        "spread_scale": spread.scale,
        "spread_dof": spread.dof,
        "spread_due": spread.due,
        "passing_mean": passing.mean,
        "passing_precision": passing.precision,
        "refused": np.array([model.refused[reason] for reason in _REASONS], dtype=np.int64),
    }


def restore(model: Adaptive, arrays: Arrays) -> Adaptive:
    """A model like ``model`` that goes on where the snapshot was taken.

    Raises:
        ValueError: it is of another estimator, or damaged.
    """
    for name, mine in _settings(model).items():
        theirs = _entry(arrays, name)
        if not np.array_equal(theirs, mine):
            raise ValueError(f"{name} is {theirs.tolist()}, this estimator has {mine.tolist()}")
    fresh = model.empty()
    scales, spread, passing = fresh.scales, fresh.spread, fresh.passing
    for name in ("low", "high", "inverse", "moved", "count", "total", "largest"):
        mine = getattr(scales, name)
        setattr(scales, name, _like(arrays, f"scale_{name}", mine))
    _check_scales(scales)
    scales.refresh()
    for name in ("sizes", "ratios", "errors", "typical", "shape", "scale", "dof", "due"):
        setattr(spread, name, _counts(arrays, f"spread_{name}", getattr(spread, name)))
    for name in ("mean", "precision"):
        setattr(passing, name, _finite(arrays, f"passing_{name}", getattr(passing, name)))
    _check_moments("passing_precision", passing.precision)
    if passing.mean[0] <= 0.0:
        raise ValueError(f"passing_mean begins with {passing.mean[0]}, must be above 0")
    counts = _counts(arrays, "refused", np.zeros(len(_REASONS)))
    fresh.refused = Counter({r: int(c) for r, c in zip(_REASONS, counts, strict=True) if c})
    for own in _experiences(fresh, arrays):
        if own.category in fresh.experiences:
            raise ValueError(f"category {own.category} is there twice")
        fresh.add(own)
    return fresh


def _experiences(model: Adaptive, arrays: Arrays) -> list[Experience]:
    categories = _entry(arrays, "categories")
    total = categories.size // model.n
    if categories.shape != (total, model.n) or not np.isin(categories, (-1, 0, 1)).all():
        raise ValueError(f"categories of shape {categories.shape}, need signs ({total}, {model.n})")
    per = {
        name: _counts(arrays, name, np.zeros(total))
        for name in ("occurrences", "remembered", "evidence", "suspected")
    }
    if (per["occurrences"] < per["remembered"]).any():
        raise ValueError("a category remembers more primitives than it has seen")
    names = ("starts", "moves", "trust", "surprise", "drift", "suspects")
    rolls = {name: _Roll(name, arrays) for name in (*names, "ridge_centers", "ridge_sums")}
    result = []
    for i, signs in enumerate(categories):
        own = model.begin(tuple(int(s) for s in signs), np.zeros(model.width))
        k, m = int(per["remembered"][i]), len(own.active)
        if m == 0:
            raise ValueError("a category moves no actuator")
        own.starts = rolls["starts"].take(k, model.width)
        own.moves = rolls["moves"].take(k, m)
        own.trust = rolls["trust"].take(k)
        own.surprise = rolls["surprise"].take(m, m)
        own.drift = rolls["drift"].take(m)
        own.suspect = rolls["suspects"].take(m) if per["suspected"][i] else None
        own.occurrences = int(per["occurrences"][i])
        own.evidence = float(per["evidence"][i])
        for ridge in own.ridges:
            ridge.center = rolls["ridge_centers"].take(*ridge.center.shape)
            ridge.precision = rolls["ridge_sums"].take(*ridge.precision.shape)
            ridge.moment = rolls["ridge_sums"].take(*ridge.moment.shape)
            _check_moments("ridge_sums", ridge.precision)
        _check_moments("surprise", own.surprise)
        if ((own.trust <= 0.0) | (own.trust > 1.0)).any():
            raise ValueError("trust must lie in (0, 1]")
        result.append(own)
    for roll in rolls.values():
        roll.end()
    return result


class _Roll:
    """An array of arrays laid end to end, cut off piece by piece."""

    def __init__(self, name: str, arrays: Arrays) -> None:
        self._name = name
        self._values = _entry(arrays, name).astype(np.float64)
        self._at = 0
        if self._values.ndim != 1 or not np.isfinite(self._values).all():
            raise ValueError(f"{name} has shape {self._values.shape}, or is not finite")

    def take(self, *shape: int) -> FloatArray:
        size = int(np.prod(shape))
        piece = self._values[self._at : self._at + size]
        if len(piece) != size:
            raise ValueError(f"{self._name} ends after {len(self._values)} values")
        self._at += size
        return piece.reshape(shape).copy()

    def end(self) -> None:
        if self._at != len(self._values):
            raise ValueError(f"{self._name} has {len(self._values)} values, {self._at} belong")


def _settings(model: Adaptive) -> dict[str, npt.NDArray[np.generic]]:
    """What must be the same for a snapshot to fit."""
    return {
        "version": np.array(_VERSION),
        "actuators": np.array(model.n),
        "observed": np.array(model.width),
        "basis": np.array(model.basis_codes, dtype=np.int8),
        "limits": model.limits,
    }


def _flat(arrays: list[FloatArray]) -> FloatArray:
    return np.concatenate([np.zeros(0), *(a.ravel() for a in arrays)])


def _entry(arrays: Arrays, name: str) -> npt.NDArray[np.generic]:
    if name not in arrays:
        raise ValueError(f"{name} is missing")
    values = np.asarray(arrays[name])
    if values.dtype.kind not in "biuf":
        raise ValueError(f"{name} holds {values.dtype}, not numbers")
    return values


def _like(arrays: Arrays, name: str, mine: FloatArray) -> FloatArray:
    values = _entry(arrays, name).astype(np.float64)
    if values.shape != mine.shape or np.isnan(values).any():
        raise ValueError(f"{name} has shape {values.shape}, need {mine.shape} without NaN")
    return values


def _finite(arrays: Arrays, name: str, mine: FloatArray) -> FloatArray:
    values = _like(arrays, name, mine)
    if not np.isfinite(values).all():
        raise ValueError(f"{name} is not finite")
    return values


def _counts(arrays: Arrays, name: str, mine: FloatArray) -> FloatArray:
    values = _finite(arrays, name, mine)
    if (values < 0.0).any():
        raise ValueError(f"{name} has {values.min()}, no number of things")
    return values


def _check_scales(scales: Scales) -> None:
    for name in ("inverse", "moved", "count", "total", "largest"):
        values = getattr(scales, name)
        if not np.isfinite(values).all() or (values < 0.0).any():
            raise ValueError(f"scale_{name} is {values.tolist()}, must be finite and not below 0")
    seen = np.isfinite(scales.low) & (scales.low <= scales.high) & np.isfinite(scales.high)
    never = (scales.low == np.inf) & (scales.high == -np.inf)
    if not (seen | never).all():
        raise ValueError(f"seen from {scales.low.tolist()} to {scales.high.tolist()}")


def _check_moments(name: str, moments: FloatArray) -> None:
    """A sum of zzᵀ is symmetric and has no negative eigenvalue."""
    size = float(np.trace(moments))
    if not np.allclose(moments, moments.T, rtol=1e-9, atol=1e-9 * abs(size)):
        raise ValueError(f"{name} is not symmetric")
    if np.linalg.eigvalsh(moments)[0] < -1e-9 * abs(size):
        raise ValueError(f"{name} is no sum of squares")
