"""What a sweep is asked about: trees of links, trees of zones, and who may touch whom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.arm_tables import arm_tables
from rampe_guard.core.bounding_tree import NONE, BoundingTree, single
from rampe_guard.core.broad import broad_tree
from rampe_guard.core.kernel_data import (
    DOUBT,
    GROUP,
    MOVER,
    PAIR,
    SCRATCH,
    ZONE,
    Pairs,
    Records,
    empty_path,
    room,
    stack_trees,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.arm_motion import ArmMotion
    from rampe_guard.core.bounding_tree import Int32Array
    from rampe_guard.core.scene import ActuatorLimit
    from rampe_guard.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class Zone:
    """A solid keep-out object.

    Attributes:
        name: of the object.
        margin_m: keep-out distance [m].
        tree: its geometry, in the world, or in its own frame if it is ``placed``.
        ignored: indices of links that may touch it.
        placed: its pose comes with each sweep.
    """

    name: str
    margin_m: float
    tree: BoundingTree
    ignored: frozenset[int] = frozenset()
    placed: bool = False


@dataclass(frozen=True, slots=True)
class SelfZone:
    """A link that other links of the same arm must not touch.

    Attributes:
        name: of the zone.
        margin_m: distance to keep [m].
        link: index of that link.
        others: indices of the links that must not touch it.
    """

    name: str
    margin_m: float
    link: int
    others: tuple[int, ...]


class SweepProblem:
    """An arm and its zones in the flat form that the kernels work on, with room to work in.

    Attributes:
        arm: kinematics and motion bounds.
        link_names: of all links.
        zones: all of them, actuator limits too, in the order of the answers.
        solid: index into ``zones`` of each zone with geometry.
        tables, shapes, pairs: see `kernel_data`.
        fixed: ZONE records of all solid zones, before anything is placed.
        path, scratch, doubt: room of the kernels. found: their answers, about the worst of all
            zones (True) or about each of them (False).
    """

    def __init__(
        self,
        arm: ArmMotion,
        link_names: Sequence[str],
        links: Sequence[BoundingTree | None],
        zones: Sequence[Zone | SelfZone | ActuatorLimit],
    ) -> None:
        """``links``: one tree per link in its own frame, None without geometry."""
        self.arm = arm
        self.link_names = tuple(link_names)
        self.zones = tuple(zones)
        self.solid = [i for i, zone in enumerate(zones) if isinstance(zone, (Zone, SelfZone))]
        solid_links = [link for link, tree in enumerate(links) if tree is not None]
        trees = [tree for tree in links if tree is not None]
        objects = [zone for zone in zones if isinstance(zone, Zone)]
        trees += [zone.tree for zone in objects]
        self.shapes, roots = stack_trees(trees or [single(np.zeros((1, 3)))])
        link_roots = [NONE] * len(links)
        for link, root in zip(solid_links, roots, strict=False):
            link_roots[link] = root
        self.tables = arm_tables(arm, link_roots, [_capsule(tree) for tree in links])
        object_root = dict(
            zip((zone.name for zone in objects), roots[len(solid_links) :], strict=False)
        )
        enclosing = {
            root: bool(tree.enclosing.any()) for root, tree in zip(roots, trees, strict=False)
        }
        self.fixed = room(ZONE, len(self.solid))
        self.pairs = _pairs(self, links, object_root, enclosing)
        self.pair_link: list[int] = self.pairs.row.link.tolist()
        self.pair_zone: list[int] = self.pairs.row.zone.tolist()
        self.path = empty_path(len(arm.joints), len(links), len(self.pairs.mover), len(arm.lower))
        self.scratch = room(SCRATCH, 1)[0]
        self.doubt = room(DOUBT, len(self.pairs.row))
        self.found: dict[bool, Records] = {
            True: room(GROUP, 1),
            False: room(GROUP, len(self.solid)),
        }


def _pairs(  # noqa: C901 - one pass over zones and links
    problem: SweepProblem,
    links: Sequence[BoundingTree | None],
    object_root: dict[str, int],
    enclosing: dict[int, bool],
) -> Pairs:
    arm = problem.arm
    roots = problem.tables.link.root
    rows: list[tuple[int, int, int, int, int]] = []  # link, other, b, common, zone
    fixed = problem.fixed
    fixed.pose, fixed.active = np.eye(4)[:3], 1
    for number, index in enumerate(problem.solid):
        fixed.first[number] = len(rows)
        zone = problem.zones[index]
        if isinstance(zone, SelfZone):
            fixed.margin[number] = zone.margin_m
            for link in zone.others:
                if links[link] is not None and links[zone.link] is not None:
                    common = arm.common_frame(link, zone.link)
                    rows.append((link, zone.link, int(roots[zone.link]), common, number))
        elif isinstance(zone, Zone):
            fixed.margin[number] = zone.margin_m
            for link, tree in enumerate(links):
                if tree is not None and link not in zone.ignored:
                    rows.append((link, NONE, object_root[zone.name], 0, number))
        fixed.last[number] = len(rows)
    movers: dict[tuple[int, int], int] = {}
    for link, other, _, common, _ in rows:
        movers.setdefault((link, common), len(movers))
        if other != NONE:
            movers.setdefault((other, common), len(movers))
    order = sorted(movers)  # those of one link side by side
    movers = {mover: number for number, mover in enumerate(order)}
    row = room(PAIR, len(rows))
    for pair, (link, other, b, common, number) in zip(row, rows, strict=True):
        pair.link, pair.a, pair.other, pair.b = link, roots[link], other, b
        pair.common, pair.zone = common, number
        pair.mover = movers[link, common]
        pair.other_mover = NONE if other == NONE else movers[other, common]
        pair.hollow = enclosing[int(roots[link])] or enclosing[b]
    mover = room(MOVER, len(order))
    for one, (link, common) in zip(mover, order, strict=True):
        one.link, one.common = link, common
    of = np.full((len(fixed), len(links)), NONE, dtype=np.int32)
    for p, (link, _, _, _, number) in enumerate(rows):
        of[number, link] = p
    broad, loose = _broad(problem, of, row)
    return Pairs(row=row, mover=mover, broad=broad, loose=loose, of=of)


def _broad(problem: SweepProblem, of: Int32Array, row: Records) -> tuple[Records, Int32Array]:
    """The tree of all zones that stand still and have a box, and the rest."""
    still, loose, boxes = [], [], []
    for number, index in enumerate(problem.solid):
        zone = problem.zones[index]
        pairs = of[number][of[number] != NONE]
        if not len(pairs):
            continue
        node = problem.shapes.node[row.b[pairs[0]]]
        if isinstance(zone, Zone) and not zone.placed and np.isfinite(node.half).all():
            still.append(number)
            reach = node.half + zone.margin_m
            boxes.append([*(node.center - reach), *(node.center + reach)])
        else:
            loose.append(number)
    tree = broad_tree(np.array(boxes).reshape(-1, 6), still)
    return tree, np.array(loose, dtype=np.int32)


def _capsule(tree: BoundingTree | None) -> FloatArray:
    """Ends of a segment and a radius (7,) [m]; together they hold the root's shape."""
    if tree is None:
        return np.zeros(7)
    points = tree.vertices[tree.first[0] : tree.first[0] + tree.count[0]]
    center = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - center, full_matrices=True)
    best: tuple[float, FloatArray] | None = None
    for axis in (*np.eye(3), *axes):
        along = (points - center) @ axis
        wide = float(np.linalg.norm(points - center - along[:, None] * axis, axis=1).max())
        for share in (0.0, 0.5, 1.0):
            low = min(along.min() + share * wide, 0.5 * (along.min() + along.max()))
            high = max(along.max() - share * wide, low)
            nearest = np.clip(along, low, high)[:, None] * axis + center
            radius = float(np.linalg.norm(points - nearest, axis=1).max()) + tree.radius[0]
            volume = np.pi * radius**2 * (high - low + 4.0 / 3.0 * radius)
            if best is None or volume < best[0]:
                ends = center + np.array([[low], [high]]) * axis
                best = float(volume), np.append(ends.ravel(), radius * (1.0 + 1e-9))
    return np.zeros(7) if best is None else best[1]
