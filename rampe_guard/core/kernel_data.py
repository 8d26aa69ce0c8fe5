"""Arm, shapes and pairs as records and arrays: the form in which the compiled kernels read them.

Many fields in few arrays, for numba spends its time on arguments; named fields, for readers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from rampe_guard.core.bounding_tree import CYLINDER, HALFSPACE, NONE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.bounding_tree import BoundingTree, Int32Array
    from rampe_guard.core.types import FloatArray

Records: TypeAlias = Any
"""A record array of one of the types below, or one record of it."""

FAR = 1e30
"""Farther than anything: no bound is known, or any proof will do."""
ROUNDING_M = 1e-9
"""What is taken off each proven distance, and added to each box, for rounding [m]."""
CELLS = 8
"""Most cells of a path's grid."""
STACK = 1024

_POSE = (3, 4)
NODE = np.dtype(
    [
        ("first", "i4"),  # vertex, and how many; HALFSPACE, CYLINDER: see bounding_tree
        ("count", "i4"),
        ("left", "i4"),
        ("right", "i4"),
        ("triangle_first", "i4"),
        ("triangle_count", "i4"),
        ("inner_first", "i4"),  # of a root: points on its connected parts
        ("inner_count", "i4"),
        ("radius", "f8"),
        ("bulge", "f8"),
        ("ball", "f8", 4),
        ("center", "f8", 3),  # of a box round it, radius included
        ("half", "f8", 3),  # infinite for a halfspace
    ],
    align=True,
)
"""One node of a tree, see `bounding_tree`."""
JOINT = np.dtype(
    [
        ("parent", "i4"),  # frame that carries it
        ("actuator", "i4"),
        ("drive", "i4"),  # kind, see arm_kernel
        ("revolute", "i4"),
        ("axis", "f8", 3),
        # its pose in its parent is constant + sin θ · sine + (1 - cos θ) · versine when it
        # turns, constant + θ · sine when it slides
        ("constant", "f8", _POSE),
        ("sine", "f8", _POSE),
        ("versine", "f8", _POSE),
        ("numbers", "f8", 12),  # multiplier, offset, then those of the drive
        ("base", "f8"),  # of the dyadic tables of dθ/dq
        ("span", "f8"),
        ("steepest", "f8"),  # about the largest |dθ/dq|, for choosing cells only
    ],
    align=True,
)
LINK = np.dtype(
    [
        ("frame", "i4"),
        ("root", "i4"),  # node, NONE without geometry
        ("origin", "f8", _POSE),
        ("capsule", "f8", 7),  # ends of a segment and a radius that hold it, in its frame
    ],
    align=True,
)
PAIR = np.dtype(
    [
        ("link", "i4"),  # the moving side, and its root node
        ("a", "i4"),
        ("other", "i4"),  # second link of a self-collision pair, else NONE
        ("b", "i4"),
        ("common", "i4"),  # frame that carries both sides; 0 is the world
        ("mover", "i4"),  # of both sides; NONE for a side that stands still
        ("other_mover", "i4"),
        ("hollow", "i4"),  # one side may be wholly inside the other with surfaces apart
        ("zone", "i4"),
        ("way", "f8", 3),  # last separating direction, tried first by the next sweep
    ],
    align=True,
)
"""Two sides that must stay apart."""
MOVER = np.dtype([("link", "i4"), ("common", "i4")], align=True)
"""A link as seen from a frame that carries it: motion bounds are reckoned per mover."""
ZONE = np.dtype(
    [
        ("margin", "f8"),  # keep-out distance, growth included
        ("pose", "f8", _POSE),  # of its geometry in the world
        ("active", "i4"),  # asked about
        ("first", "i4"),  # its pairs are rows first … last - 1
        ("last", "i4"),
    ],
    align=True,
)
GROUP = np.dtype(
    [
        ("stop", "f8"),  # fraction of the earliest contact, infinite without one
        ("least", "f8"),  # least distance less margin met at any fraction
        ("bound", "f8"),  # proven lower bound of that, up to the contact
        ("unproven", "f8"),  # first fraction at which the budget was gone, else infinite
        ("now", "f8"),  # distance less margin at the start: a proven bound, or sharp inside
        ("coarse", "f8"),  # ``bound`` before clearances were sharpened
        ("confirmed", "f8"),  # fraction at which the contact was seen to be one, else NaN
        ("point", "f8", 3),  # of the contact, in the world
        ("hit", "i4", 3),  # pair and nodes of the contact
        ("nearest", "i4"),  # pair that came nearest
        ("closing", "i4"),
    ],
    align=True,
)
"""What is found out about one zone, or about all of them together."""
DOUBT = np.dtype(
    [
        ("pair", "i4"),
        ("order", "i4"),  # of entry i of the list: the i-th nearest entry
        ("least", "f8"),
        ("start", "f8"),
        ("cell", "f8", CELLS),
    ],
    align=True,
)
"""A pair that coarse bounds leave in doubt, with those bounds less margin [m]."""
SCRATCH = np.dtype(
    [
        ("node", "i4", (STACK, 2)),  # stack of node pairs
        ("at", "f8", (STACK, 4)),  # fraction and direction of each
        ("work", "f8", (16, 4)),  # of gjk.distance
        ("pose_a", "f8", (2, *_POSE)),  # of both sides: here, and a step ahead
        ("pose_b", "f8", (2, *_POSE)),
        ("pose", "f8", _POSE),
        ("far", "f8", 2),  # see walk_kernel.push_halves
        ("stack", "i4", STACK),  # of nodes, where one tree is walked
        ("spent", "i8", 2),  # queries so far, and their limit
        ("cells", "i8"),  # of the path's grid
        ("again", "i8"),  # 1: the pairs' last directions are worth a try
        ("doubts", "i8"),
        ("only", "i8"),  # group that is walked again; negative for all
    ],
    align=True,
)
"""Room to work in; nothing in it outlives a sweep."""


