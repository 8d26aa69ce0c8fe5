"""Actuator ↔ joint maps. Each is strictly monotone over its domain, else it is refused.

Monotone maps are what lets a sweep bound joint motion by the difference of end values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias


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
    f = acos((r² + ground² - rocker²)/(2·r·ground)); g = acos((r² + follower² - coupler²)/(2·r·follower));
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
