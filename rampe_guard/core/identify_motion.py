"""How an actuator follows its lever: deadband, lag, top speed, braking.

Each estimate errs to the safe side of a warning: motion begins early (deadband low), is told late
(lag high), is fast (top speed high) and stops late (deceleration low). The stopping forecast of a
guard with these values, v·lag + v²/(2a), covers the stops that were seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.stats import theilslopes

from rampe_guard.core.identify_signals import STEP_S, BoolArray, runs
from rampe_guard.core.types import FloatArray

STILL_SHARE = 0.03
"""Speeds below this share of the top speed are rest, as for a guard."""
_STEADY, _SETTLE_S = 0.12, 0.15
_FIT_LOW, _FIT_HIGH, _FIT_SPREAD, _FIT_POINTS = 0.05, 0.6, 0.1, 400
_FLOOR = 0.01
_NEAR_NEUTRAL = 0.1
_QUIET_S, _LATEST_S = 0.25, 1.2
_BRISK, _BRISK_STEPS = 0.2, round(0.15 / STEP_S)
"""A push is brisk that gets so far beyond the deadband in so short a time."""
_STALLED_S = 0.3
"""Motion that begins so much later than usual is no answer to the push: the arm was blocked [s]."""
_NOISES = 4.0
_LATE_SHARE = 0.9
_FULL = 0.9
_PLATEAU_S, _PLATEAU_CHANGE = 0.3, 0.1
_BRAKE_FROM, _BRAKE_HIGH, _BRAKE_LOW = 0.4, 0.8, 0.2
_EARLY_SHARE = 0.1
_STOP_S = 3.0
_FEW = 3


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value, how many events it rests on, and how it came about, in words."""

    value: float
    events: int
    how: str


@dataclass(frozen=True, slots=True)
class Follow:
    """An actuator and its lever on the grid: lever in the direction of motion.

    Attributes:
        lever: (k,) the sign applied [-].
        position: (k,) [unit].
        velocity: (k,) [unit/s].
        known: (k,) whether both were heard.
        best_lag_s: at which the lever explains the motion best [s].
        lag_s: as far as it is known by now [s].
        noise: of a position [unit].
        period_s: of the positions [s].
    """

    lever: FloatArray
    position: FloatArray
    velocity: FloatArray
    known: BoolArray
    best_lag_s: float
    lag_s: float
    noise: float
    period_s: float

    @property
    def top(self) -> float:
        """A speed that it hardly ever exceeds [unit/s]."""
        speeds = np.abs(self.velocity[self.known])
        moving = speeds[speeds > STILL_SHARE * speeds.max(initial=0.0)]
        return float(np.quantile(moving, 0.98)) if moving.size else 0.0


