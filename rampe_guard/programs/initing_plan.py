"""What a new site file says of each actuator, and why: measured, from the URDF, or not known.

What could not be measured gets a value that warns early rather than late, and a TODO.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rampe_guard.collision.urdf import read_urdf
from rampe_guard.collision.urdf_joints import MovableJoint, movable_joints
from rampe_guard.core.identify import DEADBAND_UNSEEN, Estimate, Measured
from rampe_guard.errors import SettingsError

LAG_UNSEEN_S = 0.3
TOP_UNSEEN = {"rad": 1.0, "m": 0.5}
"""Where neither the machine nor its URDF says it [unit/s]."""
_STOP_UNSEEN_S = 1.0
"""Time in which an actuator of which no stop was seen is taken to stop from its top speed [s]."""
_MORE = 1.05
"""A top speed that was seen is not the highest there is."""
_RISING = 1.5
"""What is taken of a speed that was still rising when it was seen."""
_FEW = 3
_OTHER_UNITS = {
    "rad": (("degrees", math.pi / 180.0),),
    "m": (("centimetres", 0.01), ("millimetres", 0.001)),
}
"""What positions may be in, and what makes them those of a URDF."""
_FAR = 3.0
"""Positions in another unit are so many times beyond the ends, at least."""
_WIDEST_DEADBAND = 0.3
"""No lever needs more to begin to move something: what was measured so was something else [-]."""
_BEYOND = 0.05
"""Share of its range by which a position may be outside before a guard refuses it."""


@dataclass(frozen=True, slots=True)
class Said:
    """A value and where it came from; ``todo`` if somebody should look at it."""

    value: Any
    why: str
    todo: bool = False

    @property
    def comment(self) -> str:
        """For behind the value."""
        return f"TODO {self.why}" if self.todo else self.why


def unit_of(joint: MovableJoint) -> str:
    """Of a joint's position: rad or m."""
    return "m" if joint.kind == "prismatic" else "rad"


@dataclass(frozen=True, slots=True)
class ActuatorPlan:
    """One entry of ``arm.actuators``."""

    name: str
    joint: MovableJoint
    axis: Said
    sign: Said
    max_velocity: Said
    max_deceleration: Said
    lag_s: Said
    deadband: Said
    seen: tuple[float, float] | None
    drive: dict[str, Any] | None = None
    limits: Said | None = None
    problems: tuple[str, ...] = field(default=())

    @property
    def range(self) -> str:
        """Where it was seen; empty if nowhere."""
        if self.seen is None:
            return ""
        low, high = (round(end, 3) + 0.0 for end in self.seen)  # no -0.000
        return f"{low:.3f} … {high:.3f} {self.unit}"

    @property
    def unit(self) -> str:
        """Of its position."""
        return unit_of(self.joint) if self.drive is None else "m"


def joints_of(urdf: Path) -> list[MovableJoint]:
    """Movable joints of a URDF that follow no other, those nearer to the base first.

    Raises:
        GeometryError: it cannot be read.
        SettingsError: nothing in it moves.
    """
    found = list(movable_joints(read_urdf(urdf)))
    if not found:
        raise SettingsError(f"{urdf}: none of its joints moves; there is nothing to guard")
    return found


