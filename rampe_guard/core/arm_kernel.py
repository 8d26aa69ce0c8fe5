"""Compiled kinematics: drives, frames and motion bounds of one arm. See `kinematics`, `drive`."""

from __future__ import annotations

import math

from rampe_guard.core.compiled import inlined
from rampe_guard.core.kernel_data import ArmTables
from rampe_guard.core.types import FloatArray

DIRECT, CYLINDER_PIVOT, CYLINDER_SIDE, FOUR_BAR, TABLE = range(5)
LEVELS = 10
NARROW = 16.0
"""About so many intervals of the tables bound the slope over one cell of a path."""


@inlined
def angle(a: float, b: float, opposite: float) -> float:
    """Angle between sides a and b of a triangle; NaN if it cannot close."""
    double = 2.0 * a * b
    if double == 0.0:
        return math.nan
    cosine = (a * a + b * b - opposite * opposite) / double
    if not (-1.0 <= cosine <= 1.0):
        return math.nan
    return math.acos(cosine)


@inlined
def joint_value(arm: ArmTables, j: int, q: float) -> float:
    """θ of joint j at actuator value q; NaN where its linkage cannot close."""
    p = arm.joint[j].numbers
    kind = arm.joint[j].drive
    if kind == DIRECT:
        theta = p[3] + p[2] * q
    elif kind == CYLINDER_PIVOT:
        theta = p[5] + p[6] * angle(p[2], p[3], p[4] + q)
    elif kind == CYLINDER_SIDE:
        length = p[4] + q
        theta = p[5] + p[6] * (angle(p[2], length, p[3]) if length > 0.0 else math.nan)
    elif kind == FOUR_BAR:
        # 2 base, 3 rod, 4 length at zero, 5 rocker offset, 6 ground, 7 rocker, 8 coupler,
        # 9 follower, 10 angle offset, 11 direction
        h = p[5] - angle(p[2], p[3], p[4] + q)
        r = math.sqrt(p[6] * p[6] + p[7] * p[7] - 2.0 * p[6] * p[7] * math.cos(h))
        theta = p[10] + p[11] * (angle(p[6], r, p[7]) + angle(p[9], r, p[8]))
    else:
        first, last = int(p[2]), int(p[3]) - 1
        x = arm.table[0]
        if not (x[first] <= q <= x[last]):
            return math.nan
        i = first
        while i + 1 < last and x[i + 1] <= q:
            i += 1
        share = (q - x[i]) / (x[i + 1] - x[i])
        theta = arm.table[1, i] + share * (arm.table[1, i + 1] - arm.table[1, i])
    return float(p[0] * theta + p[1])


