"""Distance of two convex shapes whose every step proves a lower bound (Gilbert, Johnson, Keerthi).

Theorem. For a unit direction n, gap(n) = min over B of n·x - max over A of n·x is at most the
distance of A and B. Proof: for a in A, b in B, |b - a| >= n·(b - a) >= gap(n).

Each iteration of GJK asks the supports of both shapes along its present direction, so it yields
gap(n) for nothing. The best gap met is the answer's ``lower``; it needs no trust in the
iteration's convergence, only in two maxima over stored vertices. ``upper`` is the distance of two
points, one in each shape. Rounding: coordinates are below 1e5 m, so a gap is off by less than
1e-10 m; ROUNDING_M is taken off each.

Shapes are nodes of `kernel_data.Shapes` without their rounding radii, which callers subtract.
"""

from __future__ import annotations

import math

import numpy as np

from rampe_guard.core.bounding_tree import CYLINDER, HALFSPACE
from rampe_guard.core.compiled import inlined
from rampe_guard.core.kernel_data import ROUNDING_M, Shapes
from rampe_guard.core.types import FloatArray

ITERATIONS = 48
TINY = 1e-14
FACES = ((0, 1, 2, 3), (0, 1, 3, 2), (0, 2, 3, 1), (1, 2, 3, 0))
"""Corners of each face of a tetrahedron, and the one across."""


@inlined
def support(
    S: Shapes, first: int, count: int, pose: FloatArray, n: tuple[float, float, float], sign: float
) -> tuple[float, float, float, float]:
    """Farthest point along sign·n of a shape at a pose (3, 4): n·x, x, y, z."""
    nx, ny, nz = n
    lx = sign * (nx * pose[0, 0] + ny * pose[1, 0] + nz * pose[2, 0])
    ly = sign * (nx * pose[0, 1] + ny * pose[1, 1] + nz * pose[2, 1])
    lz = sign * (nx * pose[0, 2] + ny * pose[1, 2] + nz * pose[2, 2])
    X, Y, Z = S.xyz[0], S.xyz[1], S.xyz[2]
    if count == CYLINDER:
        # center, half axis, two radii across it: what is added to the axis is exactly across it
        along = lx * X[first + 1] + ly * Y[first + 1] + lz * Z[first + 1]
        one = lx * X[first + 2] + ly * Y[first + 2] + lz * Z[first + 2]
        two = lx * X[first + 3] + ly * Y[first + 3] + lz * Z[first + 3]
        across = math.sqrt(one * one + two * two)
        side = 1.0 if along >= 0.0 else -1.0
        one, two = (one / across, two / across) if across > 0.0 else (1.0, 0.0)
        vx = X[first] + side * X[first + 1] + one * X[first + 2] + two * X[first + 3]
        vy = Y[first] + side * Y[first + 1] + one * Y[first + 2] + two * Y[first + 3]
        vz = Z[first] + side * Z[first + 1] + one * Z[first + 2] + two * Z[first + 3]
    else:
        best = -np.inf
        at = first
        for i in range(first, first + count):
            value = lx * X[i] + ly * Y[i] + lz * Z[i]
            if value > best:
                best = value
                at = i
        vx, vy, vz = X[at], Y[at], Z[at]
    x = pose[0, 0] * vx + pose[0, 1] * vy + pose[0, 2] * vz + pose[0, 3]
    y = pose[1, 0] * vx + pose[1, 1] * vy + pose[1, 2] * vz + pose[1, 3]
    z = pose[2, 0] * vx + pose[2, 1] * vy + pose[2, 2] * vz + pose[2, 3]
    return nx * x + ny * y + nz * z, x, y, z


@inlined
def gap(
    S: Shapes,
    a: tuple[int, int],
    pose_a: FloatArray,
    b: tuple[int, int],
    pose_b: FloatArray,
    n: tuple[float, float, float],
) -> float:
    """The gap of two shapes (first, count) along n at their poses [m]; n points from a to b."""
    low, _, _, _ = support(S, b[0], b[1], pose_b, n, -1.0)
    high, _, _, _ = support(S, a[0], a[1], pose_a, n, 1.0)
    return low - high - ROUNDING_M


