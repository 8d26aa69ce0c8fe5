"""The tree of zones: finds those near a link among many without asking each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.bounding_tree import NONE
from rampe_guard.core.kernel_data import BROAD, Records, room

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray


def broad_tree(balls: FloatArray, zones: list[int]) -> Records:
    """Balls (k, 4) of so many zones, halved across their longest extent down to single ones."""
    nodes = room(BROAD, max(2 * len(zones) - 1, 0))
    todo = [(0, np.arange(len(zones)))] if zones else []
    used = 1
    while todo:
        number, items = todo.pop()
        node = nodes[number]
        node.ball = _round(balls[items])
        node.left = node.right = node.zone = NONE
        if len(items) == 1:
            node.zone = zones[items[0]]
            continue
        centers = balls[items, :3]
        axis = int(np.argmax(np.ptp(centers, axis=0)))
        items = items[np.argsort(centers[:, axis], kind="stable")]
        node.left, node.right = used, used + 1
        half = len(items) // 2
        todo += [(used, items[:half]), (used + 1, items[half:])]
        used += 2
    return nodes


def _round(balls: FloatArray) -> FloatArray:
    """A ball round balls (k, 4)."""
    if len(balls) == 1:
        return np.asarray(balls[0])
    low = (balls[:, :3] - balls[:, 3:]).min(axis=0)
    high = (balls[:, :3] + balls[:, 3:]).max(axis=0)
    center = 0.5 * (low + high)
    reach = np.linalg.norm(balls[:, :3] - center, axis=1) + balls[:, 3]
    return np.append(center, float(reach.max()) * (1.0 + 1e-12))
