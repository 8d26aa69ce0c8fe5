"""Joy and JointState of a machine that nobody has described yet, of a bag or live → `Heard`.

What only a site file could tell is what most messages say: how many axes there are, and which
joints of the URDF. Then each is read as a guard reads it, and refused by the same words.
"""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rampe_guard.core.arm import JointDrive
from rampe_guard.core.drive import CylinderDrive, DirectDrive
from rampe_guard.errors import LogError, MessageError, SettingsError
from rampe_guard.programs.measuring import Arrived, Heard, heard_of
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.inputs import JointReader, decode_joy
from rampe_guard.ros2.inverse import Inverse
from rampe_guard.runtime.decoding import Decoders
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, RosType

_SHOWN = 160
"""Of a list of names in an error."""


@dataclass(frozen=True, slots=True)
class Joints:
    """Which joints count: those of the URDF in their order, or those that the user told."""

    known: Sequence[str]
    told: Sequence[str] = ()


def heard_in_ros2(
    levers: Sequence[Arrived],
    positions: Sequence[Arrived],
    topics: tuple[str, str],
    joints: Joints,
    origin: str,
) -> Heard:
    """Both inputs, of messages in CDR.

    Args:
        levers: sensor_msgs/Joy.
        positions: sensor_msgs/JointState.
        topics: of the same, as a site file names them.
        joints: that count, whatever else a JointState names.
        origin: where it comes from, in words.

    Raises:
        LogError: nothing of them can be used, or they do not name the joints.
        SettingsError: the extra is not installed.
    """
    names = _joints(positions, joints, f"{origin}: {topics[1]}")
    axes = _axes(levers)
    boundless = np.array([(-np.inf, np.inf)] * len(names))
    reader = JointReader([JointDrive(n, i, DirectDrive()) for i, n in enumerate(names)], boundless)
    decoders = Decoders(lambda payload: decode_joy(payload, axes), reader)
    heard = heard_of(levers, positions, decoders, topics, origin)
    return replace(heard, traces=replace(heard.traces, names=names), ros2=True)


def in_strokes(heard: Heard, drives: Mapping[int, dict[str, Any]]) -> Heard:
    """The same, with the strokes of cylinders in the place of the joints that they turn.

    ROS 2 tells joints; a site file, and all that is measured, is of actuators.

    Args:
        heard: positions of joints.
        drives: cylinders, by the place of the joint.

    Raises:
        SettingsError: a joint was where its cylinder cannot bring it.
    """
    position = heard.traces.position.copy()
    for place, numbers in drives.items():
        inverse = Inverse(CylinderDrive(**numbers), -np.inf, np.inf)
        angles = position[:, place].tolist()
        strokes = [inverse.actuator(angle) for angle in angles]
        if not all(map(math.isfinite, strokes)):
            joint = (heard.traces.names or ())[place]
            raise SettingsError(
                f"--cylinder: {joint} was at {min(angles):.4g} … {max(angles):.4g} rad, where no"
                " stroke of its cylinder brings it; look at angle_offset_rad, direction and lengths"
            )
        position[:, place] = strokes
    return replace(heard, traces=replace(heard.traces, position=position))


def _axes(levers: Sequence[Arrived]) -> int:
    """As many as most messages have."""
    counts = Counter(len(said.axes) for said in _read(levers, JOY))
    return counts.most_common(1)[0][0] if counts else 0


def _joints(positions: Sequence[Arrived], joints: Joints, where: str) -> tuple[str, ...]:
    """The joints to read: those told, or else those of which most positions came at a time.

    A JointState of a gripper alone, on the topic of the whole arm, names joints too.
    """
    sets: Counter[tuple[str, ...]] = Counter()
    named: set[str] = set()
    for said in _read(positions, JOINT_STATE):
        place = dict(zip(said.name, said.position.tolist(), strict=False))
        named.update(said.name)
        sets[tuple(n for n in joints.known if math.isfinite(place.get(n, math.nan)))] += 1
    missing = [name for name in joints.told if name not in named]
    found = max(sets, key=lambda names: len(names) * sets[names], default=())
    found = found or tuple(name for name in joints.known if name in named)
    if sets and (missing or not (joints.told or found)):
        what = f"never names {missing[0]}" if missing else "names no joint of the URDF"
        listed = ascii(", ".join(sorted(named)))[1:-1][:_SHOWN] or "none"
        raise LogError(
            f"{where} {what}; it names {listed}, and the URDF moves {', '.join(joints.known)}"
        )
    return tuple(joints.told) or found


def _read(arrived: Sequence[Arrived], kind: RosType) -> Iterator[Any]:
    """Those that can be read at all."""
    for _, payload in arrived:
        with contextlib.suppress(MessageError):
            yield cdr.decode(payload, kind)
