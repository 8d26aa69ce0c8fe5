"""Compiled: one path against all zones. Coarse bounds of all pairs, then walks, nearest first."""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.bounding_tree import HALFSPACE
from rampe_guard.core.coarse_kernel import coarse, group_of
from rampe_guard.core.compiled import compiled, inlined
from rampe_guard.core.inside_kernel import inside
from rampe_guard.core.kernel_data import FAR, ROUNDING_M, Task
from rampe_guard.core.near_kernel import EXACT, nearest
from rampe_guard.core.path_kernel import (
    cells_of,
    lay_path,
    move_to,
    moved,
    pair_bounds,
    place,
)
from rampe_guard.core.walk_kernel import walk

LADDER = (1.0, 1.0 / 30.0, 1.0 / 900.0)
"""How near counts as a contact, in shares of ``touch``, as long as it is not confirmed."""
NOISE_M = 1e-6
RIVALS = 4
"""Most pairs of one contact whose rates are tried."""


@inlined
def _walk_all(task: Task, begin: float, aim: tuple[float, float]) -> None:
    """Walk every doubtful pair (of group ``k.only`` if it is not negative) from a fraction on.

    ``aim`` is that of `walk`.
    """
    arm, S, pairs, zones, path, k, doubt, found, _ = task
    touch, slack = aim
    cells = k.cells
    h = path.end[0] / cells
    for i in range(k.doubts):
        d = doubt[i].order
        p = doubt[d].pair
        g = group_of(task, p)
        if (k.only >= 0 and g != k.only) or found[g].stop == 0.0:
            continue
        if slack < FAR and math.isnan(found[g].coarse):
            continue
        goal = max(touch, found[g].least - slack)
        first, last = -1, -1
        passed = np.inf
        for c in range(cells):
            if (c + 1) * h <= begin and c < cells - 1:
                continue
            if doubt[d].cell[c] <= goal:
                if first < 0:
                    first = c
                last = c
        for c in range(cells):
            if (first < 0 or c < first or c > last) and (c + 1) * h > begin:
                passed = min(passed, doubt[d].cell[c])
        if passed < found[g].bound:
            found[g].bound = passed
            if found[g].least >= FAR:
                found[g].nearest = p
        if first < 0:
            continue
        s0 = max(begin, first * h)
        s1 = path.end[0] if last == cells - 1 else (last + 1) * h
        if s0 >= found[g].stop:
            continue
        before = found[g].bound
        walk(arm, S, pairs, zones, path, k, found, p, g, (s0, s1), aim)
        if found[g].bound < before and found[g].least >= FAR:
            found[g].nearest = p


@inlined
def _seed(task: Task) -> None:
    """Meet small distances first: what is known not to be the least need not be walked sharply."""
    arm, S, pairs, zones, path, k, doubt, found, ask = task
    cells = k.cells
    for i in range(k.doubts):
        d = doubt[i].order
        p = doubt[d].pair
        z = pairs.row[p].zone
        g = group_of(task, p)
        if math.isnan(found[g].coarse):
            continue
        margin = zones[z].margin
        for c in range(0, cells + 1, 2):
            low = min(doubt[d].cell[max(c - 1, 0)], doubt[d].cell[min(c, cells - 1)])
            if low >= found[g].least - ask.slack:
                continue
            limits = (found[g].least + margin, ask.slack, margin)
            least = nearest(arm, S, pairs, path.frames[c], zones[z].pose, p, k, limits)
            if math.isnan(least):
                return
            if least - margin < found[g].least:
                found[g].least = max(least - margin, 0.0)
                found[g].nearest = p