def room(dtype: np.dtype[Any], count: int) -> Records:
    """So many empty records."""
    return np.zeros(count, dtype=dtype).view(np.recarray)


class Shapes(NamedTuple):
    """The nodes of all trees, one after the other.

    Single triangles are nodes too, numbered from ``nodes`` on; they need no entry of their own:
    triangle t has the vertices ``corner + 3·t`` … + 2.

    Attributes:
        node: NODE records (N,).
        xyz: vertices (3, V) [m]: coordinate by coordinate, as supports are run over.
        enclosing: per triangle, 1 if it bounds an inside (T,).
        inner: points on the connected parts of all trees (I, 3) [m].
        nodes: N. corner: vertex at which the triangles' corners begin.
    """

    node: Records
    xyz: FloatArray
    enclosing: FloatArray
    inner: FloatArray
    nodes: int
    corner: int


class ArmTables(NamedTuple):
    """Chain, drives and motion bounds of `arm_motion.ArmMotion`.

    Attributes:
        joint, link: records (J,), (L,).
        reach: R[j, l] of `kinematics.motion_coefficients` (J, L).
        slopes: dyadic tables of dθ/dq, least and most (2, J, levels, intervals).
        table: points of all table drives, q and θ (2, T).
        limits: where the drives are proven (2, n).
    """

    joint: Records
    link: Records
    reach: FloatArray
    slopes: FloatArray
    table: FloatArray
    limits: FloatArray


BROAD = np.dtype(
    [("left", "i4"), ("right", "i4"), ("zone", "i4"), ("box", "f8", 6)],
    align=True,
)
"""A node of the tree of zones: a box (least, most) round its zones, margins included; zone NONE:
not a leaf."""


class Pairs(NamedTuple):
    """Who must stay apart.

    Attributes:
        row: PAIR records (P,), those of one zone side by side.
        mover: MOVER records (M,).
        broad: BROAD records of zones that stand still, node 0 the root; may be empty.
        loose: zones that are not in that tree (k,).
        of: pair of each zone and link, or NONE (Z, L).
    """

    row: Records
    mover: Records
    broad: Records
    loose: Int32Array
    of: Int32Array


class Path(NamedTuple):
    """One path and what is known of it; the next sweep overwrites it.

    Attributes:
        way: start and displacement (2, n).
        end: fractions beyond are not looked at (1,).
        theta: joint values at the grid (K + 1, J).
        frames: poses of the frames at the grid (K + 1, J + 1, 3, 4).
        segment: ends of each link's capsule in the world at the grid (L, K + 1, 6) [m].
        swept: box (least, most) round each link's capsule from a cell on to the end
            (L, K, 6) [m].
        bounds: rate, curvature, bend per mover and cell (M, K, 3) [m], see `walk_kernel`.
        fastest: largest rate of each mover (M,) [m].
        now: frames at two fractions (2, J + 1, 3, 4).
        now_theta: its joint values (J,).
        joint: room for numbers per joint (6, J).
        share: room for numbers per actuator (n,).
        box: room for two corners (2, n).
        pose: room for poses (2, 3, 4).
        box_room: room for a box (6,).
    """

    way: FloatArray
    end: FloatArray
    theta: FloatArray
    frames: FloatArray
    segment: FloatArray
    swept: FloatArray
    bounds: FloatArray
    fastest: FloatArray
    now: FloatArray
    now_theta: FloatArray
    joint: FloatArray
    share: FloatArray
    box: FloatArray
    pose: FloatArray
    box_room: FloatArray


