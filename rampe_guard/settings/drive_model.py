"""The ``drive`` of an actuator in the site file: models, and the core value of each."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from rampe_guard.core.drive import CylinderDrive, DirectDrive, Drive, FourBarDrive, TableDrive
from rampe_guard.settings.model import Length, Model, NonNegative, Number

Angle = Annotated[float, Field(ge=-10.0, le=10.0)]
Direction = Literal[-1, 1]


class _Triangle(Model):
    base_m: Length = Field(description="The distance from the pivot to the barrel pin [m].")
    rod_m: Length = Field(description="The distance from the pivot to the rod pin [m].")
    length_at_zero_m: NonNegative = Field(
        description="The pin-to-pin length of the cylinder when the actuator reads 0 [m]."
    )


class DirectModel(Model):
    """Joint = offset + scale·actuator."""

    type: Literal["direct"] = Field(description="The kind of drive.")
    scale: Number = Field(default=1.0, description="The joint motion per actuator motion; not 0.")
    offset: Number = Field(default=0.0, description="The joint value at actuator 0 [rad or m].")

    def to_core(self) -> Drive:
        """The core value."""
        return DirectDrive(self.scale, self.offset)


class CylinderModel(_Triangle):
    """A cylinder across the joint: the triangle pivot, barrel pin, rod pin."""

    type: Literal["cylinder"] = Field(description="The kind of drive.")
    angle_offset_rad: Angle = Field(
        default=0.0, description="The joint value where the corner angle would be 0 [rad]."
    )
    direction: Direction = Field(
        default=1, description="The sign 1 if the joint value grows with the corner angle, else -1."
    )
    corner: Literal["pivot", "base", "rod"] = Field(
        default="pivot",
        description="The corner of the triangle that turns the joint: pivot (the driven link), "
        "base (the barrel itself) or rod.",
    )

    def to_core(self) -> Drive:
        """The core value."""
        return CylinderDrive(**self.model_dump(exclude={"type"}))


class FourBarModel(_Triangle):
    """A bucket linkage: the cylinder turns a rocker, a coupler turns the follower."""

    type: Literal["four_bar"] = Field(description="The kind of drive.")
    rocker_offset_rad: Angle = Field(
        description="The angle from which the cylinder's pivot angle is taken off to give the "
        "angle between ground and rocker [rad]."
    )
    ground_m: Length = Field(description="The distance between the two fixed pivots [m].")
    rocker_m: Length = Field(description="The length of the rocker [m].")
    coupler_m: Length = Field(description="The length of the coupler [m].")
    follower_m: Length = Field(description="The length of the follower, on the bucket [m].")
    angle_offset_rad: Angle = Field(
        default=0.0, description="The joint value where the follower angle would be 0 [rad]."
    )
    direction: Direction = Field(
        default=1,
        description="The sign 1 if the joint value grows with the follower angle, else -1.",
    )

    def to_core(self) -> Drive:
        """The core value."""
        return FourBarDrive(**self.model_dump(exclude={"type"}))


_Points = Annotated[tuple[Number, ...], Field(min_length=2, max_length=1000)]


class TableModel(Model):
    """Piecewise linear through measured points."""

    type: Literal["table"] = Field(description="The kind of drive.")
    actuator: _Points = Field(
        description="The actuator values, strictly rising or falling [actuator unit]."
    )
    joint: _Points = Field(
        description="The joint value at each of them, strictly rising or falling [rad or m]."
    )

    def to_core(self) -> Drive:
        """The core value."""
        return TableDrive(self.actuator, self.joint)


DriveModel = Annotated[
    DirectModel | CylinderModel | FourBarModel | TableModel, Field(discriminator="type")
]


def impossible(drive: Drive, lower: float | None, upper: float | None) -> str | None:
    """Why ``drive`` cannot work between the given limits [actuator unit]; None if it can."""
    if isinstance(drive, DirectDrive):
        return "scale 0 never moves the joint" if drive.scale == 0.0 else None
    if isinstance(drive, TableDrive):
        return _bad_table(drive, lower, upper)
    shortest, longest = abs(drive.base_m - drive.rod_m), drive.base_m + drive.rod_m
    for which, limit in (("lower", lower), ("upper", upper)):
        length = None if limit is None else drive.length_at_zero_m + limit
        if length is not None and not shortest < length < longest:
            return (
                f"at the {which} limit {limit:g} the cylinder is {length:g} m long, but base_m "
                f"and rod_m close only between {shortest:g} and {longest:g} m"
            )
    if isinstance(drive, FourBarDrive):
        bars = [drive.ground_m, drive.rocker_m, drive.coupler_m, drive.follower_m]
        if 2.0 * max(bars) >= sum(bars):
            return f"its longest bar, {max(bars):g} m, is not shorter than the other three together"
    return None


def _bad_table(drive: TableDrive, lower: float | None, upper: float | None) -> str | None:
    if len(drive.actuator) != len(drive.joint):
        return f"{len(drive.actuator)} actuator values but {len(drive.joint)} joint values"
    for name, values in (("actuator", drive.actuator), ("joint", drive.joint)):
        steps = [b - a for a, b in pairwise(values)]
        if not (all(s > 0.0 for s in steps) or all(s < 0.0 for s in steps)):
            return f"the {name} values neither rise nor fall throughout"
    first, last = min(drive.actuator), max(drive.actuator)
    for which, limit in (("lower", lower), ("upper", upper)):
        if limit is not None and not first <= limit <= last:
            return f"the {which} limit {limit:g} is outside its points, {first:g} to {last:g}"
    return None
