"""Conservative advancement for peers that can tell a distance: the loop around it, compiled.

Nothing here proves anything by itself: a step is as right as the distance that it rests on.
First, balls that cover the links against boxes round the objects leave the pairs that could
touch at all, and from which fraction on. Then the pair that is certified least far is asked for
its distance, and goes on by the step in which it cannot use that up. So the first pair within
the tolerance is the first contact, and no pair is asked beyond it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.benchmarks.peers.jit import compiled, inlined
from tests.benchmarks.peers.posing import Posing, Tables, place, step, travel

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Piece, Solid, Work

CELLS = 8
MOST_BALLS = 8


class Cover(NamedTuple):
    """Bounding volumes, whatever the peer.

    Attributes:
        balls: link, center in its frame, radius (B, 5), link by link [m].
        boxes: of pieces: center, half sides, rotation, radius of a ball round it (P, 16) [m].
    """

    balls: FloatArray
    boxes: FloatArray


class Walk(NamedTuple):
    """State of one sweep, allocated once.

    Attributes:
        pairs: link and piece of each pair (P, 2).
        free: fraction up to which each is certified (P,); 2 = all the way.
        rotations, translations: of all links, the asked one's up to date (L, 3, 3), (L, 3).
        now: fraction and pair asked about, distance beyond which nothing matters (3,).
    """

    pairs: FloatArray
    free: FloatArray
    rotations: FloatArray
    translations: FloatArray
    now: FloatArray


@inlined
def _gap(boxes: FloatArray, p: int, x: float, y: float, z: float) -> float:
    """Distance of a point from box p, at most; negative inside."""
    dx, dy, dz = x - boxes[p, 0], y - boxes[p, 1], z - boxes[p, 2]
    total = 0.0
    for a in range(3):
        away = abs(boxes[p, 6 + a] * dx + boxes[p, 9 + a] * dy + boxes[p, 12 + a] * dz)
        away -= boxes[p, 3 + a]
        if away > 0.0:
            total += away * away
    round_it = math.sqrt(dx * dx + dy * dy + dz * dz) - boxes[p, 15]
    return float(max(math.sqrt(total), round_it))


@inlined
def _centers(
    tables: Tables, cover: Cover, way: FloatArray, walk: Walk, middle: float, out: FloatArray
) -> None:
    """Where the balls are at a fraction (B, 3) [m]."""
    place(tables, way, middle, walk.rotations, walk.translations)
    for b in range(len(cover.balls)):
        link = int(cover.balls[b, 0])
        for i in range(3):
            total = walk.translations[link, i]
            for j in range(3):
                total += walk.rotations[link, i, j] * cover.balls[b, 1 + j]
            out[b, i] = total


@inlined
def _reaches(
    tables: Tables,
    cover: Cover,
    way: FloatArray,
    middle: float,
    half: float,
    tolerance: float,
    out: FloatArray,
) -> None:
    """How near a box has to be to matter to each ball within ``half`` of a fraction (B,) [m].

    0 for a ball whose link stands still: starts are free.
    """
    slack, last = 0.0, -1
    for b in range(len(cover.balls)):
        link = int(cover.balls[b, 0])
        if link != last:
            last = link
            back = travel(tables, way, link, middle - half, middle)
            slack = max(back, travel(tables, way, link, middle, middle + half))
        out[b] = cover.balls[b, 4] + slack + tolerance if slack > 0.0 else 0.0


@inlined
def _free_until(boxes: FloatArray, p: int, centers: FloatArray, near: FloatArray, b: int) -> float:
    """First fraction at which ball b could come near box p; 2 = none.

    ``centers`` (CELLS + 1, B, 3) and how near is ``near`` (CELLS + 1, B) for each cell of the
    way, the last row for all of it.
    """
    x, y, z = centers[CELLS, b, 0], centers[CELLS, b, 1], centers[CELLS, b, 2]
    if _gap(boxes, p, x, y, z) > near[CELLS, b]:
        return 2.0
    for k in range(CELLS):
        x, y, z = centers[k, b, 0], centers[k, b, 1], centers[k, b, 2]
        if _gap(boxes, p, x, y, z) <= near[k, b]:
            return k / CELLS
    return 2.0


@inlined
def screen(tables: Tables, cover: Cover, way: FloatArray, walk: Walk, tolerance: float) -> int:
    """Pairs that could come within the tolerance, and from where on; how many they are."""
    balls, boxes = cover.balls, cover.boxes
    centers, near = np.empty((CELLS + 1, len(balls), 3)), np.empty((CELLS + 1, len(balls)))
    for k in range(CELLS + 1):
        cells = CELLS if k < CELLS else 1
        middle = (k % CELLS + 0.5) / cells
        _centers(tables, cover, way, walk, middle, centers[k])
        _reaches(tables, cover, way, middle, 0.5 / cells, tolerance, near[k])
    group = _groups(balls, centers[CELLS], near[CELLS])
    count = 0
    for p in range(len(boxes)):
        x, y, z, radius = boxes[p, 0], boxes[p, 1], boxes[p, 2], boxes[p, 15]
        for link in range(len(group)):
            dx, dy, dz = group[link, 0] - x, group[link, 1] - y, group[link, 2] - z
            around = group[link, 3] + radius
            if dx * dx + dy * dy + dz * dz > around * around:
                continue
            free = 2.0
            for b in range(int(group[link, 4]), int(group[link, 5])):
                if near[CELLS, b] > 0.0:
                    free = min(free, _free_until(boxes, p, centers, near, b))
            if free <= 1.0:
                walk.pairs[count, 0], walk.pairs[count, 1] = link, p
                walk.free[count] = free
                count += 1
    return count


@inlined
def _groups(balls: FloatArray, centers: FloatArray, near: FloatArray) -> FloatArray:
    """A ball round all balls of each link with what is near them; their first and end (L, 6)."""
    links = int(balls[len(balls) - 1, 0]) + 1
    group = np.zeros((links, 6))
    for b in range(len(balls)):
        link = int(balls[b, 0])
        if group[link, 5] == 0.0:
            group[link, 4] = b
        group[link, 5] = b + 1
        group[link, :3] += centers[b]
    for link in range(links):
        group[link, :3] /= group[link, 5] - group[link, 4]
        for b in range(int(group[link, 4]), int(group[link, 5])):
            dx, dy = centers[b, 0] - group[link, 0], centers[b, 1] - group[link, 1]
            dz = centers[b, 2] - group[link, 2]
            away = math.sqrt(dx * dx + dy * dy + dz * dz) + near[b]
            group[link, 3] = max(group[link, 3], away)
    return group


@inlined
def follow(tables: Tables, way: FloatArray, walk: Walk, count: int) -> int:
    """The pair that is certified least far, its link put there; -1 when all are free."""
    best, least = -1, 1.5
    for p in range(count):
        if walk.free[p] < least:
            best, least = p, walk.free[p]
    if best < 0:
        return -1
    if walk.now[0] != least:
        place(tables, way, least, walk.rotations, walk.translations)
    walk.now[0] = least
    walk.now[1] = travel(tables, way, int(walk.pairs[best, 0]), least, 1.0)
    return best


@compiled
def begin(tables: Tables, cover: Cover, way: FloatArray, walk: Walk, tolerance: float) -> int:
    """`screen`, then the place before the first pair."""
    walk.now[0] = -1.0
    return screen(tables, cover, way, walk, tolerance)


@compiled
def advance(
    tables: Tables, way: FloatArray, walk: Walk, count: int, pair: int, distance: float
) -> int:
    """Let a pair go on by the distance it was found to have; the pair to ask next, or -1."""
    if pair >= 0:
        link = int(walk.pairs[pair, 0])
        walk.free[pair] = step(tables, way, link, walk.free[pair], distance)
    return follow(tables, way, walk, count)


def new_walk(posing: Posing, cover: Cover) -> Walk:
    """Room for the state of one sweep."""
    links = len(posing.machine.links)
    most = links * len(cover.boxes)
    return Walk(
        pairs=np.zeros((most, 2)),
        free=np.zeros(most),
        rotations=np.zeros((links, 3, 3)),
        translations=np.zeros((links, 3)),
        now=np.zeros(2),
    )


def cover_of(work: Work) -> Cover:
    """Balls that cover the links' hulls, boxes that hold the pieces."""
    balls = [
        [float(link), *ball]
        for link, hull in enumerate(work.machine.hulls)
        for ball in _balls(hull)
    ]
    return Cover(np.array(balls), np.array([_box(piece) for piece in work.pieces]))