def empty_path(joints: int, links: int, movers: int, actuators: int) -> Path:
    """Room for the paths of one arm."""
    return Path(
        way=np.zeros((2, actuators)),
        end=np.ones(1),
        theta=np.zeros((CELLS + 1, joints)),
        frames=np.zeros((CELLS + 1, joints + 1, 3, 4)),
        segment=np.zeros((links, CELLS + 1, 6)),
        swept=np.zeros((links, CELLS, 6)),
        bounds=np.zeros((movers, CELLS, 3)),
        fastest=np.zeros(movers),
        now=np.zeros((2, joints + 1, 3, 4)),
        now_theta=np.zeros(joints),
        joint=np.zeros((6, joints)),
        share=np.zeros(actuators),
        box=np.zeros((2, actuators)),
        pose=np.zeros((2, 3, 4)),
        box_room=np.zeros(6),
    )


class Ask(NamedTuple):
    """What a sweep is asked.

    Attributes:
        tolerance: of a contact, in motion [m].
        touch: a distance that counts as contact until it is refuted [m].
        slack: to which distances are wanted [m]; more than FAR if any proof will do.
        probe: fraction of the small first step that tells closing from opening.
        limit: most queries.
        together: 1 if only the worst of all zones is wanted.
        sharp: 1 if the clearance at the start is wanted too.
        again: 1 if the last sweep began near here, so that its directions are worth a try.
    """

    tolerance: float
    touch: float
    slack: float
    probe: float
    limit: int
    together: int
    sharp: int
    again: int


class Task(NamedTuple):
    """One sweep: the problem, its path, room to work in, and where the answers go.

    Attributes:
        arm, S, pairs: see `kernel_data`.
        zones: ZONE records. path: the way is set, the rest is laid out by `search`.
        k: one SCRATCH record. doubt: DOUBT records. found: GROUP records, the answers.
        ask: what is wanted.
    """

    arm: ArmTables
    S: Shapes
    pairs: Pairs
    zones: Records
    path: Path
    k: Records
    doubt: Records
    found: Records
    ask: Ask


def boxes_of(tree: BoundingTree) -> tuple[FloatArray, FloatArray]:
    """Centers and half sizes (N, 3) of boxes round all nodes of a tree [m]."""
    if tree.count[0] == HALFSPACE:
        return np.zeros((1, 3)), np.full((1, 3), np.inf)
    if tree.count[0] == CYLINDER:
        center, axis, one, two = tree.vertices[:4]
        return center[None], (np.abs(axis) + np.hypot(one, two) + ROUNDING_M)[None]
    ends = np.stack([tree.first, tree.first + tree.count], axis=1).ravel()
    points = np.concatenate([tree.vertices, tree.vertices[-1:]])
    low, high = np.minimum.reduceat(points, ends)[::2], np.maximum.reduceat(points, ends)[::2]
    return 0.5 * (low + high), 0.5 * (high - low) + tree.radius[:, None] + ROUNDING_M


def stack_trees(trees: Sequence[BoundingTree]) -> tuple[Shapes, list[int]]:
    """All trees in one, and the number of each one's root."""
    nodes = np.cumsum([0, *(tree.nodes for tree in trees)])
    vertices = np.cumsum([0, *(len(tree.vertices) for tree in trees)])
    triangles = np.cumsum([0, *(len(tree.corners) for tree in trees)])
    inner = np.cumsum([0, *(len(tree.inner) for tree in trees)])
    record = room(NODE, int(nodes[-1]))
    for number, tree in enumerate(trees):
        own = record[nodes[number] : nodes[number + 1]]
        own.first = tree.first + vertices[number]
        own.count = tree.count
        own.left = np.where(tree.left == NONE, NONE, tree.left + nodes[number])
        own.right = np.where(tree.right == NONE, NONE, tree.right + nodes[number])
        own.triangle_first = tree.triangle_first + triangles[number]
        own.triangle_count = tree.triangle_count
        own.radius, own.bulge, own.ball = tree.radius, tree.size, tree.ball
        own.center, own.half = boxes_of(tree)
        own.inner_first[0] = inner[number]
        own.inner_count[0] = len(tree.inner)
    points = [tree.vertices for tree in trees] + [tree.corners.reshape(-1, 3) for tree in trees]
    shapes = Shapes(
        node=record,
        xyz=np.ascontiguousarray(np.concatenate(points).T),
        enclosing=np.concatenate([tree.enclosing for tree in trees]).astype(float),
        inner=np.concatenate([tree.inner for tree in trees]),
        nodes=int(nodes[-1]),
        corner=int(vertices[-1]),
    )
    return shapes, [int(n) for n in nodes[:-1]]
