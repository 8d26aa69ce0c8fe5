"""Actuator ↔ joint maps. Each is strictly monotone over its domain, else it is refused.

Monotone maps are what lets a sweep bound joint motion by the difference of end values.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError


@dataclass(frozen=True, slots=True)
class DirectDrive:
    """θ = offset + scale·q."""

    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class CylinderDrive:
    """Triangle base-pivot-rod with the cylinder, of length L = length_at_zero_m + q, as one side.

    ``base_m`` is the distance from the pivot to the barrel pin, ``rod_m`` from the pivot to
    the rod pin. ``corner`` says which angle of the triangle turns the joint: at the pivot
    (the driven link), at the barrel pin (the barrel itself) or at the rod pin.
    θ = angle_offset_rad + direction·corner angle.
    """

    base_m: float
    rod_m: float
    length_at_zero_m: float
    angle_offset_rad: float = 0.0
    direction: Literal[-1, 1] = 1
    corner: Literal["pivot", "base", "rod"] = "pivot"


@dataclass(frozen=True, slots=True)
class FourBarDrive:
    """Bucket linkage: a cylinder turns a rocker, a coupler turns the follower.

    e = corner angle at the pivot of the triangle (base_m, rod_m, length_at_zero_m + q);
    h = rocker_offset_rad - e is the angle between ground and rocker;
    r = diagonal = sqrt(ground² + rocker² - 2·ground·rocker·cos h);
    f = acos((r² + ground² - rocker²)/(2·r·ground));
    g = acos((r² + follower² - coupler²)/(2·r·follower));
    θ = angle_offset_rad + direction·(f + g).
    """

    base_m: float
    rod_m: float
    length_at_zero_m: float
    rocker_offset_rad: float
    ground_m: float
    rocker_m: float
    coupler_m: float
    follower_m: float
    angle_offset_rad: float = 0.0
    direction: Literal[-1, 1] = 1


@dataclass(frozen=True, slots=True)
class TableDrive:
    """Piecewise linear through the points (actuator[i], joint[i]), both strictly monotone."""

    actuator: tuple[float, ...]
    joint: tuple[float, ...]


Drive: TypeAlias = DirectDrive | CylinderDrive | FourBarDrive | TableDrive


def joint_value(drive: Drive, actuator: FloatArray) -> FloatArray:
    """θ(q) for an array of actuator values of any shape; NaN where the linkage cannot close.

    Args:
        drive: the map.
        actuator: q [unit], any shape.

    Returns:
        θ [rad] or [m], the same shape.
    """
    q = np.asarray(actuator, dtype=float)
    with np.errstate(invalid="ignore", divide="ignore"):
        match drive:
            case DirectDrive():
                return drive.offset + drive.scale * q
            case CylinderDrive():
                length = drive.length_at_zero_m + q
                corner = corner_angle(drive.corner, drive.base_m, drive.rod_m, length)
                return drive.angle_offset_rad + drive.direction * corner
            case FourBarDrive():
                e = corner_angle("pivot", drive.base_m, drive.rod_m, drive.length_at_zero_m + q)
                r = np.sqrt(_diagonal_squared(drive, drive.rocker_offset_rad - e))
                f = _angle(drive.ground_m, r, drive.rocker_m)
                g = _angle(drive.follower_m, r, drive.coupler_m)
                return drive.angle_offset_rad + drive.direction * (f + g)
            case TableDrive():
                x, y = ascending(drive)
                return np.asarray(np.interp(q, x, y, left=np.nan, right=np.nan))


def joint_scalar(drive: Drive, q: float) -> float:
    """`joint_value` of one number, many times faster; NaN where the linkage cannot close."""
    match drive:
        case DirectDrive():
            return drive.offset + drive.scale * q
        case CylinderDrive():
            length = drive.length_at_zero_m + q
            corner = _corner_scalar(drive.corner, drive.base_m, drive.rod_m, length)
            return drive.angle_offset_rad + drive.direction * corner
        case FourBarDrive():
            ground, rocker = drive.ground_m, drive.rocker_m
            e = _corner_scalar("pivot", drive.base_m, drive.rod_m, drive.length_at_zero_m + q)
            h = drive.rocker_offset_rad - e
            r = math.sqrt(ground**2 + rocker**2 - 2.0 * ground * rocker * math.cos(h))
            f = _angle_scalar(ground, r, rocker)
            g = _angle_scalar(drive.follower_m, r, drive.coupler_m)
            return drive.angle_offset_rad + drive.direction * (f + g)
        case TableDrive():
            return _interpolated(drive, q)


def domain(drive: Drive) -> tuple[float, float]:
    """Largest interval of q outside which θ is surely not defined [unit]."""
    match drive:
        case DirectDrive():
            return -np.inf, np.inf
        case TableDrive():
            return min(drive.actuator), max(drive.actuator)
        case CylinderDrive() | FourBarDrive():
            return (
                abs(drive.base_m - drive.rod_m) - drive.length_at_zero_m,
                drive.base_m + drive.rod_m - drive.length_at_zero_m,
            )


def actuator_value(
    drive: Drive, joint: float, lower: float | None = None, upper: float | None = None
) -> float:
    """Q with θ(q) = ``joint``, over [lower, upper] where the drive must be monotone.

    Without limits the whole domain is searched; linkages that fold over need limits.

    Raises:
        GeometryError: if there is no such q, or more than one.
    """
    if isinstance(drive, DirectDrive):
        return (joint - drive.offset) / drive.scale
    lo, hi = domain(drive)
    q = np.linspace(lo if lower is None else lower, hi if upper is None else upper, 4097)
    error = joint_value(drive, q) - joint
    with np.errstate(invalid="ignore"):
        change = np.flatnonzero((error[:-1] < 0.0) != (error[1:] < 0.0))
    change = change[np.isfinite(error[change]) & np.isfinite(error[change + 1])]
    exact = np.flatnonzero(np.abs(error) <= 1e-12)  # noqa: PLR2004  # an end of the range
    if exact.size:
        return float(q[exact[0]])
    if change.size != 1:
        raise GeometryError(
            f"{drive}: {change.size} actuator values in [{q[0]:.6g}, {q[-1]:.6g}] give the joint "
            f"value {joint:.6g}; give the limits of this actuator in its own units"
        )
    a, b = float(q[change[0]]), float(q[change[0] + 1])
    rising = error[change[0]] < 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        below = float(joint_value(drive, np.array(middle))) < joint
        a, b = (middle, b) if below == rising else (a, middle)
    return 0.5 * (a + b)


Side: TypeAlias = float | FloatArray


def _angle(a: Side, b: Side, opposite: Side) -> FloatArray:
    """Angle between sides a and b of a triangle; NaN if it cannot close."""
    return np.asarray(np.arccos((a * a + b * b - opposite * opposite) / (2.0 * a * b)))


def corner_angle(corner: str, base: float, rod: float, length: FloatArray) -> FloatArray:
    """A corner of the triangle (base, rod, L); NaN where it cannot close."""
    length = np.where(length > 0.0, length, np.nan)
    if corner == "pivot":
        return _angle(base, rod, length)
    side, other = (base, rod) if corner == "base" else (rod, base)
    return _angle(side, length, other)


def _angle_scalar(a: float, b: float, opposite: float) -> float:
    double = 2.0 * a * b
    cosine = (a * a + b * b - opposite * opposite) / double if double else math.nan
    return math.acos(cosine) if -1.0 <= cosine <= 1.0 else math.nan


def _corner_scalar(corner: str, base: float, rod: float, length: float) -> float:
    if length <= 0.0:
        return math.nan
    if corner == "pivot":
        return _angle_scalar(base, rod, length)
    side, other = (base, rod) if corner == "base" else (rod, base)
    return _angle_scalar(side, length, other)


def _diagonal_squared(drive: FourBarDrive, h: FloatArray) -> FloatArray:
    ground, rocker = drive.ground_m, drive.rocker_m
    return np.asarray(ground**2 + rocker**2 - 2.0 * ground * rocker * np.cos(h))


def _interpolated(drive: TableDrive, q: float) -> float:
    x, y = drive.actuator, drive.joint
    if x[0] > x[-1]:
        x, y = x[::-1], y[::-1]
    if not x[0] <= q <= x[-1]:
        return math.nan
    i = min(bisect_right(x, q), len(x) - 1)
    share = (q - x[i - 1]) / (x[i] - x[i - 1])
    return y[i - 1] + share * (y[i] - y[i - 1])


def ascending(drive: TableDrive) -> tuple[FloatArray, FloatArray]:
    """The table's points, actuator values rising."""
    x, y = np.array(drive.actuator), np.array(drive.joint)
    return (x, y) if x[0] < x[-1] else (x[::-1], y[::-1])
