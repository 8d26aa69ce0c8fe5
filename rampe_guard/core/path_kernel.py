"""Compiled: poses of one straight path on a grid, and how far links can move within its cells."""

from __future__ import annotations

import math

from rampe_guard.core.arm_kernel import (
    copy_pose,
    frames_of,
    joints_at,
    link_pose,
    motion_bounds,
    reaches,
    relative,
    slope_bounds,
)
from rampe_guard.core.compiled import inlined
from rampe_guard.core.kernel_data import CELLS, ArmTables, Pairs, Path, Records, Shapes
from rampe_guard.core.types import FloatArray

FINE_M = 0.12
"""Motion that a cell is worth [m]."""


@inlined
def moved(pose: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A point taken by a pose (3, 4)."""
    return (
        pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3],
        pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3],
        pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3],
    )


@inlined
def lay_path(arm: ArmTables, S: Shapes, pairs: Pairs, path: Path, cells: int) -> None:
    """Fill in everything that depends on start, displacement and end.

    Args:
        arm: tables.
        S: shapes.
        pairs: for its movers.
        path: way and end are set.
        cells: how many to cut the path into, at most CELLS.
    """
    joints = len(arm.joint)
    links = len(arm.link)
    scratch, pose = path.pose[0], path.pose[1]
    moves, reach = path.joint[0], path.joint[1]
    least, most, size = path.joint[2], path.joint[3], path.joint[4]
    h = path.end[0] / cells
    for m in range(len(path.fastest)):
        path.fastest[m] = 0.0
    for c in range(cells + 1):
        joints_at(arm, path.way, c * h, path.theta[c], joints)
        frames_of(arm, path.theta[c], path.frames[c], scratch, joints)
        for link in range(links):
            if arm.link[link].root < 0:
                continue
            link_pose(arm, path.frames[c], link, pose)
            for e in range(2):
                end = arm.link[link].capsule[3 * e : 3 * e + 3]
                x, y, z = moved(pose, end[0], end[1], end[2])
                at = path.segment[link, c, 3 * e : 3 * e + 3]
                at[0], at[1], at[2] = x, y, z
    for j in range(joints):
        size[j] = abs(path.way[1, arm.joint[j].actuator])
    for c in range(cells):
        for j in range(joints):
            i = arm.joint[j].actuator
            moves[j] = abs(path.theta[c + 1, j] - path.theta[c, j])
            least[j], most[j] = slope_bounds(
                arm,
                j,
                path.way[0, i] + c * h * path.way[1, i],
                path.way[0, i] + (c + 1) * h * path.way[1, i],
            )
        known = -1
        for m in range(len(pairs.mover)):
            link = pairs.mover[m].link
            if link != known:
                ball = S.node[arm.link[link].root].ball
                link_pose(arm, path.frames[c], link, pose)
                x, y, z = moved(pose, ball[0], ball[1], ball[2])
                reaches(arm, path.frames[c], link, (x, y, z, ball[3]), moves, reach)
                known = link
            rate, curvature, bend = motion_bounds(
                arm, link, pairs.mover[m].common, reach, least, most, size
            )
            bounds = path.bounds[m, c]
            bounds[0], bounds[1], bounds[2] = rate, curvature, bend
            path.fastest[m] = max(path.fastest[m], rate)
            if pairs.mover[m].common == 0:
                _hold(path, link, c, arm.link[link].capsule[6] + 0.5 * rate * h)
    for link in range(links):
        for c in range(cells - 2, -1, -1):
            box, later = path.swept[link, c], path.swept[link, c + 1]
            for i in range(3):
                box[i] = min(box[i], later[i])
                box[3 + i] = max(box[3 + i], later[3 + i])


@inlined
def _hold(path: Path, link: int, c: int, more: float) -> None:
    """Box round a link in one cell: its segment at both ends, grown by ``more`` [m]."""
    box = path.swept[link, c]
    for e in range(2):
        segment = path.segment[link, c + e]
        for i in range(3):
            low, high = min(segment[i], segment[3 + i]), max(segment[i], segment[3 + i])
            if e == 0:
                box[i], box[3 + i] = low - more, high + more
            else:
                box[i] = min(box[i], low - more)
                box[3 + i] = max(box[3 + i], high + more)


@inlined
def move_to(
    arm: ArmTables, path: Path, s: float, pair: Records, slot: int, scratch: FloatArray
) -> None:
    """Frames of the arm that carry a pair at fraction s, into ``path.now[slot]``."""
    upto = arm.link[pair.link].frame
    if pair.other >= 0:
        upto = max(upto, arm.link[pair.other].frame)
    joints_at(arm, path.way, s, path.now_theta, upto)
    frames_of(arm, path.now_theta, path.now[slot], scratch, upto)


@inlined
def cells_of(arm: ArmTables, path: Path) -> int:
    """How many cells a path is worth: about one for each FINE_M of its farthest motion."""
    longest = 0.0
    for link in range(len(arm.link)):
        motion = 0.0
        for j in range(len(arm.joint)):
            i = arm.joint[j].actuator
            motion += arm.reach[j, link] * arm.joint[j].steepest * abs(path.way[1, i])
        longest = max(longest, motion)
    return min(max(int(longest * path.end[0] / FINE_M), 1), CELLS)


@inlined
def place(
    arm: ArmTables,
    frames: FloatArray,
    pair: Records,
    still: FloatArray,
    pose_a: FloatArray,
    pose_b: FloatArray,
    scratch: FloatArray,
) -> None:
    """Poses of both sides of a pair in the frame that carries both.

    Args:
        arm: tables.
        frames: of the arm (J + 1, 3, 4).
        pair: the pair.
        still: world pose (3, 4) of the zone, for pairs whose other side is no link.
        pose_a, pose_b: results (3, 4).
        scratch: (3, 4).
    """
    common = pair.common
    if common == 0:
        link_pose(arm, frames, pair.link, pose_a)
        if pair.other < 0:
            copy_pose(still, pose_b)
        else:
            link_pose(arm, frames, pair.other, pose_b)
        return
    link_pose(arm, frames, pair.link, scratch)
    relative(frames[common], scratch, pose_a)
    link_pose(arm, frames, pair.other, scratch)
    relative(frames[common], scratch, pose_b)


@inlined
def pair_fastest(pair: Records, path: Path) -> float:
    """Largest rate of both sides of a pair together on the whole path [m]."""
    other = pair.other_mover
    return float(path.fastest[pair.mover] + (path.fastest[other] if other >= 0 else 0.0))


@inlined
def pair_bounds(pair: Records, path: Path, c: int) -> tuple[float, float, float]:
    """Rate, curvature and bend of both sides of a pair together in cell c."""
    one = path.bounds[pair.mover, c]
    rate, curvature, bend = one[0], one[1], one[2]
    if pair.other_mover >= 0:
        two = path.bounds[pair.other_mover, c]
        rate += two[0]
        curvature += two[1]
        bend += two[2]
    return rate, curvature, bend


@inlined
def capsule_distance(segment: FloatArray, radius: float, x: float, y: float, z: float) -> float:
    """Distance of a point from a capsule: segment (6,), radius; may be negative inside [m]."""
    ax, ay, az = segment[0], segment[1], segment[2]
    bx, by, bz = segment[3] - ax, segment[4] - ay, segment[5] - az
    px, py, pz = x - ax, y - ay, z - az
    square = bx * bx + by * by + bz * bz
    t = (px * bx + py * by + pz * bz) / square if square > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    px, py, pz = px - t * bx, py - t * by, pz - t * bz
    return math.sqrt(px * px + py * py + pz * pz) - radius
