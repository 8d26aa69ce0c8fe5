"""Proofs about drives by interval arithmetic: strictly monotone, and how steep at most.

Monotony turns "the joint moved from θ(a) to θ(b)" into a bound for everything in between.
Bounds of the slope over an interval bound how far θ strays from its chord there.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from rampe_guard.core.drive import (
    CylinderDrive,
    DirectDrive,
    Drive,
    FourBarDrive,
    TableDrive,
    ascending,
    corner_angle,
    joint_value,
)
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError

Interval: TypeAlias = tuple[FloatArray, FloatArray]
"""Elementwise lower and upper bounds."""


def slope_bounds(drive: Drive, lower: FloatArray, upper: FloatArray) -> Interval:
    """Proven bounds of dθ/dq over each interval [lower, upper], by interval arithmetic.

    They prove monotony (sign) and bound how far θ strays from its chord. An interval that is
    not wholly in the domain gets (-inf, inf).
    """
    lo, hi = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    match drive:
        case DirectDrive():
            slope = np.full(lo.shape, drive.scale)
            return slope, slope.copy()
        case CylinderDrive():
            offset = drive.length_at_zero_m
            slope_i = _corner_slope(
                drive.corner, drive.base_m, drive.rod_m, (lo + offset, hi + offset)
            )
            return _oriented(slope_i, drive.direction)
        case FourBarDrive():
            return _four_bar_slope(drive, lo, hi)
        case TableDrive():
            return _table_slope(drive, lo, hi)


def check_monotone(drive: Drive, lower: float, upper: float, *, pieces: int = 4096) -> int:
    """Prove that θ is defined and strictly monotone over [lower, upper].

    Args:
        drive: the map.
        lower: least actuator value [unit].
        upper: greatest actuator value [unit].
        pieces: into how many intervals the proof is split.

    Returns:
        +1 if θ grows with q, else -1.

    Raises:
        GeometryError: naming the actuator value where the map fails.
    """
    if isinstance(drive, DirectDrive):
        if not (np.isfinite([drive.scale, drive.offset]).all() and drive.scale != 0.0):
            raise GeometryError(f"{drive}: scale and offset must be finite and scale not 0")
        return 1 if drive.scale > 0.0 else -1
    if not (np.isfinite([lower, upper]).all() and lower < upper):
        raise GeometryError(f"{drive}: needs finite limits, lower < upper; got {lower}, {upper}")
    q = np.linspace(lower, upper, pieces + 1)
    theta = joint_value(drive, q)
    if not np.isfinite(theta).all():
        bad = float(q[np.flatnonzero(~np.isfinite(theta))[0]])
        raise GeometryError(
            f"{drive}: the linkage cannot close at actuator value {bad:.6g} within its limits "
            f"[{lower:.6g}, {upper:.6g}]; correct the dimensions or narrow the limits"
        )
    slope_lo, slope_hi = slope_bounds(drive, q[:-1], q[1:])
    sign = 1 if theta[-1] > theta[0] else -1
    proven = (slope_lo > 0.0) if sign > 0 else (slope_hi < 0.0)
    proven &= np.isfinite(slope_lo) & np.isfinite(slope_hi)
    if not proven.all():
        bad = float(q[np.flatnonzero(~proven)[0]])
        raise GeometryError(
            f"{drive}: not provably monotone near actuator value {bad:.6g} within its limits "
            f"[{lower:.6g}, {upper:.6g}] (dead centre of the linkage?); narrow the limits"
        )
    return sign


def _area_interval(a: float, b: float, p: Interval) -> Interval:
    """√Q with Q = 16 area² = 4a²b² - (a² + b² - p)², p = the third side squared.

    Q is a parabola in p that opens downward: least at an end, greatest at its vertex.
    """

    def q(x: FloatArray) -> FloatArray:
        return np.asarray(4.0 * a * a * b * b - (a * a + b * b - x) ** 2)

    ends = np.minimum(q(p[0]), q(p[1])), np.maximum(q(p[0]), q(p[1]))
    vertex = a * a + b * b
    high = np.where((p[0] <= vertex) & (vertex <= p[1]), 4.0 * a * a * b * b, ends[1])
    return np.sqrt(np.maximum(ends[0], 0.0)), np.sqrt(np.maximum(high, 0.0))


def _side_slope(side: float, other: float, p: Interval) -> Interval:
    """dφ/dp with φ the angle between ``side`` and the side r = √p, ``other`` opposite.

    φ = acos((p + side² - other²)/(2·side·√p)), dφ/dp = -(p - (side² - other²))/(2·p·√Q).
    """
    c = side * side - other * other
    root = _area_interval(side, other, p)
    return _divide((c - p[1], c - p[0]), (2.0 * p[0] * root[0], 2.0 * p[1] * root[1]))


def _corner_slope(corner: str, base: float, rod: float, length: Interval) -> Interval:
    """dφ/dL of a corner of the triangle (base, rod, L)."""
    valid = length[0] > 0.0
    lo = np.where(valid, length[0], 1.0)
    hi = np.where(valid, length[1], 1.0)
    p = lo * lo, hi * hi
    if corner == "pivot":
        root = _area_interval(base, rod, p)
        slope = _divide((2.0 * lo, 2.0 * hi), root)
    else:
        side, other = (base, rod) if corner == "base" else (rod, base)
        slope = _multiply(_side_slope(side, other, p), (2.0 * lo, 2.0 * hi))
    return np.where(valid, slope[0], -np.inf), np.where(valid, slope[1], np.inf)


def _four_bar_slope(drive: FourBarDrive, lo: FloatArray, hi: FloatArray) -> Interval:
    """dθ/dq = direction · d(f + g)/dp · dp/dh · dh/de · de/dL, with dh/de = -1."""
    offset = drive.length_at_zero_m
    with np.errstate(invalid="ignore"):
        e_lo = corner_angle("pivot", drive.base_m, drive.rod_m, lo + offset)
        e_hi = corner_angle("pivot", drive.base_m, drive.rod_m, hi + offset)
    defined = np.isfinite(e_lo) & np.isfinite(e_hi)
    h_lo = np.where(defined, drive.rocker_offset_rad - e_hi, 0.0)
    h_hi = np.where(defined, drive.rocker_offset_rad - e_lo, 0.0)
    ground, rocker = drive.ground_m, drive.rocker_m
    cos_lo, cos_hi = _cosine(h_lo, h_hi)
    sin_lo, sin_hi = _cosine(h_lo - 0.5 * np.pi, h_hi - 0.5 * np.pi)
    p = (
        ground**2 + rocker**2 - 2.0 * ground * rocker * cos_hi,
        ground**2 + rocker**2 - 2.0 * ground * rocker * cos_lo,
    )
    f, g = (
        _side_slope(ground, rocker, p),
        _side_slope(drive.follower_m, drive.coupler_m, p),
    )
    lengths = np.where(defined, lo + offset, np.nan), np.where(defined, hi + offset, np.nan)
    e_slope = _corner_slope("pivot", drive.base_m, drive.rod_m, lengths)
    dp_dh = 2.0 * ground * rocker * sin_lo, 2.0 * ground * rocker * sin_hi
    slope = _multiply(_multiply((f[0] + g[0], f[1] + g[1]), dp_dh), e_slope)
    lower, upper = _oriented(slope, -drive.direction)
    good = defined & np.isfinite(lower) & np.isfinite(upper)
    return np.where(good, lower, -np.inf), np.where(good, upper, np.inf)


def _table_slope(drive: TableDrive, lo: FloatArray, hi: FloatArray) -> Interval:
    x, y = ascending(drive)
    slopes = np.diff(y) / np.diff(x)
    first = np.clip(np.searchsorted(x, lo, side="right") - 1, 0, slopes.size - 1)
    last = np.clip(np.searchsorted(x, hi, side="left") - 1, 0, slopes.size - 1)
    segment = np.arange(slopes.size)
    covered = (segment >= first[..., None]) & (segment <= np.maximum(first, last)[..., None])
    low = np.where(covered, slopes, np.inf).min(axis=-1)
    high = np.where(covered, slopes, -np.inf).max(axis=-1)
    inside = (lo >= x[0]) & (hi <= x[-1])
    return np.where(inside, low, -np.inf), np.where(inside, high, np.inf)


def _cosine(lo: FloatArray, hi: FloatArray) -> Interval:
    """Range of cos over [lo, hi]."""
    ends = np.minimum(np.cos(lo), np.cos(hi)), np.maximum(np.cos(lo), np.cos(hi))
    turn = 2.0 * np.pi
    has_top = np.floor(hi / turn) > np.floor(np.nextafter(lo, -np.inf) / turn)
    has_bottom = np.floor((hi - np.pi) / turn) > np.floor(
        (np.nextafter(lo, -np.inf) - np.pi) / turn
    )
    return np.where(has_bottom, -1.0, ends[0]), np.where(has_top, 1.0, ends[1])


def _multiply(a: Interval, b: Interval) -> Interval:
    with np.errstate(invalid="ignore"):
        products = np.stack([a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
    bad = ~np.isfinite(products).all(axis=0)
    return np.where(bad, -np.inf, products.min(axis=0)), np.where(bad, np.inf, products.max(axis=0))


def _divide(a: Interval, b: Interval) -> Interval:
    """A / b for b >= 0; unbounded where b reaches 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / b[1], 1.0 / b[0]
    return _multiply(a, inverse)


def _oriented(interval: Interval, direction: int) -> Interval:
    return interval if direction > 0 else (-interval[1], -interval[0])