def chosen_joints(
    joints: Sequence[MovableJoint],
    count: int,
    told: Sequence[str] | None,
    names: Sequence[str] | None,
    urdf: str,
) -> tuple[list[MovableJoint], bool]:
    """The joint of each actuator, and whether that is sure.

    Args:
        joints: of the URDF.
        count: of actuators in a message.
        told: names of joints by the user, in the order of the messages.
        names: of the actuators, where messages have them.
        urdf: for messages.

    Raises:
        SettingsError: it cannot be told which joint an actuator is.
    """
    by_name = {joint.name: joint for joint in joints}
    known = ", ".join(by_name)
    full = [name if name in by_name else f"{name}_joint" for name in names or ()]
    wanted = list(told or ()) or (full if full and all(name in by_name for name in full) else None)
    if wanted is not None:
        wrong = [name for name in wanted if name not in by_name]
        if wrong:
            raise SettingsError(
                f"--joints: {urdf} has no movable joint {wrong[0]!r}; it has {known}"
            )
        if twice := [name for name in wanted if wanted.count(name) > 1]:
            raise SettingsError(f"--joints: {twice[0]} is named twice; each joint has one position")
        if len(wanted) != count:
            raise SettingsError(
                f"--joints names {len(wanted)} joints, and messages have {count} positions"
            )
        return [by_name[name] for name in wanted], True
    if len(joints) != count:
        raise SettingsError(
            f"messages have {count} positions, and {urdf} has {len(joints)} movable joints:"
            f" {known}; give --joints, one for each position, in their order"
        )
    return list(joints), count == 1


def plan(
    joints: Sequence[MovableJoint],
    names: Sequence[str],
    measured: Sequence[Measured] | None,
    drives: dict[str, dict[str, Any]],
    axes: int,
) -> list[ActuatorPlan]:
    """The actuators as they are proposed.

    Args:
        joints: of each.
        names: of each.
        measured: of each; None if nothing was.
        drives: by name, of those that do not drive their joint directly.
        axes: how many the joystick has; 0 if nobody heard it.

    Raises:
        SettingsError: there are fewer axes than actuators, or a drive is of no actuator.
    """
    if axes and axes < len(joints):
        raise SettingsError(
            f"the joystick has {axes} axes and there are {len(joints)} actuators; every actuator"
            " needs a lever of its own: send an axis that stays 0 for those without"
        )
    unknown = [name for name in drives if name not in names]
    if unknown:
        raise SettingsError(
            f"--cylinder {unknown[0]!r} is no actuator; there are {', '.join(names)}"
        )
    seen = list(measured) if measured else [None] * len(joints)
    taken = {one.lever.axis for one in seen if one is not None} - {None}
    free = iter(axis for axis in range(max(axes, len(joints))) if axis not in taken)
    found = []
    for joint, name, one in zip(joints, names, seen, strict=True):
        axis = None if one is None else one.lever.axis
        spare = next(free) if axis is None else axis
        found.append(_actuator(joint, name, one, drives.get(name), spare))
    return found


def _actuator(
    joint: MovableJoint, name: str, one: Measured | None, drive: dict[str, Any] | None, axis: int
) -> ActuatorPlan:
    unit = unit_of(joint) if drive is None else "m"
    lever = None if one is None else one.lever
    if lever is not None and lever.axis is not None:
        told = f"measured: explains {lever.share:.0%} of the motion"
        place = Said(axis, told)
        sign = Said(lever.sign, "measured") if lever.sign else Said(1, "not measured", todo=True)
    else:
        why = "not measured" if lever is None else f"not measured: {lever.problem}"
        place = Said(axis, f"{why}; this is the next one that is free", todo=True)
        sign = Said(1, "not measured", todo=True)
    speed = _speed(joint, unit, one)
    stop = None if one is None else one.max_deceleration
    usual = _nice(speed.value / _STOP_UNSEEN_S)
    slow = f"not measured: taken to stop within {_STOP_UNSEEN_S:g} s"
    limits, problems = _limits(joint, drive, one)
    return ActuatorPlan(
        name=name,
        joint=joint,
        axis=place,
        sign=sign,
        max_velocity=speed,
        max_deceleration=_said(stop, usual, slow, up=False),
        lag_s=_said(None if one is None else one.lag_s, LAG_UNSEEN_S, "not measured", up=True),
        deadband=_deadband(one),
        seen=None if one is None else one.seen,
        drive=drive,
        limits=limits,
        problems=(*(() if one is None else one.problems), *problems),
    )


