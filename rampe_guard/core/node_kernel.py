"""Compiled: single nodes of trees and pairs of them; what is farther than known is left out."""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.bounding_tree import HALFSPACE
from rampe_guard.core.compiled import inlined
from rampe_guard.core.kernel_data import ROUNDING_M, STACK, Records, Shapes
from rampe_guard.core.path_kernel import moved
from rampe_guard.core.types import FloatArray


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
def first_direction(S: Shapes, pair: Records, k: Records, slot: int) -> None:
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
def box_at(pose: FloatArray, node: Records, out: FloatArray) -> None:
    """World box (least, most) (6,) round a node at a pose (3, 4) [m]."""
    x, y, z = moved(pose, node.center[0], node.center[1], node.center[2])
    out[0], out[1], out[2] = x, y, z
    for i in range(3):
        half = 0.0
        for j in range(3):
            half += abs(pose[i, j]) * node.half[j]
        out[3 + i] = out[i] + half
        out[i] -= half


@inlined
def triangle_box(S: Shapes, pose: FloatArray, first: int, out: FloatArray) -> None:
    """World box (least, most) (6,) round a triangle, from its first vertex [m]."""
    for v in range(first, first + 3):
        x, y, z = moved(pose, S.xyz[0, v], S.xyz[1, v], S.xyz[2, v])
        at = (x, y, z)
        for i in range(3):
            out[i] = at[i] if v == first else min(out[i], at[i])
            out[3 + i] = at[i] if v == first else max(out[3 + i], at[i])


@inlined
def box_gap(a: FloatArray, b: FloatArray) -> float:
    """Lower bound of the distance of two boxes (least, most) (6,) [m]; negative if they overlap."""
    square, least = 0.0, -np.inf
    for i in range(3):
        apart = max(b[i] - a[3 + i], a[i] - b[3 + i])
        least = max(least, apart)
        if apart > 0.0:
            square += apart * apart
    return math.sqrt(square) if least > 0.0 else float(least)
