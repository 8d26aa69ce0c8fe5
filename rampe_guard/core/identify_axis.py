"""Which lever moves which actuator, and which way.

The velocities, a lag later, are explained by all levers together (linear least squares). A lever
counts by what it explains and no other lever can: its partial correlation. So two levers that only
ever moved together are told to be ambiguous, and not guessed apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.core.identify_signals import GAP_S, STEP_S, BoolArray, Signals, runs
from rampe_guard.core.types import FloatArray

LONGEST_LAG_S = 1.0
_EVERY = 2
"""Every second instant is looked at, and lags are tried in steps as long."""
_USED = 0.05
"""A lever whose values lie nearer together than this was not moved [-]."""
SURE = 0.3
"""Least share of what is left unexplained by the others that the right lever explains."""
_NEARLY = 0.85
_ENOUGH = 12
"""With fewer changes of a lever, chance explains motion at some lag or other."""
_OUT, _REST_S, _ANSWER_S = 0.1, 0.15, 0.8
_REST_SHARE, _VOTES, _AGREED = 0.05, 2, 0.8
_TURNED = 0.6
"""With the other sign, at another lag, a lever that explains more than this share of what it does
with the first leaves open which is true: what goes to and fro evenly looks alike both ways."""
_RIVAL = 0.4
"""A second lever that explains more than this share of what the first does makes it ambiguous."""
_MOVED_NOISE = 12.0
_MOVED_SHARE = 0.004
_RIDGE = 1e-6
_STILL = "it did not move"


@dataclass(frozen=True, slots=True)
class Lever:
    """The lever of an actuator.

    Attributes:
        axis: its index; None where it cannot be told.
        sign: 1 if a positive axis raises the position, else -1; 0 where it cannot be told, though
            the axis may be.
        share: of the motion that it alone explains, 0 to 1.
        lag_s: at which levers explain the motion best [s].
        problem: why it cannot be told, if so.
    """

    axis: int | None
    sign: int
    share: float
    lag_s: float
    problem: str = ""


def moved(signals: Signals) -> list[bool]:
    """Whether each actuator moved further than its noise, and than a sensor's last digit."""
    low, high = np.quantile(signals.position, (0.002, 0.998), axis=0)
    everything = np.abs(signals.position).max(axis=0)
    least = np.maximum(_MOVED_NOISE * signals.noise, _MOVED_SHARE * everything)
    return [bool(far) for far in high - low > least]


def levers_of(signals: Signals) -> list[Lever]:
    """The lever of every actuator, each lever at most once."""
    here = moved(signals)
    if words := _hopeless(signals):
        return [Lever(None, 0, 0.0, 0.0, words if it else _STILL) for it in here]
    told = _explained(signals)
    found = [
        _sure(signals, _choose(told, j), j) if here[j] else Lever(None, 0, 0.0, 0.0, _STILL)
        for j in range(signals.velocity.shape[1])
    ]
    return _once(found)


def _hopeless(signals: Signals) -> str:
    """Why no lever can be told from any of it; empty if one may be."""
    if not _used(signals).any():
        return "no lever was moved: are these the levers? Move each, one at a time"
    if signals.period_s > GAP_S:
        return (
            f"positions are {signals.period_s:.2g} s apart, and between two that are more than"
            f" {GAP_S:g} s apart nothing is known"
        )
    return ""


def _used(signals: Signals) -> BoolArray:
    """Which levers were moved at all."""
    return np.asarray(np.ptp(signals.axes, axis=0) > _USED)


@dataclass(frozen=True, slots=True)
class _Explained:
    """What levers explain: of K lags (K,) [s], partial r² and sign (K, m, n), and r² (K, n)."""

    lags_s: FloatArray
    shares: FloatArray
    signs: FloatArray
    together: FloatArray


def _explained(signals: Signals) -> _Explained:
    known, velocity = signals.known[::_EVERY], signals.velocity[::_EVERY]
    used = _used(signals)
    levers = np.where(used, signals.axes, 0.0)[::_EVERY]
    m, n = levers.shape[1], velocity.shape[1]
    lags, shares, signs, together = [0.0], [np.zeros((m, n))], [np.zeros((m, n))], [np.zeros(n)]
    for shift in range(round(LONGEST_LAG_S / STEP_S / _EVERY) + 1):
        late = slice(shift, None)
        early = slice(None, len(levers) - shift)
        both = known[late] & known[early]
        if np.count_nonzero(both) < 10 * (m + 1):
            break
        u = levers[early][both] - levers[early][both].mean(axis=0)
        v = velocity[late][both] - velocity[late][both].mean(axis=0)
        gram = u.T @ u + _RIDGE * len(u) * np.eye(m)
        back = np.linalg.inv(gram)
        slope = back @ (u.T @ v)
        total = np.maximum((v * v).sum(axis=0), 1e-30)
        own = slope**2 / np.diag(back)[:, None]
        left = np.maximum(total - (slope * (u.T @ v)).sum(axis=0), 1e-12 * total)
        lags.append(shift * _EVERY * STEP_S)
        shares.append(np.where(used[:, None], own / (own + left), 0.0))
        signs.append(np.sign(slope))
        together.append(1.0 - left / total)
    return _Explained(np.array(lags), np.array(shares), np.array(signs), np.array(together))


