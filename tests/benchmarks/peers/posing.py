"""Compiled kinematics for all peers: none of them shall wait for Python to know where links are.

Written apart from the kernels of the package and checked against its numpy kinematics at start.
Drives that are not linear are tabulated so finely that reading between the lines is exact to
1e-7 rad. Arrays over links (L) follow `Machine.links`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rampe_guard.core.drive import DirectDrive
from rampe_guard.core.kinematics import ForwardKinematics, motion_coefficients
from tests.benchmarks.peers.jit import compiled, inlined

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Machine, Motion

LINES = 1 << 13
PARENT, TURNS, ACTUATOR, CURVED, SCALE, OFFSET, FIRST, PER_STEP = range(8)
ORIGIN = 8
"""Columns of a joint: the eight above, then three poses (3, 4)."""
SHORT = 0.98
"""Share of the room that a first guess of a step uses."""


class Tables(NamedTuple):
    """An arm as few arrays, for each costs time at every call of a compiled function.

    Attributes:
        joints: numbers of each joint (J, 44).
        lines: θ on a grid of its actuator, of each joint with a curved drive (J, LINES).
        links: frame and pose in that frame of each link (L, 13).
        reach: no point of link l moves more than reach[j, l] per unit of joint j (J, L).
    """

    joints: FloatArray
    lines: FloatArray
    links: FloatArray
    reach: FloatArray


@inlined
def _angle(tables: Tables, j: int, q: float) -> float:
    row = tables.joints[j]
    if row[CURVED] == 0.0:
        return float(row[OFFSET] + row[SCALE] * q)
    x = (q - row[FIRST]) * row[PER_STEP]
    i = min(max(int(x), 0), LINES - 2)
    lines = tables.lines[j]
    return float(lines[i] + (x - i) * (lines[i + 1] - lines[i]))


@inlined
def _compose(frame: FloatArray, row: FloatArray, out: FloatArray) -> None:
    """Out (3, 4) = frame (3, 4) after the pose whose twelve numbers are ``row``."""
    for a in range(3):
        for b in range(4):
            total = 0.0
            for c in range(3):
                total += frame[a, c] * row[4 * c + b]
            out[a, b] = total
        out[a, 3] += frame[a, 3]


@inlined
def place(
    tables: Tables, way: FloatArray, s: float, rotations: FloatArray, translations: FloatArray
) -> None:
    """Rotations (L, 3, 3) and translations (L, 3) of all links at fraction s of a way (2, n)."""
    count = len(tables.joints)
    frames = np.zeros((count + 1, 3, 4))
    frames[0, 0, 0] = frames[0, 1, 1] = frames[0, 2, 2] = 1.0
    local = np.empty(12)
    for j in range(count):
        row = tables.joints[j]
        actuator = int(row[ACTUATOR])
        theta = _angle(tables, j, way[0, actuator] + s * way[1, actuator])
        one, two = theta, 0.0
        if row[TURNS] > 0.0:
            one, two = math.sin(theta), 1.0 - math.cos(theta)
        for k in range(12):
            first, second = row[ORIGIN + 12 + k], row[ORIGIN + 24 + k]
            local[k] = row[ORIGIN + k] + one * first + two * second
        _compose(frames[int(row[PARENT])], local, frames[j + 1])
    pose = np.empty((3, 4))
    for link in range(len(tables.links)):
        _compose(frames[int(tables.links[link, 0])], tables.links[link, 1:], pose)
        rotations[link] = pose[:, :3]
        translations[link] = pose[:, 3]


@inlined
def travel(tables: Tables, way: FloatArray, link: int, a: float, b: float) -> float:
    """No point of the link moves more than this between two fractions [m]."""
    total = 0.0
    for j in range(len(tables.joints)):
        reach = tables.reach[j, link]
        if reach > 0.0:
            i = int(tables.joints[j, ACTUATOR])
            if way[1, i] != 0.0:
                there = _angle(tables, j, way[0, i] + b * way[1, i])
                total += reach * abs(there - _angle(tables, j, way[0, i] + a * way[1, i]))
    return total


@inlined
def step(tables: Tables, way: FloatArray, link: int, s: float, room: float) -> float:
    """A fraction up to which the link surely stays free if it has ``room`` [m] at s; 2 = the end.

    Drives are monotone, so the way of every joint between two fractions is known exactly.
    """
    rest = travel(tables, way, link, s, 1.0)
    if rest <= room:
        return 2.0
    guess = s + SHORT * (1.0 - s) * room / rest
    for _ in range(40):
        if travel(tables, way, link, s, guess) <= room:
            break
        guess = s + 0.5 * (guess - s)
    else:
        return s
    for _ in range(2):  # where the link speeds up or slows down, the first guess falls short
        used = travel(tables, way, link, s, guess)
        if used <= 0.0 or used > SHORT * room:
            break
        longer = min(s + (guess - s) * (SHORT + 0.01) * room / used, 1.0)
        if travel(tables, way, link, s, longer) > room:
            break
        guess = longer
    return guess


@compiled
def place_all(
    tables: Tables,
    way: FloatArray,
    fractions: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> None:
    """`place` at each fraction (k,): rotations (k, L, 3, 3), translations (k, L, 3)."""
    for k in range(len(fractions)):
        place(tables, way, fractions[k], rotations[k], translations[k])


class Posing:
    """Where the links of a machine are along a motion."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.tables = _tables(machine)
        self._vertices = [hull.vertices for hull in machine.hulls]

    def poses(self, motion: Motion, fractions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations (k, L, 3, 3) and translations (k, L, 3) [m] at fractions (k,)."""
        count = len(self.machine.links)
        rotations = np.empty((len(fractions), count, 3, 3))
        translations = np.empty((len(fractions), count, 3))
        place_all(self.tables, way_of(motion), fractions, rotations, translations)
        return rotations, translations

    def way(self, motion: Motion, cells: int = 200) -> tuple[FloatArray, FloatArray]:
        """Fractions (k,), and how far the farthest moving point has gone by each (k,) [m]."""
        fractions = np.linspace(0.0, 1.0, cells + 1)
        rotations, translations = self.poses(motion, fractions)
        longest = np.zeros(cells)
        for link, vertices in enumerate(self._vertices):
            cloud = np.einsum("kij,vj->kvi", rotations[:, link], vertices)
            cloud += translations[:, None, link]
            steps = np.linalg.norm(np.diff(cloud, axis=0), axis=2).max(axis=1)
            longest = np.maximum(longest, steps)
        return fractions, np.concatenate([[0.0], np.cumsum(longest)])

    def samples(self, motion: Motion, step_m: float) -> FloatArray:
        """Fractions between which no point moves more than about ``step_m``."""
        fractions, way = self.way(motion)
        count = max(int(np.ceil(way[-1] / step_m)) + 1, 2)
        return np.asarray(np.interp(np.linspace(0.0, way[-1], count), way, fractions))


def way_of(motion: Motion) -> FloatArray:
    """Start and displacement as one array (2, n)."""
    return np.stack([motion.start, motion.displacement])


def _tables(machine: Machine) -> Tables:
    arm = machine.arm
    chain = arm.chain
    joints = np.zeros((chain.joints, ORIGIN + 36))
    lines = np.zeros((chain.joints, LINES))
    slides = []
    for j, joint in enumerate(arm.joints):
        lower, upper = arm.proven[joint.actuator]
        ends = joint.value(np.array([lower, upper]))
        slides.append((float(ends.min()), float(ends.max())))
        row = joints[j]
        row[PARENT], row[TURNS] = chain.parent[j], chain.revolute[j]
        row[ACTUATOR] = joint.actuator
        if isinstance(joint.drive, DirectDrive):
            row[SCALE] = joint.multiplier * joint.drive.scale
            row[OFFSET] = joint.multiplier * joint.drive.offset + joint.offset
        else:
            row[CURVED], row[FIRST], row[PER_STEP] = 1.0, lower, (LINES - 1) / (upper - lower)
            lines[j] = joint.value(np.linspace(lower, upper, LINES))
        x, y, z = chain.axis[j]
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        origin = chain.origin[j]
        turn, slide = origin[:3, :3] @ cross, origin[:3, :3] @ chain.axis[j]
        first, second = np.zeros((3, 4)), np.zeros((3, 4))
        if chain.revolute[j]:
            first[:, :3], second[:, :3] = turn, turn @ cross
        else:
            first[:, 3] = slide
        row[ORIGIN:] = np.concatenate([origin[:3].ravel(), first.ravel(), second.ravel()])
    points = [np.zeros((0, 3))] * chain.links
    for link, hull in zip(machine.links, machine.hulls, strict=True):
        points[link] = hull.vertices
    chosen = list(machine.links)
    frames = np.array(chain.link_frame, dtype=float)[chosen, None]
    origins = chain.link_origin[chosen][:, :3].reshape(len(chosen), 12)
    reach = motion_coefficients(chain, points, slides)[:, chosen]
    tables = Tables(joints, lines, np.hstack([frames, origins]), np.ascontiguousarray(reach))
    _check(machine, tables)
    return tables


def _check(machine: Machine, tables: Tables) -> None:
    """Hold the compiled poses against numpy's at a few postures."""
    rng = np.random.default_rng(0)
    kinematics = ForwardKinematics(machine.arm.chain)
    for _ in range(5):
        q = machine.draw(rng).start
        theta = np.array([[float(j.value(q[[j.actuator]])[0]) for j in machine.arm.joints]])
        right = kinematics.links(theta)[0, list(machine.links)]
        rotations, translations = np.empty((1, len(right), 3, 3)), np.empty((1, len(right), 3))
        way = np.stack([q, np.zeros_like(q)])
        place_all(tables, way, np.zeros(1), rotations, translations)
        worst = np.abs(
            np.concatenate([rotations[0], translations[0][..., None]], axis=2) - right[:, :3]
        )
        if worst.max() > 1e-6:
            raise AssertionError(f"compiled poses are {worst.max():.3g} off")