@inlined
def halfspace_normal(
    S: Shapes, first: int, pose_b: FloatArray
) -> tuple[float, float, float, float]:
    """Direction into a halfspace at its pose, and the least of that direction·x inside it."""
    nx, ny, nz = S.xyz[0, first], S.xyz[1, first], S.xyz[2, first]
    x = pose_b[0, 0] * nx + pose_b[0, 1] * ny + pose_b[0, 2] * nz
    y = pose_b[1, 0] * nx + pose_b[1, 1] * ny + pose_b[1, 2] * nz
    z = pose_b[2, 0] * nx + pose_b[2, 1] * ny + pose_b[2, 2] * nz
    offset = S.xyz[0, first + 1] + x * pose_b[0, 3] + y * pose_b[1, 3] + z * pose_b[2, 3]
    return -x, -y, -z, -offset


@inlined
def nearest_on_simplex(w: FloatArray, size: int, weight: FloatArray) -> int:
    """Weights (4,) of the point of a simplex w (size, 3) nearest to the origin.

    Returns:
        How many corners are needed; they are moved to the front. 4 = the origin is inside.
    """
    if size == 1:
        weight[0] = 1.0
        return 1
    if size == 2:  # noqa: PLR2004
        return _segment(w, weight)
    if size == 3:  # noqa: PLR2004
        i, j, k, _ = FACES[size - 3]
        weight[0], weight[1], weight[2] = triangle_weights(w, i, j, k)
        return 3
    return _tetrahedron(w, weight)


@inlined
def _segment(w: FloatArray, weight: FloatArray) -> int:
    x, y, z = w[1, 0] - w[0, 0], w[1, 1] - w[0, 1], w[1, 2] - w[0, 2]
    along = -(x * w[0, 0] + y * w[0, 1] + z * w[0, 2])
    square = x * x + y * y + z * z
    t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    weight[0], weight[1] = 1.0 - t, t
    return 2


