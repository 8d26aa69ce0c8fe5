"""Compiled: coarse bounds of all pairs on one path, which leave few of them in doubt.

A link is held by its capsule and an object by a ball and a box. A link's swept box holds its
capsule all the way: it is the box round the capsules at the ends of the cells, grown by half of
what a cell can move. Zones whose boxes are clear of it are passed over, many at once through the
tree of zones. Of what is left, distances at the ends of each cell tell: between two samples a
distance is at least (d_a + d_b - motion)/2. Halfspaces are bounded by the capsule's lower end.
Only cells that these leave in doubt are walked.
"""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.bounding_tree import HALFSPACE
from rampe_guard.core.compiled import inlined
from rampe_guard.core.gjk import halfspace_normal
from rampe_guard.core.kernel_data import FAR, ArmTables, Records, Task
from rampe_guard.core.node_kernel import box_at, box_gap
from rampe_guard.core.path_kernel import capsule_distance, moved, pair_bounds
from rampe_guard.core.types import FloatArray


@inlined
def group_of(task: Task, p: int) -> int:
    """The group of a pair: its zone, or the one of all zones together."""
    return 0 if task.ask.together == 1 else task.pairs.row[p].zone


@inlined
def _look(task: Task, p: int) -> None:
    """Coarse bounds of one pair: it goes on the list, or only lowers the bounds of its group."""
    arm, S, pairs, zones, path, k, doubt, found, ask = task
    cells = k.cells
    h = path.end[0] / cells
    pair = pairs.row[p]
    z = pair.zone
    g = group_of(task, p)
    margin = zones[z].margin
    link = pair.link
    radius = arm.link[link].capsule[6]
    ball = S.node[pair.b].ball
    plane = S.node[pair.b].count == HALFSPACE
    still = pair.other < 0
    nx, ny, nz, floor = 0.0, 0.0, 0.0, 0.0
    ox, oy, oz = 0.0, 0.0, 0.0
    boxed, box = False, path.box_room
    if plane:
        nx, ny, nz, floor = halfspace_normal(S, S.node[pair.b].first, zones[z].pose)
    elif still:
        ox, oy, oz = moved(zones[z].pose, ball[0], ball[1], ball[2])
        boxed = S.node[pair.b].half[0] < FAR
        if boxed:
            box_at(zones[z].pose, S.node[pair.b], box)
            away = box_gap(path.swept[link, 0], box) - margin
            if away > ask.touch and ask.slack > FAR:
                _pass_over(found, g, p, away, away)
                return
    entry = doubt[k.doubts]
    least, before, start = np.inf, 0.0, 0.0
    for c in range(cells + 1):
        segment = path.segment[link, c]
        if plane:
            first = nx * segment[0] + ny * segment[1] + nz * segment[2]
            second = nx * segment[3] + ny * segment[4] + nz * segment[5]
            away = floor - max(first, second) - radius - margin
        else:
            if not still:
                ox, oy, oz = _link_center(arm, path.frames[c], pair.other, ball)
            away = capsule_distance(segment, radius, ox, oy, oz) - ball[3] - margin
            if boxed:
                away = max(away, _segment_gap(segment, box) - radius - margin)
        if c == 0:
            start = away
        else:
            rate, _, _ = pair_bounds(pair, path, c - 1)
            motion = rate * h
            low = max(0.5 * (before + away - motion), min(before, away) - motion)
            entry.cell[c - 1] = low
            least = min(least, low)
        before = away
    if least > ask.touch and ask.slack > FAR:
        _pass_over(found, g, p, least, start)
        return
    entry.pair = p
    entry.least = least
    entry.start = start
    k.doubts += 1


@inlined
def _pass_over(found: Records, g: int, p: int, least: float, start: float) -> None:
    """A pair that is clear all the way still bounds the distances of its group."""
    if least < found[g].bound:
        found[g].bound = least
        found[g].nearest = p
    found[g].now = min(found[g].now, start)


@inlined
def coarse(task: Task) -> None:
    """Fill in ``doubt``.

    If only the worst zone is wanted, zones that stand still are found through their tree.
    """
    _, _, pairs, zones, path, k, doubt, found, ask = task
    treed = ask.together == 1 and ask.slack > FAR and len(pairs.broad) > 0
    stack = k.stack
    k.doubts = 0
    if treed:
        for m in range(len(pairs.mover)):
            link = pairs.mover[m].link
            if pairs.mover[m].common != 0:
                continue
            stack[0] = 0
            top = 1
            while top > 0:
                top -= 1
                node = pairs.broad[stack[top]]
                away = box_gap(path.swept[link, 0], node.box)
                if away > ask.touch:
                    found[0].bound = min(found[0].bound, away)
                    found[0].now = min(found[0].now, away)
                elif node.zone < 0:
                    stack[top] = node.left
                    stack[top + 1] = node.right
                    top += 2
                elif zones[node.zone].active == 1 and pairs.of[node.zone, link] >= 0:
                    p = pairs.of[node.zone, link]
                    _look(task, p)
    count = len(pairs.loose) if treed else len(zones)
    for i in range(count):
        z = pairs.loose[i] if treed else i
        if zones[z].active == 1:
            for p in range(zones[z].first, zones[z].last):
                _look(task, p)
    _sort(doubt, k.doubts)


@inlined
def _sort(doubt: Records, count: int) -> None:
    """Fill in the order of the list, nearest first (Shell's sort)."""
    for i in range(count):
        doubt[i].order = i
    gap = count // 2
    while gap > 0:
        for i in range(gap, count):
            entry = doubt[i].order
            least = doubt[entry].least
            j = i
            while j >= gap and doubt[doubt[j - gap].order].least > least:
                doubt[j].order = doubt[j - gap].order
                j -= gap
            doubt[j].order = entry
        gap //= 2


@inlined
def _segment_gap(segment: FloatArray, box: FloatArray) -> float:
    """The same of the box round a segment (6,)."""
    square, least = 0.0, -np.inf
    for i in range(3):
        low, high = min(segment[i], segment[3 + i]), max(segment[i], segment[3 + i])
        apart = max(box[i] - high, low - box[3 + i])
        least = max(least, apart)
        if apart > 0.0:
            square += apart * apart
    return math.sqrt(square) if least > 0.0 else float(least)


@inlined
def _link_center(
    arm: ArmTables, frames: FloatArray, link: int, ball: FloatArray
) -> tuple[float, float, float]:
    """World center of a link's ball."""
    x, y, z = moved(arm.link[link].origin, ball[0], ball[1], ball[2])
    return moved(frames[arm.link[link].frame], x, y, z)