def deadband(follow: Follow) -> Estimate | None:
    """Lever size below which nothing moves, rather too small; None if only full pushes were seen.

    Where steady levers move it slowly, a straight line through speed over lever tells where speed
    begins; it is never less than what a free lever shakes.
    """
    size, along = _delayed(follow)
    floor = _shake(follow)
    shaken = size > floor
    slow = shaken & (along > _FIT_LOW * follow.top) & (along < _FIT_HIGH * follow.top)
    still = size[shaken & (along < STILL_SHARE * follow.top)]
    told: list[tuple[float, str]] = []
    if np.count_nonzero(slow) >= _FEW and np.ptp(size[slow]) > _FIT_SPREAD:
        pick = np.flatnonzero(slow)
        pick = pick[:: max(1, len(pick) // _FIT_POINTS)]
        slope, _, _, _ = theilslopes(along[pick], size[pick])
        if slope > 0.0:
            begins = float(np.quantile(size[pick] - along[pick] / slope, 0.25))
            told.append((begins, f"speed begins at {begins:.3f} of the lever"))
    if len(still) * STEP_S > _QUIET_S:
        rest = float(np.quantile(still, 0.9))
        told.append((rest, f"no motion up to {rest:.3f}"))
    if not told:
        return None
    value, how = min(told)
    if value < floor:
        how = f"no deadband seen; a free lever shakes up to {floor:.3f}"
        return Estimate(floor, max(_FEW, len(runs(slow))), how)
    return Estimate(value, len(runs(slow)), how)


def lag(follow: Follow, deadband_: float) -> Estimate:
    """From the lever beyond its deadband to motion [s], the late ones.

    Without a brisk push from rest it is the lag at which the lever explains the motion best, and a
    period of the positions more.
    """
    least = max(_NOISES * follow.noise, 0.002 * follow.top)
    found = []
    for begin, _ in _pushes(follow, deadband_):
        way = np.sign(follow.lever[begin])
        end = min(len(follow.lever), begin + round(_LATEST_S / STEP_S))
        if np.abs(follow.lever[begin : begin + _BRISK_STEPS]).max() < deadband_ + _BRISK:
            continue  # of a lever that creeps out of its deadband nobody knows when it did
        gone = way * (follow.position[begin:end] - follow.position[begin]) > least
        late_s = float(gone.argmax()) * STEP_S
        if (
            gone.any()
            and late_s <= follow.best_lag_s + _STALLED_S
            and follow.known[begin : begin + int(gone.argmax())].all()
        ):
            found.append(late_s)
    if not found:
        late = follow.best_lag_s + follow.period_s
        words = f"no brisk push from rest; the lever explains the motion best at {late:.2f} s"
        return Estimate(late, 0, words)
    late = max(found) if len(found) < _FEW else float(np.quantile(found, _LATE_SHARE))
    words = f"{_count(found, 'onset')}, median {np.median(found):.2f} s, late ones {late:.2f} s"
    words += f", and {follow.period_s:.2f} s between messages"
    # the lever may have moved, and the arm begun to, up to a period before a message says so
    return Estimate(late + follow.period_s, len(found), words)


def top_speed(follow: Follow, deadband_: float) -> Estimate | None:
    """At full lever, the faster way [unit/s]; reckoned up where the lever was not pushed fully.

    Without events if it was still rising when the lever was let go: then it is too little.
    """
    size, along = _delayed(follow)
    ways = []
    words = []
    for way, name in ((1.0, "up"), (-1.0, "down")):
        mine = (np.sign(follow.velocity) == way) & follow.known
        speeds = np.abs(follow.velocity[mine])
        speeds = speeds[speeds > 0.2 * follow.top]
        if not speeds.size:
            continue
        fastest = float(np.quantile(speeds, 0.98))
        ways.append(fastest)
        words.append(f"{name} {fastest:.3g}")
    if not ways:
        return None
    value = max(ways)
    hard = size[along > 0.5 * value]
    pushed = float(np.quantile(hard, 0.95)) if hard.size else 1.0
    how = f"{' and '.join(words)} at {pushed:.0%} of the lever"
    if pushed < _FULL:
        share = max((pushed - deadband_) / (1.0 - deadband_), 0.1)
        value /= share
        how += ", reckoned up to all of it"
    if not _steady(follow, max(ways)):
        return Estimate(value, 0, f"{how}, and still rising: hold the lever longer")
    return Estimate(value, len(ways), how)


def _steady(follow: Follow, fastest: float) -> bool:
    """Whether it kept such a speed for a while, and did not only pass through it."""
    speed = np.where(follow.known, np.abs(follow.velocity), 0.0)
    window = round(_PLATEAU_S / STEP_S)
    change = maximum_filter1d(speed, window) - minimum_filter1d(speed, window)
    return bool(((change < _PLATEAU_CHANGE * fastest) & (speed > _FULL * fastest)).any())


def deceleration(follow: Follow, deadband_: float, lag_s: float) -> Estimate | None:
    """Braking after the lever is let go [unit/s²], the gentle ones; None without a stop.

    Two measures, and the smaller counts: how steeply the speed falls, and what v·lag + v²/(2a) must
    be to reach as far as the machine ran on.
    """
    found = []
    for at in _releases(follow, deadband_):
        one = _braking(follow, at, lag_s)
        if one is not None:
            found.append(one)
    if not found:
        return None
    gentle = min(found) if len(found) < _FEW else float(np.quantile(found, _EARLY_SHARE))
    words = f"{_count(found, 'stop')}, median {np.median(found):.3g}, gentle ones {gentle:.3g}"
    return Estimate(gentle, len(found), words)


def _braking(follow: Follow, at: int, lag_s: float) -> float | None:
    end = min(len(follow.lever), at + round(_STOP_S / STEP_S))
    speed = np.abs(follow.velocity[at:end])
    begun = float(speed[: max(1, round(0.05 / STEP_S))].mean())
    rest = speed < STILL_SHARE * follow.top
    if begun < _BRAKE_FROM * follow.top or not rest.any():
        return None
    stopped = int(rest.argmax())
    if not follow.known[at : at + stopped].all():
        return None
    below_high = int((speed < _BRAKE_HIGH * begun).argmax())
    below_low = int((speed < _BRAKE_LOW * begun).argmax())
    took_s = max((below_low - below_high) * STEP_S, STEP_S)
    steep = (_BRAKE_HIGH - _BRAKE_LOW) * begun / took_s
    ran = float(abs(follow.position[at + stopped] - follow.position[at]))
    after_lag = ran - begun * lag_s
    if after_lag <= 0.0:
        return steep
    return min(steep, begun * begun / (2.0 * after_lag))


def _delayed(follow: Follow) -> tuple[FloatArray, FloatArray]:
    """Steady lever sizes, and the speeds along them that they brought."""
    shift = round(follow.lag_s / STEP_S)
    window = shift + round(_SETTLE_S / STEP_S) + 1
    spread = maximum_filter1d(follow.lever, window) - minimum_filter1d(follow.lever, window)
    middle = window // 2
    settled = np.zeros(len(follow.lever), dtype=bool)
    settled[middle:] = spread[: len(spread) - middle] < _STEADY  # of the window that ends here
    lever = np.concatenate([np.zeros(shift), follow.lever[: len(follow.lever) - shift]])
    good = settled & follow.known
    return np.abs(lever[good]), (np.sign(lever) * follow.velocity)[good]


def _shake(follow: Follow) -> float:
    """What a lever that is let go may read [-]."""
    free = np.abs(follow.lever[follow.known & (np.abs(follow.lever) < _NEAR_NEUTRAL)])
    free = free[free < 2.0 * np.quantile(free, 0.5) + _FLOOR] if free.size else free
    return max(_FLOOR, 1.2 * float(free.max(initial=0.0)))


def _pushes(follow: Follow, deadband_: float) -> list[tuple[int, int]]:
    """Pushes from rest."""
    before = round(_QUIET_S / STEP_S)
    quiet = STILL_SHARE * follow.top
    return [
        (begin, end)
        for begin, end in runs(np.abs(follow.lever) > deadband_)
        if begin >= before
        and (np.abs(follow.lever[begin - before : begin]) <= deadband_).all()
        and (np.abs(follow.velocity[begin - before : begin]) < quiet).all()
    ]


def _releases(follow: Follow, deadband_: float) -> list[int]:
    """Where a lever comes back within its deadband and stays until the motion ends."""
    out = np.abs(follow.lever) > deadband_
    found = []
    for begin, end in runs(~out):
        if begin == 0:
            continue
        speed = np.abs(follow.velocity[begin:end])
        if (speed < STILL_SHARE * follow.top).any():
            found.append(begin)
    return found


def _count(found: list[float], what: str) -> str:
    return f"{len(found)} {what}{'' if len(found) == 1 else 's'}"
