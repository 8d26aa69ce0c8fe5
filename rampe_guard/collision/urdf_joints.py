"""Joints of a URDF and what drives each: actuators, joints that they follow, or nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.drive import actuator_value, domain
from rampe_guard.core.drive_proof import check_monotone
from rampe_guard.core.kinematics import JointMap
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.urdf_model import Joint, Tree
    from rampe_guard.core.arm import ArmDescription, JointDrive
    from rampe_guard.core.types import FloatArray

SLACKS = (0.1, 0.05, 0.02, 0.0)
"""Shares of its range by which a path may overrun an actuator's limits, the first that works."""
TURNING = ("revolute", "continuous")
MOVABLE = (*TURNING, "prismatic")
FARTHEST = 1e6
"""Ends beyond it are how some say that there are none; no position is beyond it [rad or m]."""
MANY = ("floating", "planar")
"""More than one way to move, which no actuator drives."""


@dataclass(frozen=True, slots=True)
class MovableJoint:
    """A joint that an actuator can drive, as the URDF has it.

    Attributes:
        name: of the joint.
        kind: revolute, continuous or prismatic.
        lower, upper: its ends [rad or m]; infinite where there are none.
        velocity: its top speed [rad/s or m/s]; None where the URDF does not say.
        parent, child: the links that it joins.
        depth: movable joints above it.
    """

    name: str
    kind: str
    lower: float
    upper: float
    velocity: float | None
    parent: str
    child: str
    depth: int


def movable_joints(tree: Tree) -> tuple[MovableJoint, ...]:
    """Joints that an actuator can drive, those nearer to the base first.

    Joints that follow others (mimic) are left out: they need no actuator.
    """
    above = {joint.child: joint for joint in tree.joints}
    found = []
    for joint in tree.joints:
        if joint.type in MOVABLE and joint.mimic is None:
            lower, upper = ends_of(joint)
            speed = None if joint.limit is None else joint.limit.velocity
            good = speed is not None and np.isfinite(speed) and speed > 0.0
            found.append(
                MovableJoint(
                    joint.name,
                    joint.type,
                    lower,
                    upper,
                    speed if good else None,
                    joint.parent,
                    joint.child,
                    _depth(joint, above),
                )
            )
    return tuple(sorted(found, key=lambda joint: joint.depth))


def _depth(joint: Joint, above: Mapping[str, Joint]) -> int:
    seen, count = {joint.name}, 0
    nearer = above.get(joint.parent)
    while nearer is not None and nearer.name not in seen:
        seen.add(nearer.name)
        count += nearer.type in MOVABLE and nearer.mimic is None
        nearer = above.get(nearer.parent)
    return count


def ends_of(joint: Joint) -> tuple[float, float]:
    """Its ends [rad or m], infinite where the URDF gives none, or such as no joint has."""
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return -np.inf, np.inf
    if max(-limit.lower, limit.upper) > FARTHEST:
        return -np.inf, np.inf
    return limit.lower, limit.upper


@dataclass(frozen=True, slots=True)
class Follow:
    """A joint's value is ``multiplier`` times that of joint ``source``, plus ``offset``."""

    source: str
    multiplier: float
    offset: float


def follows(joints: Mapping[str, Joint], driven: frozenset[str], path: Path) -> dict[str, Follow]:
    """Per joint that follows another, the joint at the end of the line and how it does.

    A joint that an actuator drives follows nobody.

    Raises:
        GeometryError: it follows itself, or a joint that is not there or that moves more ways
            than one.
    """
    found: dict[str, Follow] = {}
    for name, joint in joints.items():
        if joint.mimic is None or name in driven or joint.type not in MOVABLE:
            continue
        multiplier, offset, now, seen = 1.0, 0.0, joint, [name]
        while now.mimic is not None and now.name not in driven:
            offset += multiplier * now.mimic.offset
            multiplier *= now.mimic.multiplier
            source = joints.get(now.mimic.joint)
            if source is None:
                raise GeometryError(
                    f"{path}: joint '{now.name}' follows (mimic) joint '{now.mimic.joint}',"
                    " which is not there"
                )
            if source.name in seen:
                way = " → ".join(f"'{one}'" for one in (*seen, source.name))
                raise GeometryError(f"{path}: joints follow (mimic) each other in a loop: {way}")
            if source.type in MANY:
                raise GeometryError(
                    f"{path}: joint '{now.name}' follows (mimic) joint '{source.name}', which is"
                    f" {source.type} and has no one value"
                )
            seen.append(source.name)
            now = source
        if not np.isfinite([multiplier, offset]).all():
            raise GeometryError(f"{path}: joint '{name}': mimic multiplier and offset not finite")
        found[name] = Follow(now.name, multiplier, offset)
    return found


