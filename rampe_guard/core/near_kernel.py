"""Compiled: the distance of one pair of trees at one posture."""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.compiled import inlined
from rampe_guard.core.gjk import distance
from rampe_guard.core.kernel_data import ArmTables, Pairs, Records, Shapes
from rampe_guard.core.node_kernel import (
    can_split,
    first_direction,
    push_halves,
    radius_of,
    shape_of,
)
from rampe_guard.core.path_kernel import place
from rampe_guard.core.types import FloatArray

LOOSE = 0.05
"""Share of the distance to which it is wanted for nodes that can be cut."""
EXACT = 1e-6
"""The same where a distance is asked for itself."""


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
    first_direction(S, pairs.row[p], k, -1 if k.again == 1 else 0)
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