@inlined
def _contained(task: Task) -> None:
    """Contact at the start for a side that begins wholly inside the other.

    Surfaces show nothing of that; later on the way it cannot come about without a contact.
    """
    arm, S, pairs, zones, path, k, doubt, found, _ = task
    for i in range(k.doubts):
        p = doubt[i].pair
        if pairs.row[p].hollow == 0 or doubt[i].start > 0.0:
            continue
        z = pairs.row[p].zone
        g = group_of(task, p)
        place(arm, path.frames[0], pairs.row[p], zones[z].pose, k.pose_a[0], k.pose_b[0], k.pose)
        a, b = pairs.row[p].a, pairs.row[p].b
        for side in range(2):
            own, other = (a, b) if side == 0 else (b, a)
            pose, frame = (k.pose_a[0], k.pose_b[0]) if side == 0 else (k.pose_b[0], k.pose_a[0])
            if S.node[own].count == HALFSPACE or S.node[other].count == HALFSPACE:
                continue
            for j in range(
                S.node[own].inner_first, S.node[own].inner_first + S.node[own].inner_count
            ):
                x, y, w = moved(pose, S.inner[j, 0], S.inner[j, 1], S.inner[j, 2])
                ux, uy, uz = x - frame[0, 3], y - frame[1, 3], w - frame[2, 3]
                lx = frame[0, 0] * ux + frame[1, 0] * uy + frame[2, 0] * uz
                ly = frame[0, 1] * ux + frame[1, 1] * uy + frame[2, 1] * uz
                lz = frame[0, 2] * ux + frame[1, 2] * uy + frame[2, 2] * uz
                if inside(S, other, lx, ly, lz, k.stack):
                    found[g].stop = 0.0
                    hit = found[g].hit
                    hit[0], hit[1], hit[2] = p, a, b
                    out = found[g].point
                    out[0], out[1], out[2] = moved(path.frames[0, pairs.row[p].common], x, y, w)


@inlined
def _zone_distance(task: Task, g: int, s: float, limits: tuple[float, float, float]) -> float:
    """Least distance less margin of a group's doubtful pairs at a fraction; see `nearest`."""
    arm, S, pairs, zones, path, k, doubt, found, _ = task
    known, slack, enough = limits
    for i in range(k.doubts):
        d = doubt[i].order
        p = doubt[d].pair
        z = pairs.row[p].zone
        if group_of(task, p) != g:
            continue
        if s == 0.0 and doubt[d].start >= known - slack:
            continue
        margin = zones[z].margin
        move_to(arm, path, s, pairs.row[p], 0, k.pose)
        least = nearest(
            arm,
            S,
            pairs,
            path.now[0],
            zones[z].pose,
            p,
            k,
            (known + margin, slack, enough + margin),
        )
        if math.isnan(least):
            return math.nan
        if least - margin < known:
            known = least - margin
            found[g].nearest = p
        if known <= enough:
            break
    return known


@inlined
def _start(task: Task, g: int) -> None:
    """Clearance at the start and whether it is closing, of a group whose walks are done.

    Inside the margin it is closing if any side that is inside comes nearer, or touches and does
    not come off; outside, if the nearest one comes nearer.
    """
    arm, S, pairs, zones, path, k, doubt, found, ask = task
    touched = found[g].stop == 0.0
    if touched or ask.sharp == 1:
        found[g].closing = 0
    best = 2.0 * ask.touch if touched else FAR
    least = FAR
    for i in range(k.doubts):
        d = doubt[i].order
        p = doubt[d].pair
        z = pairs.row[p].zone
        if group_of(task, p) != g:
            continue
        if not touched and ask.sharp == 0:
            found[g].now = min(found[g].now, doubt[d].start)
            continue
        if doubt[d].start >= best:
            continue
        margin = zones[z].margin
        before, after = 0.0, 0.0
        for look in range(2):
            move_to(arm, path, 0.0 if look == 0 else ask.probe, pairs.row[p], 0, k.pose)
            limits = ((best if look == 0 else FAR) + margin, 0.0, 0.0)
            away = nearest(arm, S, pairs, path.now[0], zones[z].pose, p, k, limits)
            if math.isnan(away):
                found[g].closing = 1  # the budget is gone: nothing shows the contrary
                if touched:
                    found[g].now = FAR
                else:
                    found[g].now = found[g].bound  # the start is a part of the way
                return
            if look == 0:
                before = away
                if before - margin >= best:
                    break
            else:
                after = away
        if before - margin >= best:
            continue
        approaching = after < before - NOISE_M or (touched and max(before, after) <= NOISE_M)
        least = min(least, before - margin)
        if not touched:
            best = least
            found[g].closing = 1 if approaching else 0
        elif approaching:
            found[g].closing = 1
    if touched:
        # where no surfaces are near, one side is inside the other
        margin = zones[pairs.row[found[g].hit[0]].zone].margin
        found[g].now = least if least < FAR else -margin
        return
    least -= EXACT * abs(least) + ROUNDING_M
    # that the start is clear is proven, by however little
    proven = found[g].bound if found[g].bound < FAR else NOISE_M * ask.touch
    found[g].now = max(min(found[g].now, least), proven)


