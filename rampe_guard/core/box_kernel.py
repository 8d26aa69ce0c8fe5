"""Compiled: could any monotone way from start to end touch? Answered for all of them at once.

Theorem. Every monotone way stays in the box between start and end in actuator space. Drives are
monotone, so in a box round a center each joint stays within moves_j = max |Δθ_j| of its value
there, and no point of link l gets farther from where it is at the center than
Σ_j moves_j · reach_j. A pair that is farther apart at the center than that, plus its margin,
touches nowhere in the box. Along a direction n that separates the pair at the center one may also
count only motion along n, of first order, plus half of
Σ_j reach_j moves_j (moves_j + 2 Σ_i moves_i), i the turning joints before j, which bounds the
second order; the smaller of both counts.

Pairs that are clear in a box are clear in its halves, so halves are asked only about the rest. A
box is halved across the actuator that moves the undecided link most. A center in contact is a
configuration on some monotone way: the witness.
"""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.arm_kernel import frames_of, joint_value, link_pose, reaches
from rampe_guard.core.bounding_tree import HALFSPACE
from rampe_guard.core.compiled import compiled, inlined
from rampe_guard.core.gjk import distance
from rampe_guard.core.kernel_data import ArmTables, Pairs, Path, Records, Shapes
from rampe_guard.core.near_kernel import LOOSE
from rampe_guard.core.node_kernel import can_split, push_halves, radius_of, shape_of
from rampe_guard.core.path_kernel import moved, place
from rampe_guard.core.types import FloatArray

FREE, POSSIBLE, UNKNOWN = range(3)
BOXES = 1024
"""Boxes that may wait."""
SHARE = 1e-3


@inlined
def _travel(
    arm: ArmTables,
    frames: FloatArray,
    link: int,
    moves: FloatArray,
    reach: FloatArray,
    ball: tuple[float, float, float, float],
    n: tuple[float, float, float],
) -> float:
    """How far a link can move along n while each joint moves at most ``moves`` [m]."""
    first, second = 0.0, 0.0
    cx, cy, cz, radius = ball
    nx, ny, nz = n
    j = arm.link[link].frame - 1
    while j >= 0:
        frame = frames[j + 1]
        axis = arm.joint[j].axis
        ux = frame[0, 0] * axis[0] + frame[0, 1] * axis[1] + frame[0, 2] * axis[2]
        uy = frame[1, 0] * axis[0] + frame[1, 1] * axis[1] + frame[1, 2] * axis[2]
        uz = frame[2, 0] * axis[0] + frame[2, 1] * axis[1] + frame[2, 2] * axis[2]
        if arm.joint[j].revolute == 1:
            px, py, pz = cx - frame[0, 3], cy - frame[1, 3], cz - frame[2, 3]
            vx, vy, vz = uy * pz - uz * py, uz * px - ux * pz, ux * py - uy * px
            kx, ky, kz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
            across = math.sqrt(kx * kx + ky * ky + kz * kz)
            first += moves[j] * (abs(nx * vx + ny * vy + nz * vz) + radius * across)
            turning = moves[j]
        else:
            first += moves[j] * abs(nx * ux + ny * uy + nz * uz)
            turning = 0.0
        i = arm.joint[j].parent - 1
        while i >= 0:
            if arm.joint[i].revolute == 1:
                turning += 2.0 * moves[i]
            i = arm.joint[i].parent - 1
        second += 0.5 * reach[j] * moves[j] * turning
        j = arm.joint[j].parent - 1
    return first + second