def _choose(told: _Explained, j: int) -> Lever:
    at = _first_peak(told.together[:, j])
    shares, lag_s = told.shares[at, :, j], float(told.lags_s[at])
    order = np.argsort(shares)[::-1]
    first = int(order[0])
    share = float(shares[first])
    if share < SURE:
        words = f"no lever explains its motion (the best, axis {first}, {share:.0%} of it)"
        return Lever(None, 0, share, lag_s, words)
    if len(order) > 1 and shares[order[1]] > _RIVAL * share:
        words = f"axes {first} and {int(order[1])} explain its motion alike; move one at a time"
        return Lever(None, 0, share, lag_s, words)
    sign = int(told.signs[at, first, j])
    other = told.shares[told.signs[:, first, j] == -sign, first, j].max(initial=0.0)
    if other > _TURNED * share:
        words = "which way it moves cannot be told: do not go to and fro evenly, rest in between"
        return Lever(first, 0, share, lag_s, words)
    return Lever(first, sign, share, lag_s)


def _first_peak(explained: FloatArray) -> int:
    """The shortest lag at which about as much is explained as at any.

    Later ones may be those of another lever, where levers are moved in turn.
    """
    nearly = explained >= _NEARLY * explained.max()
    peak = np.append(explained[:-1] >= explained[1:], True)
    return int(np.argmax(nearly & peak))


def _sure(signals: Signals, lever: Lever, j: int) -> Lever:
    """The same, unless the lever was moved too little for it; single pushes from rest can do."""
    if lever.axis is None:
        return lever
    votes = _votes(signals, lever.axis, j)
    if len(votes) >= _VOTES and abs(sum(votes)) >= _AGREED * len(votes):
        sign = 1 if sum(votes) > 0 else -1
        if lever.sign in (0, sign):
            return replace(lever, sign=sign, problem="")
        words = (
            f"pushes from rest and the rest of the motion say opposite signs of axis {lever.axis}"
        )
        return replace(lever, sign=0, problem=words)
    out = np.where(np.abs(signals.axes[:, lever.axis]) > _OUT, signals.axes[:, lever.axis], 0.0)
    changes = int(np.count_nonzero(np.diff(np.sign(out))))
    if changes >= _ENOUGH or lever.problem:
        return lever
    words = f"too little motion: axis {lever.axis} moved {changes} times; push it from rest, twice"
    return Lever(None, 0, lever.share, lever.lag_s, words)


def _votes(signals: Signals, axis: int, j: int) -> list[int]:
    """Which way an actuator went after each push of a lever from rest, times that of the push."""
    lever, speed = signals.axes[:, axis], signals.velocity[:, j]
    top = float(np.abs(speed[signals.known]).max(initial=0.0))
    before, after = round(_REST_S / STEP_S), round(_ANSWER_S / STEP_S)
    found = []
    for begin, end in runs(np.abs(lever) > _OUT):
        rest = slice(begin - before, begin)
        if begin < before or (np.abs(speed[rest]) > _REST_SHARE * top).any():
            continue
        if (np.abs(lever[begin - before : begin - 1]) > _OUT).any():
            continue
        answer = speed[begin : min(begin + after, max(end, begin + after // 2))]
        went = np.abs(answer) > 2.0 * _REST_SHARE * top
        if went.any() and signals.known[begin - before : begin + len(answer)].all():
            found.append(int(np.sign(answer[went.argmax()]) * np.sign(lever[begin])))
    return found


def _once(found: list[Lever]) -> list[Lever]:
    """The same, where a lever that moved several actuators belongs to the one it explains best."""
    kept = list(found)
    for axis in {lever.axis for lever in found} - {None}:
        mine = [j for j, lever in enumerate(found) if lever.axis == axis]
        owner = max(mine, key=lambda j: found[j].share)
        for j in mine:
            if j != owner:
                told = f"axis {axis} moves actuator {owner} too, and more clearly"
                kept[j] = Lever(None, 0, found[j].share, found[j].lag_s, told)
    return kept
