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

from rampe_guard.core.bounding_tree import HALFSPACE
from rampe_guard.core.compiled import inlined
from rampe_guard.core.gjk import ROUNDING_M, distance, gap
from rampe_guard.core.kernel_data import STACK, ArmTables, Pairs, Path, Records, Shapes
from rampe_guard.core.path_kernel import (
    move_to,
    moved,
    pair_bounds,
    pair_fastest,
    place,
)
from rampe_guard.core.types import FloatArray

LOOSE, SHARP = 0.05, 1e-3
"""Shares of the distance to which it is wanted for nodes that can be cut, and for others."""
EXACT = 1e-6
"""The same where a distance is asked for itself."""
TOUCH_SHARE = 0.2
"""Share of ``touch`` to which a distance near contact must be known."""


@inlined
def shape_of(S: Shapes, node: int) -> tuple[int, int]:
    """First vertex and count of a node, triangles included."""
    if node >= S.nodes:
        return S.corner + 3 * (node - S.nodes), 3
    return S.node[node].first, S.node[node].count


@inlined
def radius_of(S: Shapes, node: int) -> float:
    """Rounding radius of a node [m]."""
    return 0.0 if node >= S.nodes else S.node[node].radius


@inlined
def can_split(S: Shapes, node: int) -> bool:
    """Whether a node is more than what it holds."""
    return node < S.nodes and (S.node[node].left >= 0 or S.node[node].triangle_count > 0)


@inlined
def size_of(S: Shapes, node: int) -> float:
    """About how far a node reaches beyond what it holds [m]; triangles are exact."""
    return 0.0 if node >= S.nodes else S.node[node].bulge


@inlined
def ball_gap(S: Shapes, a: int, pose_a: FloatArray, b: int, pose_b: FloatArray) -> float:
    """Lower bound of the distance of two nodes by the balls round them; -inf for triangles."""
    if a >= S.nodes or b >= S.nodes or S.node[b].count == HALFSPACE:
        return -np.inf
    p, q = S.node[a].ball, S.node[b].ball
    ax, ay, az = moved(pose_a, p[0], p[1], p[2])
    bx, by, bz = moved(pose_b, q[0], q[1], q[2])
    x, y, z = bx - ax, by - ay, bz - az
    return float(math.sqrt(x * x + y * y + z * z) - p[3] - q[3] - ROUNDING_M)


@inlined
def push_halves(
    S: Shapes,
    k: Records,
    top: int,
    a: int,
    b: int,
    s: float,
    n: tuple[float, float, float],
    bar: float,
    slot: int,
) -> int:
    """Put the pairs of halves of the looser node on the stack; those beyond ``bar`` are clear.

    ``bar`` is what must be proven plus all motion that is left, which is in ``k.far``.

    Returns:
        The new top, negative if the stack is full.
    """
    cut_a = can_split(S, a)
    if cut_a and can_split(S, b):
        cut_a = size_of(S, a) >= size_of(S, b)
    node = a if cut_a else b
    if S.node[node].left >= 0:
        first, count = -1, 2
    else:
        first, count = S.nodes + S.node[node].triangle_first, S.node[node].triangle_count
    if top + count > STACK:
        return -1
    before = top
    gaps = (0.0, 0.0)
    for i in range(count):
        half = (S.node[node].left if i == 0 else S.node[node].right) if first < 0 else first + i
        x, y = (half, b) if cut_a else (a, half)
        clear = ball_gap(S, x, k.pose_a[slot], y, k.pose_b[slot])
        if clear > bar:
            k.far[0] = min(k.far[0], clear - k.far[1])
            continue
        gaps = (clear, gaps[0])
        k.node[top, 0], k.node[top, 1] = x, y
        k.at[top, 0], k.at[top, 1], k.at[top, 2], k.at[top, 3] = s, n[0], n[1], n[2]
        top += 1
    if first < 0 and top - before == 2 and gaps[0] > gaps[1]:  # noqa: PLR2004
        for i in range(2):
            kept = k.node[top - 1, i]
            k.node[top - 1, i] = k.node[top - 2, i]
            k.node[top - 2, i] = kept
    return top


@inlined
def _first_direction(S: Shapes, pair: Records, k: Records, slot: int) -> None:
    """Put a first guess on the stack: the pair's last, or from center to center in a slot."""
    way = pair.way
    x, y, z = way[0], way[1], way[2]
    if slot >= 0 and S.node[pair.b].count != HALFSPACE:
        p, q = S.node[pair.a].ball, S.node[pair.b].ball
        ax, ay, az = moved(k.pose_a[slot], p[0], p[1], p[2])
        bx, by, bz = moved(k.pose_b[slot], q[0], q[1], q[2])
        x, y, z = bx - ax, by - ay, bz - az
    k.at[0, 1], k.at[0, 2], k.at[0, 3] = x, y, z


@inlined
def nearest(
    arm: ArmTables,
    S: Shapes,
    pairs: Pairs,
    frames: FloatArray,
    still: FloatArray,
    p: int,
    k: Records,
    limits: tuple[float, float, float],
) -> float:
    """Distance of a pair at one posture [m], to within ``slack``: never less than the truth.

    Args:
        arm, S, pairs: the problem.
        frames: of the arm at that posture.
        still: pose of the zone.
        p: pair.
        k: scratch.
        limits: (known, slack, enough): nothing farther than ``known`` is of interest, and the
            search ends at ``enough``.

    Returns:
        The distance of two points met, at most slack more than the least; ``known`` if none is
        nearer than that less slack; NaN if the budget is gone.
    """
    known, slack, enough = limits
    place(arm, frames, pairs.row[p], still, k.pose_a[0], k.pose_b[0], k.pose)
    k.node[0, 0], k.node[0, 1] = pairs.row[p].a, pairs.row[p].b
    _first_direction(S, pairs.row[p], k, -1 if k.again == 1 else 0)
    top = 1
    while top > 0:
        top -= 1
        a, b = k.node[top, 0], k.node[top, 1]
        n = (k.at[top, 1], k.at[top, 2], k.at[top, 3])
        if k.spent[0] >= k.spent[1]:
            return math.nan
        k.spent[0] += 1
        rounding = radius_of(S, a) + radius_of(S, b)
        leaf = not (can_split(S, a) or can_split(S, b))
        bar = known - slack
        k.far[1] = 0.0
        share = EXACT if leaf else LOOSE
        goal = (-np.inf if leaf else max(rounding, 0.0), bar + rounding, share)
        lower, upper, nx, ny, nz = distance(
            S, shape_of(S, a), k.pose_a[0], shape_of(S, b), k.pose_b[0], n, goal, k.work
        )
        if lower - rounding > bar:
            continue
        if not leaf:
            top = push_halves(S, k, top, a, b, 0.0, (nx, ny, nz), bar, 0)
            if top < 0:
                return math.nan
            continue
        upper = max(upper - rounding, 0.0)
        if upper < known:
            known = upper
            if known <= enough:
                break
    return known


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
    _first_direction(S, pairs.row[p], k, -1)
    way = pairs.row[p].way
    k.far[0] = np.inf
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
        known = math.nan  # gap along n at s
        while s < min(s1, found[g].stop):
            target = margin + max(touch, found[g].least - 0.5 * slack)
            if here != s:
                _pose_at(arm, pairs.row[p], path, still, k, s, slot)
                here = s
                if first and k.again == 0:
                    _first_direction(S, pairs.row[p], k, slot)
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