@inlined
def compose(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Out = a ∘ b, poses (3, 4)."""
    for i in range(3):
        a0, a1, a2 = a[i, 0], a[i, 1], a[i, 2]
        for k in range(4):
            out[i, k] = a0 * b[0, k] + a1 * b[1, k] + a2 * b[2, k]
        out[i, 3] += a[i, 3]


@inlined
def copy_pose(a: FloatArray, out: FloatArray) -> None:
    """Out = a, poses (3, 4)."""
    for i in range(3):
        for k in range(4):
            out[i, k] = a[i, k]


@inlined
def turn_joint(arm: ArmTables, j: int, theta: float, scratch: FloatArray) -> None:
    """Pose (3, 4) of joint j in its parent frame, into ``scratch``."""
    constant, sine, versine = arm.joint[j].constant, arm.joint[j].sine, arm.joint[j].versine
    if arm.joint[j].revolute == 1:
        s, c = math.sin(theta), 1.0 - math.cos(theta)
        for i in range(3):
            for k in range(4):
                scratch[i, k] = constant[i, k] + s * sine[i, k] + c * versine[i, k]
    else:
        for i in range(3):
            for k in range(4):
                scratch[i, k] = constant[i, k] + theta * sine[i, k]


@inlined
def frames_of(
    arm: ArmTables, theta: FloatArray, frames: FloatArray, scratch: FloatArray, upto: int
) -> None:
    """Poses (J + 1, 3, 4) of the frames up to one, the world first, for joint values (J,)."""
    for i in range(3):
        for k in range(4):
            frames[0, i, k] = 1.0 if i == k else 0.0
    for j in range(upto):
        turn_joint(arm, j, theta[j], scratch)
        compose(frames[arm.joint[j].parent], scratch, frames[j + 1])


@inlined
def joints_at(arm: ArmTables, way: FloatArray, s: float, theta: FloatArray, upto: int) -> None:
    """Values of the first ``upto`` joints at fraction s of a way (2, n), in the proven range."""
    for j in range(upto):
        i = arm.joint[j].actuator
        q = way[0, i] + s * way[1, i]
        q = min(max(q, arm.limits[0, i]), arm.limits[1, i])
        theta[j] = joint_value(arm, j, q)


@inlined
def link_pose(arm: ArmTables, frames: FloatArray, link: int, out: FloatArray) -> None:
    """World pose (3, 4) of a link from the frames."""
    compose(frames[arm.link[link].frame], arm.link[link].origin, out)


@inlined
def relative(frame: FloatArray, pose: FloatArray, out: FloatArray) -> None:
    """A world pose as seen from a frame: out = frame⁻¹ ∘ pose, poses (3, 4)."""
    x, y, z = pose[0, 3] - frame[0, 3], pose[1, 3] - frame[1, 3], pose[2, 3] - frame[2, 3]
    for i in range(3):
        f0, f1, f2 = frame[0, i], frame[1, i], frame[2, i]
        for k in range(3):
            out[i, k] = f0 * pose[0, k] + f1 * pose[1, k] + f2 * pose[2, k]
        out[i, 3] = f0 * x + f1 * y + f2 * z


@inlined
def slope_bounds(arm: ArmTables, j: int, qa: float, qb: float) -> tuple[float, float]:
    """Bounds of dθ/dq of joint j between two actuator values, from the dyadic tables."""
    if arm.joint[j].drive == DIRECT:
        return arm.slopes[0, j, 0, 0], arm.slopes[1, j, 0, 0]
    a = (qa - arm.joint[j].base) / arm.joint[j].span
    b = (qb - arm.joint[j].base) / arm.joint[j].span
    low, width = min(a, b), max(abs(b - a), 1e-12)
    # many narrow intervals together are sharper than a wide one
    level = min(max(int(math.floor(math.log2(NARROW / width))), 0), LEVELS - 1)
    size = 1 << level
    first = min(max(int(math.floor(low * size)), 0), size - 1)
    last = min(max(int(math.floor((low + width) * size)), first), size - 1)
    least, most = math.inf, -math.inf
    for index in range(first, last + 1):
        least = min(least, arm.slopes[0, j, level, index])
        most = max(most, arm.slopes[1, j, level, index])
    return least, most


@inlined
def reaches(
    arm: ArmTables,
    frames: FloatArray,
    link: int,
    ball: tuple[float, float, float, float],
    moves: FloatArray,
    out: FloatArray,
) -> None:
    """How far from each joint's axis a ball on a link can be while joints move (J,) [m].

    The axis of joint j does not move with j. Seen from there, the ball's center can come no
    farther out than it is now plus what the joints between them move it. Never more than the
    arm's reach R[j, l] at any posture. Sliding joints carry the link with them: 1.

    Args:
        arm: tables.
        frames: at one posture of the motion (J + 1, 3, 4).
        link: that carries the ball.
        ball: center in the world and radius [m].
        moves: |Δθ| each joint can be away from that posture (J,).
        out: zero for joints that do not carry the link.
    """
    for j in range(len(out)):
        out[j] = 0.0
    cx, cy, cz, radius = ball
    between = 0.0
    j = arm.link[link].frame - 1
    while j >= 0:
        frame = frames[j + 1]
        if arm.joint[j].revolute == 1:
            axis = arm.joint[j].axis
            ax, ay, az = axis[0], axis[1], axis[2]
            ux = frame[0, 0] * ax + frame[0, 1] * ay + frame[0, 2] * az
            uy = frame[1, 0] * ax + frame[1, 1] * ay + frame[1, 2] * az
            uz = frame[2, 0] * ax + frame[2, 1] * ay + frame[2, 2] * az
            px, py, pz = cx - frame[0, 3], cy - frame[1, 3], cz - frame[2, 3]
            kx, ky, kz = uy * pz - uz * py, uz * px - ux * pz, ux * py - uy * px
            away = math.sqrt(kx * kx + ky * ky + kz * kz) + radius + between
            out[j] = min(arm.reach[j, link], away)
        else:
            out[j] = 1.0
        between += out[j] * moves[j]
        j = arm.joint[j].parent - 1


@inlined
def motion_bounds(
    arm: ArmTables,
    link: int,
    common: int,
    reach: FloatArray,
    least: FloatArray,
    most: FloatArray,
    size: FloatArray,
) -> tuple[float, float, float]:
    """Rate, curvature and bend of a link's points as seen from a frame; see `walk_kernel`.

    Args:
        arm: tables.
        link: the link.
        common: frame that carries it; joints up to there do not count.
        reach: of `reaches` (J,).
        least, most: slopes dθ/dq of each joint (J,).
        size: |Δq| of each joint's actuator (J,).
    """
    rate, curvature, bend = 0.0, 0.0, 0.0
    j = arm.link[link].frame - 1
    while j >= 0 and j + 1 != common:
        if size[j] > 0.0:  # the slope of one that stands still may be infinite
            speed = max(abs(least[j]), abs(most[j])) * size[j]
            turning = speed if arm.joint[j].revolute == 1 else 0.0
            i = arm.joint[j].parent - 1
            while i >= 0 and i + 1 != common:
                if arm.joint[i].revolute == 1 and size[i] > 0.0:
                    turning += 2.0 * max(abs(least[i]), abs(most[i])) * size[i]
                i = arm.joint[i].parent - 1
            rate += speed * reach[j]
            curvature += speed * turning * reach[j]
            bend += (most[j] - least[j]) * size[j] * reach[j] * 0.25
        j = arm.joint[j].parent - 1
    return rate, curvature, bend
