"""Compiled: conservative advancement of one pair of trees along a path.

Theorem. Let the links be rigid, the drives monotone (proven when the site is loaded, see
`drive_proof`) and every node of a tree contain all that is below it (`tree_build`, tested). Let n
be a unit direction and g(s) = gap(n) of two nodes at fraction s, a lower bound of their distance
(`gjk`). Between s and s + h, inside one cell of the path, no point of either side moves more than
rate·h, and none strays from the chord of its own way by more than
stray(h) = curvature·h²/8 + bend·h, rates of both sides added. Then for all s' in [s, s + h]

    g(s') >= g(s) - rate·(s' - s),                                                        (a)
    g(s') >= (1 - t)·g(s) + t·g(s + h) - stray(h),   t = (s' - s)/h.                      (b)

(a) is the motion bound; (b) holds since the support function of a set is convex in its points.
So a step over [s, s + h] is proven clear of ``target`` when (a) or (b) stays above it. Whatever
cannot be proven of a node is asked of its halves, down to single triangles, whose distance is
exact; what is left there within ``target`` is a contact.

The obstacles are closed sets; margins and growth add to ``target``, radii are taken off the gaps.
"""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.compiled import inlined
from rampe_guard.core.gjk import distance, gap
from rampe_guard.core.kernel_data import FAR, ArmTables, Pairs, Path, Records, Shapes
from rampe_guard.core.near_kernel import LOOSE
from rampe_guard.core.node_kernel import (
    box_at,
    box_gap,
    can_split,
    first_direction,
    push_halves,
    radius_of,
    shape_of,
    size_of,
    triangle_box,
)
from rampe_guard.core.path_kernel import (
    move_to,
    moved,
    pair_bounds,
    pair_fastest,
    place,
)
from rampe_guard.core.types import FloatArray

SHARP = 1e-3
"""Share of the distance to which it is wanted for nodes that cannot be cut."""
TOUCH_SHARE = 0.2
"""Share of ``touch`` to which a distance near contact must be known."""


@inlined
def _step(
    pair: Records,
    path: Path,
    c: int,
    rest: float,
    room: float,
) -> tuple[float, float, float]:
    """Linear step and a longer one to try, both at most ``rest``; and the longer one's stray."""
    rate, curvature, bend = pair_bounds(pair, path, c)
    linear = room / rate if rate > 0.0 else np.inf
    if linear >= rest:
        return rest, rest, 0.0
    root = math.sqrt(bend * bend + 0.25 * curvature * room)
    longer = room / (bend + root) if bend + root > 0.0 else np.inf
    longer = min(rest, max(longer, linear))
    return linear, longer, 0.125 * curvature * longer * longer + bend * longer


@inlined
def _pose_at(
    arm: ArmTables,
    pair: Records,
    path: Path,
    still: FloatArray,
    k: Records,
    s: float,
    slot: int,
) -> None:
    """Poses of both sides of a pair at a fraction, into a slot."""
    cell = path.end[0] / k.cells
    c = int(s / cell + 0.5)
    if pair.common == 0 and s == c * cell:  # the grid knows
        place(arm, path.frames[c], pair, still, k.pose_a[slot], k.pose_b[slot], k.pose)
        return
    move_to(arm, path, s, pair, slot, k.pose)
    place(arm, path.now[slot], pair, still, k.pose_a[slot], k.pose_b[slot], k.pose)