@inlined
def triangle_weights(w: FloatArray, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Weights of the point of a triangle (rows i, j, k of w) nearest to the origin."""
    ax, ay, az = w[i, 0], w[i, 1], w[i, 2]
    bx, by, bz = w[j, 0] - ax, w[j, 1] - ay, w[j, 2] - az
    cx, cy, cz = w[k, 0] - ax, w[k, 1] - ay, w[k, 2] - az
    d1 = -(bx * ax + by * ay + bz * az)
    d2 = -(cx * ax + cy * ay + cz * az)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    px, py, pz = w[j, 0], w[j, 1], w[j, 2]
    d3 = -(bx * px + by * py + bz * pz)
    d4 = -(cx * px + cy * py + cz * pz)
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3) if d1 - d3 > 0.0 else 0.0
        return 1.0 - t, t, 0.0
    px, py, pz = w[k, 0], w[k, 1], w[k, 2]
    d5 = -(bx * px + by * py + bz * pz)
    d6 = -(cx * px + cy * py + cz * pz)
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6) if d2 - d6 > 0.0 else 0.0
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        whole = (d4 - d3) + (d5 - d6)
        t = (d4 - d3) / whole if whole > 0.0 else 0.0
        return 0.0, 1.0 - t, t
    total = va + vb + vc
    if total > 0.0:
        return va / total, vb / total, vc / total
    return 1.0, 0.0, 0.0


@inlined
def _outside(w: FloatArray, i: int, j: int, k: int, other: int) -> bool:
    """Whether the origin is not on the inner side of a face, or the tetrahedron is flat."""
    ax, ay, az = w[i, 0], w[i, 1], w[i, 2]
    bx, by, bz = w[j, 0] - ax, w[j, 1] - ay, w[j, 2] - az
    cx, cy, cz = w[k, 0] - ax, w[k, 1] - ay, w[k, 2] - az
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    inner = nx * (w[other, 0] - ax) + ny * (w[other, 1] - ay) + nz * (w[other, 2] - az)
    origin = -(nx * ax + ny * ay + nz * az)
    return bool(inner * origin <= 0.0)


@inlined
def _tetrahedron(w: FloatArray, weight: FloatArray) -> int:
    best = np.inf
    for face in range(4):
        i, j, k, other = FACES[face]
        if not _outside(w, i, j, k, other):
            continue
        u, v, t = triangle_weights(w, i, j, k)
        x = u * w[i, 0] + v * w[j, 0] + t * w[k, 0]
        y = u * w[i, 1] + v * w[j, 1] + t * w[k, 1]
        z = u * w[i, 2] + v * w[j, 2] + t * w[k, 2]
        square = x * x + y * y + z * z
        if square < best:
            best = square
            weight[i], weight[j], weight[k], weight[other] = u, v, t, 0.0
    return -1 if best == np.inf else 4


@inlined
def distance(
    S: Shapes,
    a: tuple[int, int],
    pose_a: FloatArray,
    b: tuple[int, int],
    pose_b: FloatArray,
    way: tuple[float, float, float],
    goal: tuple[float, float, float],
    work: FloatArray,
) -> tuple[float, float, float, float, float]:
    """Bounds of the distance of two shapes and the direction that proves the lower one.

    Args:
        S: all shapes.
        a, b: (first vertex, count) of each.
        pose_a, pose_b: (3, 4) each.
        way: first direction tried, from a to b; need not be unit.
        goal: (low, high, share): stop when upper <= low, lower >= high, or both are within
            ``share`` of upper.
        work: (16, 4) scratch; row 12 is left with the nearest point of b, row 13 with a's.

    Returns:
        lower [m], upper [m], n (unit, from a to b). Upper is 0 when they are seen to overlap.
    """
    low, high, share = goal
    if b[1] == HALFSPACE:
        nx, ny, nz, floor = halfspace_normal(S, b[0], pose_b)
        reach, x, y, z = support(S, a[0], a[1], pose_a, (nx, ny, nz), 1.0)
        d = floor - reach
        work[13, 0], work[13, 1], work[13, 2] = x, y, z
        work[12, 0], work[12, 1], work[12, 2] = x + d * nx, y + d * ny, z + d * nz
        return d - ROUNDING_M, max(d, 0.0), nx, ny, nz
    w = work[0:4]
    pb = work[4:8]
    pa = work[8:12]
    weight = work[14]
    dx, dy, dz = way
    norm = math.sqrt(dx * dx + dy * dy + dz * dz)
    if norm > TINY:
        dx, dy, dz = dx / norm, dy / norm, dz / norm
    else:
        dx, dy, dz = 1.0, 0.0, 0.0
    lower, upper = -np.inf, np.inf
    bx, by, bz = dx, dy, dz
    size = 0
    for _ in range(ITERATIONS):
        _, px, py, pz = support(S, b[0], b[1], pose_b, (dx, dy, dz), -1.0)
        _, qx, qy, qz = support(S, a[0], a[1], pose_a, (dx, dy, dz), 1.0)
        wx, wy, wz = px - qx, py - qy, pz - qz
        reach = dx * wx + dy * wy + dz * wz - ROUNDING_M
        if reach > lower:
            lower = reach
            bx, by, bz = dx, dy, dz
        if lower >= high or (size > 0 and upper - lower <= share * upper):
            break
        known = False
        for i in range(size):
            if w[i, 0] == wx and w[i, 1] == wy and w[i, 2] == wz:
                known = True
        if known:
            break
        w[size, 0], w[size, 1], w[size, 2] = wx, wy, wz
        pb[size, 0], pb[size, 1], pb[size, 2] = px, py, pz
        pa[size, 0], pa[size, 1], pa[size, 2] = qx, qy, qz
        size += 1
        used = nearest_on_simplex(w, size, weight)
        if used < 0:  # the origin is inside
            upper = 0.0
            for i in range(3):
                work[12, i] = px if i == 0 else (py if i == 1 else pz)
                work[13, i] = work[12, i]
            break
        kept = 0
        vx, vy, vz = 0.0, 0.0, 0.0
        ox, oy, oz = 0.0, 0.0, 0.0
        hx, hy, hz = 0.0, 0.0, 0.0
        for i in range(used):
            c = weight[i]
            if c > 0.0:
                vx += c * w[i, 0]
                vy += c * w[i, 1]
                vz += c * w[i, 2]
                ox += c * pb[i, 0]
                oy += c * pb[i, 1]
                oz += c * pb[i, 2]
                hx += c * pa[i, 0]
                hy += c * pa[i, 1]
                hz += c * pa[i, 2]
                for j in range(3):
                    w[kept, j] = w[i, j]
                    pb[kept, j] = pb[i, j]
                    pa[kept, j] = pa[i, j]
                kept += 1
        size = kept
        length = math.sqrt(vx * vx + vy * vy + vz * vz)
        if length >= upper:
            break  # no progress: rounding has the last word
        upper = length
        work[12, 0], work[12, 1], work[12, 2] = ox, oy, oz
        work[13, 0], work[13, 1], work[13, 2] = hx, hy, hz
        if upper <= low or length <= TINY:
            break
        dx, dy, dz = vx / length, vy / length, vz / length
    return lower, upper, bx, by, bz
