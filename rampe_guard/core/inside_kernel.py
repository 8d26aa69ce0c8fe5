"""Compiled: does a point lie inside a closed mesh? A ray's signed crossings are the winding number.

A ray that passes too near to an edge proves nothing: another direction is tried. If none will do
the point counts as inside, for what could not be computed is never free.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rampe_guard.core.compiled import inlined
from rampe_guard.core.kernel_data import Shapes
from rampe_guard.core.types import FloatArray

if TYPE_CHECKING:
    from rampe_guard.core.bounding_tree import Int32Array

RAYS = (
    (0.5773, 0.2113, 0.7887),
    (-0.3313, 0.8717, 0.3611),
    (0.1231, -0.4457, 0.8867),
    (-0.7071, -0.3491, -0.6149),
    (0.9341, -0.2971, 0.1979),
    (0.0417, 0.3593, -0.9323),
)
EDGE = 1e-9
"""Barycentric distance from an edge below which a crossing is not trusted."""


@inlined
def _crossing(
    S: Shapes, t: int, x: float, y: float, z: float, ray: tuple[float, float, float]
) -> int:
    """+1 or -1 if the ray leaves or enters through triangle t, 0 if not, 9 if unsure."""
    v = S.corner + 3 * t
    ax, ay, az = S.xyz[0, v], S.xyz[1, v], S.xyz[2, v]
    e1x, e1y, e1z = S.xyz[0, v + 1] - ax, S.xyz[1, v + 1] - ay, S.xyz[2, v + 1] - az
    e2x, e2y, e2z = S.xyz[0, v + 2] - ax, S.xyz[1, v + 2] - ay, S.xyz[2, v + 2] - az
    dx, dy, dz = ray[0], ray[1], ray[2]
    px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
    det = e1x * px + e1y * py + e1z * pz
    tx, ty, tz = x - ax, y - ay, z - az
    qx, qy, qz = ty * e1z - tz * e1y, tz * e1x - tx * e1z, tx * e1y - ty * e1x
    scale = math.sqrt((e1x * e1x + e1y * e1y + e1z * e1z) * (e2x * e2x + e2y * e2y + e2z * e2z))
    if abs(det) <= 1e-12 * scale:
        # seen edge-on: harmless unless the ray runs in its plane
        nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
        off = nx * tx + ny * ty + nz * tz
        return 9 if abs(off) <= 1e-9 * scale else 0
    u = (tx * px + ty * py + tz * pz) / det
    w = (dx * qx + dy * qy + dz * qz) / det
    if u < -EDGE or w < -EDGE or u + w > 1.0 + EDGE:
        return 0
    far = (e2x * qx + e2y * qy + e2z * qz) / det
    if far < -EDGE:
        return 0
    if u < EDGE or w < EDGE or u + w > 1.0 - EDGE or far < EDGE:
        return 9
    return 1 if det < 0.0 else -1


@inlined
def _meets(
    ball: FloatArray, x: float, y: float, z: float, ray: tuple[float, float, float], square: float
) -> bool:
    """Whether a ray can meet a ball."""
    px, py, pz = ball[0] - x, ball[1] - y, ball[2] - z
    along = px * ray[0] + py * ray[1] + pz * ray[2]
    apart = px * px + py * py + pz * pz
    r2 = ball[3] * ball[3] * (1.0 + 1e-9) + 1e-18
    if apart <= r2:
        return True
    if along <= 0.0:
        return False
    return bool(apart - along * along / square <= r2)


@inlined
def inside(S: Shapes, root: int, x: float, y: float, z: float, stack: Int32Array) -> bool:
    """Whether a point, in the tree's own frame, lies inside the closed parts of its surface.

    ``stack`` is room for numbers of nodes.
    """
    ball = S.node[root].ball
    px, py, pz = ball[0] - x, ball[1] - y, ball[2] - z
    if px * px + py * py + pz * pz > ball[3] * ball[3]:
        return False
    for k in range(len(RAYS)):
        ray = RAYS[k]
        square = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]
        crossings = 0
        unsure = False
        top = 1
        stack[0] = root
        while top > 0 and not unsure:
            top -= 1
            node = stack[top]
            if not _meets(S.node[node].ball, x, y, z, ray, square):
                continue
            if S.node[node].left >= 0:
                if top + 2 > len(stack):
                    unsure = True
                    break
                stack[top] = S.node[node].left
                stack[top + 1] = S.node[node].right
                top += 2
                continue
            begin = S.node[node].triangle_first
            for t in range(begin, begin + S.node[node].triangle_count):
                if S.enclosing[t] == 0.0:
                    continue
                found = _crossing(S, t, x, y, z, ray)
                if found == 9:  # noqa: PLR2004
                    unsure = True
                    break
                crossings += found
        if not unsure:
            return crossings != 0
    return True