@inlined
def walk(
    arm: ArmTables,
    S: Shapes,
    pairs: Pairs,
    zones: Records,
    path: Path,
    k: Records,
    found: Records,
    p: int,
    g: int,
    span: tuple[float, float],
    aim: tuple[float, float],
) -> bool:
    """Prove pair p clear over a span of the path, or find its first contact before ``stop[g]``.

    Args:
        arm, S, pairs, zones, path, k: the problem, the path and room.
        found: outcome of the groups; g's is sharpened.
        p: pair. g: its group.
        span: fractions.
        aim: (touch, slack): a distance of margin + touch is a contact, and half of touch is
            proven up to there; distances are wanted to within slack, FAR if any proof will do.

    Returns:
        False if the budget ended first.
    """
    s0, s1 = span
    touch, slack = aim
    z = pairs.row[p].zone
    margin = zones[z].margin
    still = zones[z].pose
    cells = k.cells
    cell = path.end[0] / cells
    fastest = pair_fastest(pairs.row[p], path)
    k.node[0, 0], k.node[0, 1] = pairs.row[p].a, pairs.row[p].b
    k.at[0, 0] = s0
    first_direction(S, pairs.row[p], k, -1)
    way = pairs.row[p].way
    k.far[0] = np.inf
    boxed = pairs.row[p].other < 0 and S.node[pairs.row[p].b].half[0] < FAR
    top = 1
    first = True
    slot = 0  # of the poses here; the other is for those ahead
    here = -1.0  # fraction of the poses in the slot
    while top > 0:
        top -= 1
        a, b = k.node[top, 0], k.node[top, 1]
        s = k.at[top, 0]
        n = (k.at[top, 1], k.at[top, 2], k.at[top, 3])
        shape_a, shape_b = shape_of(S, a), shape_of(S, b)
        rounding = radius_of(S, a) + radius_of(S, b)
        leaf = not (can_split(S, a) or can_split(S, b))
        if boxed:
            # where the link still goes tells more than how far it could get
            if b >= S.nodes:
                triangle_box(S, still, shape_b[0], path.box_room)
            else:
                box_at(still, S.node[b], path.box_room)
            c = min(int(s / cell), cells - 1)
            clear = box_gap(path.swept[pairs.row[p].link, c], path.box_room) - margin
            if clear > max(touch, found[g].least - 0.5 * slack):
                found[g].bound = min(found[g].bound, clear)
                continue
        known = math.nan  # gap along n at s
        while s < min(s1, found[g].stop):
            target = margin + max(touch, found[g].least - 0.5 * slack)
            if here != s:
                _pose_at(arm, pairs.row[p], path, still, k, s, slot)
                here = s
                if first and k.again == 0:
                    first_direction(S, pairs.row[p], k, slot)
                    n = (k.at[0, 1], k.at[0, 2], k.at[0, 3])
            upper = np.inf
            lower = known
            if not lower - rounding > target:
                if k.spent[0] >= k.spent[1]:
                    found[g].unproven = min(found[g].unproven, s)
                    return False
                k.spent[0] += 1
                bar = target + rounding
                goal = (
                    -np.inf if leaf else bar,
                    bar + fastest * (s1 - s),
                    min(SHARP, TOUCH_SHARE * touch / bar) if leaf else LOOSE,
                )
                lower, upper, nx, ny, nz = distance(
                    S, shape_a, k.pose_a[slot], shape_b, k.pose_b[slot], n, goal, k.work
                )
                n = (nx, ny, nz)
                if first:
                    way[0], way[1], way[2] = nx, ny, nz
                    first = False
                if leaf and upper - rounding - margin < found[g].least:
                    found[g].least = upper - rounding - margin
                    found[g].nearest = p
                    target = margin + max(touch, found[g].least - 0.5 * slack)
            if not lower - rounding > target:
                if leaf:
                    if upper - rounding > margin + 2.0 * touch:
                        found[g].unproven = min(found[g].unproven, s)  # not converged
                        return False
                    found[g].stop = s
                    hit = found[g].hit
                    hit[0], hit[1], hit[2] = p, a, b
                    _contact_point(S, pairs.row[p], path.now[slot], b, n, k, found[g].point)
                    break
                k.far[1] = fastest * (min(s1, found[g].stop) - s)
                bar = target + k.far[1]
                top = push_halves(S, k, top, a, b, s, n, bar, slot)
                if top < 0:
                    found[g].unproven = min(found[g].unproven, s)
                    return False
                break
            # steps keep to a little less, so that each is worth something
            target = margin + max(0.5 * touch, found[g].least - slack)
            room = lower - rounding - target
            c = min(int(s / cell), cells - 1)
            if (c + 1) * cell <= s and c + 1 < cells:
                c += 1  # s is a cell's end, up to rounding
            edge = min((c + 1) * cell, s1, found[g].stop)
            if edge <= s:
                edge = min(s1, found[g].stop)
            rest = edge - s
            linear, longer, stray = _step(pairs.row[p], path, c, rest, room)
            if linear >= rest:
                rate, _, _ = pair_bounds(pairs.row[p], path, c)
                known = lower - rate * rest
                found[g].bound = min(found[g].bound, known - rounding - margin)
                s = edge
                continue
            there = 1 - slot
            beyond = edge if longer >= rest else s + longer
            _pose_at(arm, pairs.row[p], path, still, k, beyond, there)
            ahead = gap(S, shape_a, k.pose_a[there], shape_b, k.pose_b[there], n)
            sure = min(lower, ahead) - stray - rounding
            if sure >= target:
                found[g].bound = min(found[g].bound, sure - margin)
                s = beyond
                slot, here = there, s
                known = ahead if longer >= 0.5 * rest else math.nan
                continue
            step = linear
            if room > stray and ahead < lower:
                step = max(step, longer * (room - stray) / (lower - ahead))
            if upper == np.inf:  # the direction is an old one: look for a better
                known = math.nan
                continue
            if not leaf and size_of(S, a) + size_of(S, b) > room:
                k.far[1] = fastest * (min(s1, found[g].stop) - s)
                bar = target + k.far[1]
                top = push_halves(S, k, top, a, b, s, n, bar, slot)
                if top < 0:
                    found[g].unproven = min(found[g].unproven, s)
                    return False
                break
            if not s + step > s:  # no bound of the motion: nothing can be proven from here on
                found[g].unproven = min(found[g].unproven, s)
                return False
            found[g].bound = min(found[g].bound, target - margin)
            s += step
            known = math.nan
    found[g].bound = min(found[g].bound, k.far[0] - margin)
    return True


@inlined
def _contact_point(
    S: Shapes,
    pair: Records,
    frames: FloatArray,
    b: int,
    n: tuple[float, float, float],
    k: Records,
    out: FloatArray,
) -> None:
    """World point of the other side's surface that is touched, from the last `gjk.distance`."""
    r = radius_of(S, b)
    x = k.work[12, 0] - r * n[0]
    y = k.work[12, 1] - r * n[1]
    z = k.work[12, 2] - r * n[2]
    if pair.common == 0:  # the world's own frame
        out[0], out[1], out[2] = x, y, z
    else:
        out[0], out[1], out[2] = moved(frames[pair.common], x, y, z)