@inlined
def _refute(task: Task, g: int) -> bool:
    """Look for group g's contact a little ahead; true if it is there, or can be no further."""
    _, _, pairs, _, path, k, _, found, ask = task
    s = found[g].stop
    if s == np.inf or s == 0.0:
        return True
    c = min(int(s * k.cells / path.end[0]), k.cells - 1)
    kept = found[g].nearest
    p = found[g].hit[0]
    settled = False
    for _ in range(RIVALS):
        rate, _, _ = pair_bounds(pairs.row[p], path, c)
        ahead = min(s + (ask.tolerance / rate if rate > 0.0 else np.inf), path.end[0])
        limits = (ask.touch, 0.0, 0.0)  # nothing farther matters
        there = _zone_distance(task, g, ahead, limits)
        if there > 0.0:
            break
        settled = True
        found[g].confirmed = math.nan if math.isnan(there) else ahead
        faster, _, _ = pair_bounds(pairs.row[found[g].nearest], path, c)
        if math.isnan(there) or faster <= rate:
            break
        # another, faster pair touches there: it must do so within its own tolerance
        p, settled = found[g].nearest, False
    found[g].nearest = kept
    return settled


@compiled
def search(task: Task) -> None:
    """Sweep the path that is set in ``path`` against all active zones; fills ``found``."""
    arm, S, pairs, _, path, k, _, found, ask = task
    groups = len(found)
    for g in range(groups):
        found[g].stop = np.inf
        found[g].least = FAR
        found[g].bound = FAR
        found[g].unproven = np.inf
        found[g].nearest = -1
        found[g].now = FAR
        found[g].closing = 1
        found[g].confirmed = math.nan
    k.spent[0], k.spent[1] = 0, ask.limit
    k.again = ask.again
    k.cells = cells_of(arm, path)
    lay_path(arm, S, pairs, path, k.cells)
    coarse(task)
    _contained(task)
    g, rung, begin = 0, 0, 0.0
    k.only = -1
    slack = 10.0 * FAR
    while True:  # all groups at first; then again each whose contact was refuted
        aim = (ask.touch * LADDER[rung], slack)
        _walk_all(task, begin, aim)
        if slack < FAR:
            break
        while g < groups:
            settled = _refute(task, g)
            if not settled and rung + 1 < len(LADDER):
                break
            g, rung = g + 1, 0
        if g >= groups and ask.slack > FAR:
            break
        if g >= groups:
            # certificates are settled; with what is left of the budget sharpen clearances
            k.only, begin, rung, slack = -1, 0.0, len(LADDER) - 1, ask.slack
            for i in range(groups):
                found[i].coarse = math.nan
                if found[i].stop == np.inf and found[i].unproven == np.inf:
                    found[i].coarse = found[i].bound
                    found[i].bound = FAR
            _seed(task)
            continue
        rung += 1
        k.only = g
        begin = found[g].stop
        found[g].stop = np.inf
        found[g].least = FAR
    for g in range(groups):
        if slack < FAR and not math.isnan(found[g].coarse):
            if found[g].unproven < np.inf:  # too dear: the proof of before still holds
                found[g].unproven = np.inf
                found[g].bound = found[g].coarse
            found[g].bound = max(found[g].bound, found[g].coarse)
        if ask.sharp == 1 or found[g].bound < FAR or found[g].stop == 0.0:
            _start(task, g)
