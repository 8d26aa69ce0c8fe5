"""What the default mode has learned, as plain arrays, and back.

Categories differ in how many actuators they move and how often they were seen, so their
arrays are laid end to end, and cut again by the sizes that stand beside them.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, get_args

import numpy as np
import numpy.typing as npt

from rampe_guard.core.arrays import Arrays, Roll, check_settings, entry, flat
from rampe_guard.core.experience import Experience
from rampe_guard.core.scales import Scales
from rampe_guard.core.screening import Refusal
from rampe_guard.core.types import FloatArray

if TYPE_CHECKING:
    from rampe_guard.core.adaptive import Adaptive

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
        "starts": flat([e.starts for e in own]),
        "moves": flat([e.moves for e in own]),
        "trust": flat([e.trust for e in own]),
        "surprise": flat([e.surprise for e in own]),
        "drift": flat([e.drift for e in own]),
        "suspected": np.array([e.suspect is not None for e in own], dtype=np.bool_),
        "suspects": flat([e.suspect for e in own if e.suspect is not None]),
        "ridge_centers": flat([r.center for r in ridges]),
        "ridge_sums": flat([a for r in ridges for a in (r.precision, r.moment)]),
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
    check_settings(arrays, _settings(model))
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
    categories = entry(arrays, "categories")
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
    rolls = {name: Roll(name, arrays) for name in (*names, "ridge_centers", "ridge_sums")}
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


def _settings(model: Adaptive) -> dict[str, npt.NDArray[np.generic]]:
    """What must be the same for a snapshot to fit."""
    return {
        "version": np.array(_VERSION),
        "actuators": np.array(model.n),
        "observed": np.array(model.width),
        "basis": np.array(model.basis_codes, dtype=np.int8),
        "limits": model.limits,
    }


def _like(arrays: Arrays, name: str, mine: FloatArray) -> FloatArray:
    values = entry(arrays, name).astype(np.float64)
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