@inlined
def _other_travel(
    arm: ArmTables,
    S: Shapes,
    pair: Records,
    frames: FloatArray,
    moves: FloatArray,
    reach: FloatArray,
    own: FloatArray,
    k: Records,
) -> float:
    """How far the second link of a self-collision pair can move [m]; ``reach`` gets both."""
    for j in range(len(moves)):
        own[j] = reach[j]
    ball = S.node[pair.b].ball
    link_pose(arm, frames, pair.other, k.pose)
    x, y, z = moved(k.pose, ball[0], ball[1], ball[2])
    reaches(arm, frames, pair.other, (x, y, z, ball[3]), moves, reach)
    travel = 0.0
    for j in range(len(moves)):
        travel += reach[j] * moves[j]
        reach[j] += own[j]
    return travel


@inlined
def _decide(
    arm: ArmTables,
    S: Shapes,
    pair: Records,
    zone: Records,
    frames: FloatArray,
    moves: FloatArray,
    reach: FloatArray,
    own: FloatArray,
    k: Records,
) -> tuple[int, float]:
    """Whether one pair is clear in a box (FREE), touches at its center (POSSIBLE), or neither.

    And for neither, how near it is to a contact there [m].
    """
    place(arm, frames, pair, zone.pose, k.pose_a[0], k.pose_b[0], k.pose)
    link = pair.link
    link_pose(arm, frames, link, k.pose)
    ball = S.node[pair.a].ball
    x, y, z = moved(k.pose, ball[0], ball[1], ball[2])
    center = (x, y, z, ball[3])
    reaches(arm, frames, link, center, moves, reach)
    travel = 0.0
    for j in range(len(moves)):
        travel += reach[j] * moves[j]
    if pair.other >= 0:
        other_travel = _other_travel(arm, S, pair, frames, moves, reach, own, k)
        travel += other_travel
    margin = zone.margin
    k.node[0, 0], k.node[0, 1] = pair.a, pair.b
    way = pair.way
    k.at[0, 1], k.at[0, 2], k.at[0, 3] = way[0], way[1], way[2]
    k.far[1] = 0.0
    top, first = 1, True
    verdict, near = FREE, np.inf
    if pair.other < 0 and S.node[pair.b].count != HALFSPACE:
        other = S.node[pair.b].ball
        ox, oy, oz = moved(k.pose_b[0], other[0], other[1], other[2])
        away = math.sqrt((x - ox) ** 2 + (y - oy) ** 2 + (z - oz) ** 2) - ball[3] - other[3]
        if away - margin > travel:
            return FREE, np.inf
    while top > 0:
        top -= 1
        a, b = k.node[top, 0], k.node[top, 1]
        n = (k.at[top, 1], k.at[top, 2], k.at[top, 3])
        if k.spent[0] >= k.spent[1]:
            return UNKNOWN, 0.0
        k.spent[0] += 1
        rounding = radius_of(S, a) + radius_of(S, b) + margin
        leaf = not (can_split(S, a) or can_split(S, b))
        goal = (-np.inf if leaf else rounding, rounding + travel, SHARE if leaf else LOOSE)
        lower, upper, nx, ny, nz = distance(
            S, shape_of(S, a), k.pose_a[0], shape_of(S, b), k.pose_b[0], n, goal, k.work
        )
        if first:
            way[0], way[1], way[2] = nx, ny, nz
            first = False
        room = lower - rounding
        if room > travel:
            continue
        if pair.other < 0 and room > 0.0:
            along = _travel(arm, frames, link, moves, reach, center, (nx, ny, nz))
            if room > along:
                continue
        if not leaf:
            top = push_halves(S, k, top, a, b, 0.0, (nx, ny, nz), travel + margin, 0)
            if top < 0:
                return UNKNOWN, 0.0
            continue
        if upper - rounding <= 0.0:
            return POSSIBLE, 0.0
        verdict = UNKNOWN  # go on: another part may touch at the center
        near = min(near, upper - rounding)
    return verdict, near