def joint_maps(
    description: ArmDescription, joints: Mapping[str, Joint], path: Path
) -> dict[str, JointMap]:
    """What drives each joint that moves.

    Raises:
        GeometryError: a joint that is not there, cannot move, or is driven twice.
    """
    maps: dict[str, JointMap] = {}
    for entry in description.joints:
        joint = joints.get(entry.joint)
        if joint is None:
            known = ", ".join(name for name, j in joints.items() if j.type in MOVABLE)
            raise GeometryError(f"{path}: no joint '{entry.joint}'; it has {known or 'none'}")
        if joint.type not in MOVABLE:
            raise GeometryError(f"{path}: joint '{entry.joint}' is {joint.type}, nothing to drive")
        if entry.joint in maps:
            raise GeometryError(f"{path}: joint '{entry.joint}' is driven twice")
        maps[entry.joint] = JointMap(entry.actuator, entry.drive)
    for name, follow in follows(joints, frozenset(maps), path).items():
        if follow.source in maps:
            source = maps[follow.source]
            maps[name] = JointMap(source.actuator, source.drive, follow.multiplier, follow.offset)
    return maps


def held_values(
    joints: Mapping[str, Joint], maps: Mapping[str, JointMap], path: Path
) -> dict[str, float]:
    """Where joints are held that could move but that nothing drives [rad or m].

    At 0, or the limit nearest to it; one that follows another where that one takes it.
    """
    following = follows(joints, frozenset(maps), path)
    held: dict[str, float] = {}
    for name, joint in joints.items():
        if joint.type == "fixed" or name in maps:
            continue
        follow = following.get(name)
        if follow is None:
            held[name] = _rest(joint)
        else:
            source = joints[follow.source]
            rest = 0.0 if source.type == "fixed" else _rest(source)
            held[name] = follow.multiplier * rest + follow.offset
    return held


def _rest(joint: Joint) -> float:
    if joint.type in MANY:
        return 0.0
    return float(np.clip(0.0, *ends_of(joint)))


def actuator_limits(
    description: ArmDescription, joints: Mapping[str, Joint], path: Path
) -> FloatArray:
    """Per actuator its ends (n, 2) [unit]: the site's, else those of its joint through the drive.

    Raises:
        GeometryError: they are no range, or the drive does not reach them.
    """
    limits = np.empty((len(description.limits), 2))
    for i, given in enumerate(description.limits):
        entry = description.joints[i]
        lower, upper = given
        if lower is None or upper is None:
            ends = _through(entry, joints[entry.joint], path)
            lower = ends[0] if lower is None else lower
            upper = ends[1] if upper is None else upper
        if not lower < upper:
            raise GeometryError(
                f"{path}: actuator of joint '{entry.joint}' has limits {lower:.6g} to {upper:.6g}"
            )
        limits[i] = lower, upper
    return limits


def _through(entry: JointDrive, joint: Joint, path: Path) -> tuple[float, float]:
    lower, upper = ends_of(joint)
    if not np.isfinite([lower, upper]).all():
        return -np.inf, np.inf
    try:
        ends = [actuator_value(entry.drive, value) for value in (lower, upper)]
    except GeometryError as error:
        raise GeometryError(f"{path}: limits of joint '{entry.joint}': {error}") from error
    return min(ends), max(ends)


def proven_limits(
    limits: FloatArray, joints: Mapping[str, Joint], maps: Mapping[str, JointMap], path: Path
) -> FloatArray:
    """Widen each actuator's limits by as much slack as all its drives are proven for.

    Raises:
        GeometryError: a drive is not monotone within the limits.
    """
    proven = limits.copy()
    for i, (lower, upper) in enumerate(limits):
        mine = {name: joint for name, joint in maps.items() if joint.actuator == i}
        for slack in SLACKS:
            wide = slack * (upper - lower) if np.isfinite(upper - lower) else 0.0
            low, high = lower - wide, upper + wide
            for joint in mine.values():
                least, most = domain(joint.drive)
                if slack:
                    low, high = max(low, least), min(high, most)
            try:
                for name, joint in mine.items():
                    _check_joint(joints[name], joint, (low, high))
            except GeometryError as error:
                if slack == SLACKS[-1]:
                    raise GeometryError(f"{path}: {error}") from error
                continue
            proven[i] = min(low, lower), max(high, upper)
            break
    return proven


def _check_joint(described: Joint, joint: JointMap, ends: tuple[float, float]) -> None:
    name = described.name
    if described.type == "prismatic" and not np.isfinite(ends).all():
        mimic = described.mimic
        if mimic is None:
            raise GeometryError(
                f"joint '{name}' slides without limits; give limits of its actuator"
            )
        raise GeometryError(
            f"joint '{name}' slides and follows (mimic) joint '{mimic.joint}', which has no limits:"
            f" give limits of the actuator that moves '{mimic.joint}' in the site file, or correct"
            " the mimic"
        )
    try:
        check_monotone(joint.drive, *ends)
    except GeometryError as error:
        raise GeometryError(f"joint '{name}': {error}") from error