def _balls(hull: Solid) -> list[list[float]]:
    """Balls (center, radius) round the slices of the hull's principal box."""
    middle = hull.vertices.mean(axis=0)
    _, _, axes = np.linalg.svd(hull.vertices - middle, full_matrices=False)
    local = (hull.vertices - middle) @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    size = high - low
    longest = int(np.argmax(size))
    across = float(np.sort(size)[1])
    slices = int(np.clip(round(float(size[longest]) / max(across, 1e-6)), 1, MOST_BALLS))
    result = []
    for i in range(slices):
        a, b = low.copy(), high.copy()
        a[longest] = low[longest] + size[longest] * i / slices
        b[longest] = low[longest] + size[longest] * (i + 1) / slices
        center = middle + (0.5 * (a + b)) @ axes
        result.append([*center.tolist(), float(np.linalg.norm(b - a)) / 2])
    return result


def _box(piece: Piece) -> FloatArray:
    rotation, center = piece.pose[:3, :3], piece.pose[:3, 3]
    if piece.kind == "ball":
        half = np.full(3, float(piece.size[0]))
        return np.concatenate([center, half, rotation.ravel(), piece.size[:1]])
    low, high = piece.solid.vertices.min(axis=0), piece.solid.vertices.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    radius = np.linalg.norm(piece.solid.vertices - middle, axis=1).max()
    center = center + rotation @ middle
    return np.concatenate([center, half, rotation.ravel(), [radius]])