@compiled
def any_way(
    arm: ArmTables,
    S: Shapes,
    pairs: Pairs,
    zones: Records,
    path: Path,
    k: Records,
    box: FloatArray,
    pool: FloatArray,
    span: FloatArray,
    finest: float,
) -> int:
    """FREE for all monotone ways of ``path.way``, POSSIBLE with a witness, or UNKNOWN.

    Args:
        arm, S, pairs, zones: the problem.
        path: its way is set; ``path.now`` is used.
        k: scratch; ``spent`` is set.
        box: room for boxes (BOXES, 2, n); the witness is left in box[0, 0].
        pool: room for numbers of pairs (any length).
        span: room (BOXES, 3): first and count of each box's pairs in the pool, and how near a
            contact was at the center of the box that it is a half of.
        finest: boxes in which links move less than this are not halved again [m].
    """
    actuators = box.shape[2]
    joints = len(arm.joint)
    theta, moves, reach, own = path.joint[0], path.joint[1], path.joint[2], path.joint[3]
    share, here = path.share, path.box
    count = 0
    for z in range(len(zones)):
        if zones[z].active == 1:
            for p in range(zones[z].first, zones[z].last):
                pool[count] = p
                count += 1
    for i in range(actuators):
        a, b = path.way[0, i], path.way[0, i] + path.way[1, i]
        box[0, 0, i] = min(max(min(a, b), arm.limits[0, i]), arm.limits[1, i])
        box[0, 1, i] = min(max(max(a, b), arm.limits[0, i]), arm.limits[1, i])
    span[0, 0], span[0, 1], span[0, 2] = 0, count, 0.0
    top, used = 1, count
    verdict = FREE
    while top > 0:
        # the box that came nearest to a contact goes first: if there is one, it is soon found
        best = top - 1
        for m in range(top - 1):
            if span[m, 2] < span[best, 2]:
                best = m
        for side in range(2):
            for i in range(actuators):
                here[side, i] = box[best, side, i]
                box[best, side, i] = box[top - 1, side, i]
        first, many = int(span[best, 0]), int(span[best, 1])
        top -= 1
        for m in range(3):
            span[best, m] = span[top, m]
        for j in range(joints):
            i = arm.joint[j].actuator
            low, high = here[0, i], here[1, i]
            theta[j] = joint_value(arm, j, 0.5 * (low + high))
            moves[j] = max(
                abs(joint_value(arm, j, low) - theta[j]), abs(joint_value(arm, j, high) - theta[j])
            )
        frames_of(arm, theta, path.now[0], k.pose, joints)
        if used + many > len(pool) or top + 2 > len(box):
            return UNKNOWN
        left, widest, most, nearest = 0, -1, 0.0, np.inf
        for m in range(first, first + many):
            p = int(pool[m])
            found, near = _decide(
                arm, S, pairs.row[p], zones[pairs.row[p].zone], path.now[0], moves, reach, own, k
            )
            if found == POSSIBLE:
                for i in range(actuators):
                    box[0, 0, i] = 0.5 * (here[0, i] + here[1, i])
                return POSSIBLE
            if k.spent[0] >= k.spent[1]:
                return UNKNOWN
            if found == FREE:
                continue
            pool[used + left] = p
            left += 1
            nearest = min(nearest, near)
            total = 0.0
            for i in range(actuators):
                share[i] = 0.0
            for j in range(joints):
                total += reach[j] * moves[j]
                share[arm.joint[j].actuator] += reach[j] * moves[j]
            if total > most:
                most = total
                widest = 0
                for i in range(1, actuators):
                    if share[i] > share[widest]:
                        widest = i
        if left == 0:
            continue
        if most < finest:
            verdict = UNKNOWN  # so near that it cannot be told; a real contact is still looked for
            continue
        for side in range(2):
            for end in range(2):
                for i in range(actuators):
                    box[top + side, end, i] = here[end, i]
            box[top + side, 1 - side, widest] = 0.5 * (here[0, widest] + here[1, widest])
            span[top + side, 0], span[top + side, 1], span[top + side, 2] = used, left, nearest
        used += left
        top += 2
    return verdict
