"""Pins of the excavator and the triangle and four-bar geometry that its cylinders obey.

Frames: x ahead along the link, z up when the arm lies flat, angles counter-clockwise seen
from the right-hand side (-y), so raising and reaching out are positive. [m], [rad].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, radians, sin, sqrt

from parts import XZ

SWING_HEIGHT_M = 1.0
FOOT: XZ = (0.12, 0.80)
"""Boom foot in the house frame (house frame: on the swing axis, on top of the slew ring)."""
BOOM_M, STICK_M, BUCKET_M = 5.7, 2.9, 1.5


def polar(radius: float, angle: float) -> XZ:
    """Point at a distance and an angle from the origin."""
    return (radius * cos(angle), radius * sin(angle))


def corner(a: float, b: float, opposite: float) -> float:
    """Angle between sides ``a`` and ``b`` of a triangle."""
    return acos((a * a + b * b - opposite * opposite) / (2 * a * b))


def wrap(angle: float) -> float:
    """The same angle in (-π, π]."""
    return pi - (pi - angle) % (2 * pi)


@dataclass(frozen=True)
class Triangle:
    """Cylinder between ``base`` on one link and ``rod`` on another that turns about (0, 0).

    ``base`` is given in the frame of the link that carries the pivot, relative to the pivot;
    ``rod`` in the frame of the driven link. Retracted length and stroke in [m].
    """

    base: XZ
    rod: XZ
    retracted_m: float
    stroke_m: float

    @property
    def base_m(self) -> float:
        """Pivot to barrel pin."""
        return hypot(*self.base)

    @property
    def rod_m(self) -> float:
        """Pivot to rod pin."""
        return hypot(*self.rod)

    @property
    def base_angle(self) -> float:
        """Direction from the pivot to the barrel pin."""
        return atan2(self.base[1], self.base[0])

    @property
    def rod_angle(self) -> float:
        """Direction from the pivot to the rod pin, in the driven link."""
        return atan2(self.rod[1], self.rod[0])

    def at_pivot(self, stroke: float) -> float:
        """Corner at the pivot."""
        return corner(self.base_m, self.rod_m, self.retracted_m + stroke)

    def at_base(self, stroke: float) -> float:
        """Corner at the barrel pin."""
        return corner(self.base_m, self.retracted_m + stroke, self.rod_m)

    def at_rod(self, stroke: float) -> float:
        """Corner at the rod pin."""
        return corner(self.rod_m, self.retracted_m + stroke, self.base_m)


BOOM_CYLINDER = Triangle(base=(0.50, -0.60), rod=(2.30, 0.45), retracted_m=1.66, stroke_m=1.20)
STICK_BASE: XZ = (2.75, 0.98)
"""Barrel pin of the stick cylinder in the boom frame."""
STICK_CYLINDER = Triangle(
    base=(STICK_BASE[0] - BOOM_M, STICK_BASE[1]),
    rod=polar(0.80, radians(167)),
    retracted_m=2.44,
    stroke_m=1.34,
)

GROUND_M, ROCKER_M, COUPLER_M, FOLLOWER_M = 0.45, 0.62, 0.60, 0.46
GROUND_ANGLE = radians(171)
"""Direction from the bucket pin to the rocker pivot in the stick frame."""
ROCKER_PIVOT: XZ = (STICK_M + GROUND_M * cos(GROUND_ANGLE), GROUND_M * sin(GROUND_ANGLE))
BUCKET_BASE: XZ = (0.35, 0.50)
"""Barrel pin of the bucket cylinder in the stick frame."""
EAR_ANGLE = radians(110)
"""Direction from the bucket pin to the coupler pin in the bucket frame."""
EAR: XZ = polar(FOLLOWER_M, EAR_ANGLE)
BUCKET_CYLINDER = Triangle(
    base=(BUCKET_BASE[0] - ROCKER_PIVOT[0], BUCKET_BASE[1] - ROCKER_PIVOT[1]),
    rod=(ROCKER_M, 0.0),
    retracted_m=1.66,
    stroke_m=0.96,
)
ROCKER_OFFSET = BUCKET_CYLINDER.base_angle - (GROUND_ANGLE - pi)


def boom_angle(stroke: float) -> float:
    """Boom over the horizontal."""
    c = BOOM_CYLINDER
    return c.base_angle - c.rod_angle + c.at_pivot(stroke)


def boom_barrel_angle(stroke: float) -> float:
    """Boom cylinder in the house frame."""
    c = BOOM_CYLINDER
    return wrap(c.base_angle + pi) - c.at_base(stroke)


def stick_angle(stroke: float) -> float:
    """Stick relative to the boom; it curls in as the cylinder lengthens."""
    c = STICK_CYLINDER
    return c.base_angle - c.rod_angle - c.at_pivot(stroke)


def stick_rod_angle(stroke: float) -> float:
    """Stick cylinder, from rod pin to barrel pin, in the stick frame."""
    c = STICK_CYLINDER
    return wrap(c.rod_angle + pi) - c.at_rod(stroke)


def rocker_angle(stroke: float) -> float:
    """Rocker in the stick frame."""
    c = BUCKET_CYLINDER
    return c.base_angle - c.at_pivot(stroke)


def bucket_rod_angle(stroke: float) -> float:
    """Bucket cylinder, from rod pin to barrel pin, in the rocker frame."""
    return pi - BUCKET_CYLINDER.at_rod(stroke)


def diagonal(stroke: float) -> float:
    """Rocker tip to bucket pin."""
    h = ROCKER_OFFSET - BUCKET_CYLINDER.at_pivot(stroke)
    return sqrt(GROUND_M**2 + ROCKER_M**2 - 2 * GROUND_M * ROCKER_M * cos(h))


def bucket_angle(stroke: float) -> float:
    """Bucket relative to the stick; it curls in as the cylinder lengthens."""
    r = diagonal(stroke)
    f, g = corner(r, GROUND_M, ROCKER_M), corner(r, FOLLOWER_M, COUPLER_M)
    return GROUND_ANGLE - EAR_ANGLE - f - g


def coupler_angle(stroke: float) -> float:
    """Coupler, from the bucket's ear to the rocker tip, in the bucket frame."""
    return EAR_ANGLE + pi - corner(COUPLER_M, FOLLOWER_M, diagonal(stroke))