def _speed(joint: MovableJoint, unit: str, one: Measured | None) -> Said:
    seen = None if one is None else one.max_velocity
    if one is not None and seen is not None and not one.lever.sign:
        most = joint.velocity if unit == unit_of(joint) else None
        value = max((_MORE if seen.events else _RISING) * seen.value, most or TOP_UNSEEN[unit])
        return Said(
            _nice(value, up=True),
            f"not measured: by no lever that is known; {seen.how}",
            todo=True,
        )
    if seen is not None and not seen.events:
        most = joint.velocity if unit == unit_of(joint) else None
        value = max(_RISING * seen.value, 0.0 if most is None else min(most, 2.0 * seen.value))
        return Said(_nice(value, up=True), f"more than measured: {seen.how}", todo=True)
    if seen is not None:
        told = f"measured, and {_MORE - 1.0:.0%} more: {seen.how}"
        return Said(_nice(_MORE * seen.value, up=True), told, "reckoned" in seen.how)
    if joint.velocity is not None and unit == unit_of(joint):
        return Said(joint.velocity, "URDF; not measured", todo=True)
    return Said(TOP_UNSEEN[unit], "not measured", todo=True)


def _deadband(one: Measured | None) -> Said:
    seen = None if one is None else one.deadband
    if seen is not None and seen.value > _WIDEST_DEADBAND:
        why = f"less than measured, which is more than levers have: {seen.how}"
        return Said(_WIDEST_DEADBAND, why, todo=True)
    return _said(seen, DEADBAND_UNSEEN, "not measured", up=False, few=1)


def _limits(
    joint: MovableJoint, drive: dict[str, Any] | None, one: Measured | None
) -> tuple[Said | None, tuple[str, ...]]:
    """Limits to write, if the URDF's will not do, and what is wrong with what was seen."""
    seen = None if one is None or not one.moved else one.seen
    low, high = joint.lower, joint.upper
    if drive is None and joint.kind == "revolute" and math.isinf(low):
        text = "the URDF tells no ends, or such as no joint has, and it is taken as endless:"
        return None, (f"{text} if it has ends, write limits: {{lower: …, upper: …}}",)
    if drive is not None or not np.isfinite(high - low):
        if seen is None or (drive is None and joint.kind != "prismatic"):
            return None, ()
        room = _BEYOND * (seen[1] - seen[0])
        ends = {"lower": _nice(seen[0] - room), "upper": _nice(seen[1] + room, up=True)}
        return Said(ends, "as far as it was seen to go; give the true ends", todo=True), ()
    if seen is None:
        return None, ()
    return None, _beyond(joint, seen)


def _beyond(joint: MovableJoint, seen: tuple[float, float]) -> tuple[str, ...]:
    """What is wrong if an actuator was seen where its joint cannot be."""
    low, high = joint.lower, joint.upper
    slack = _BEYOND * (high - low)
    if seen[0] >= low - slack and seen[1] <= high + slack:
        return ()
    text = f"it was at {seen[0]:.4g} … {seen[1]:.4g}, beyond the URDF's {low:.4g} … {high:.4g}: "
    far = max(map(abs, seen)) > _FAR * max(abs(low), abs(high))
    for words, scale in _OTHER_UNITS[unit_of(joint)] if far else ():
        if seen[0] * scale >= low - slack and seen[1] * scale <= high + slack:
            return (f"{text}{words}? Of a CSV log, --actuators COLUMN:{scale:.7g} mends it",)
    return (f"{text}another joint, another unit, or a cylinder (--cylinder)?",)


def _said(estimate: Estimate | None, else_: float, why: str, *, up: bool, few: int = _FEW) -> Said:
    if estimate is None:
        return Said(else_, why, todo=True)
    todo = estimate.events < few
    return Said(_nice(estimate.value, up=up), f"measured: {estimate.how}", todo=todo)


def _nice(value: float, *, up: bool = False) -> float:
    """Two to three digits, never less (or, with ``up`` false, never more) than the value."""
    if value == 0.0:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    whole = np.ceil(value / step - 1e-9) if up else np.floor(value / step + 1e-9)
    return float(f"{whole * step:.6g}")
