"""The tree of zones: finds those near a link among many without asking each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.bounding_tree import NONE
from rampe_guard.core.kernel_data import BROAD, Records, room

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray


def broad_tree(boxes: FloatArray, zones: list[int]) -> Records:
    """Boxes (k, 6) of so many zones, halved across their longest extent down to single ones."""
    nodes = room(BROAD, max(2 * len(zones) - 1, 0))
    todo = [(0, np.arange(len(zones)))] if zones else []
    used = 1
    while todo:
        number, items = todo.pop()
        node = nodes[number]
        node.box[:3] = boxes[items, :3].min(axis=0)
        node.box[3:] = boxes[items, 3:].max(axis=0)
        node.left = node.right = node.zone = NONE
        if len(items) == 1:
            node.zone = zones[items[0]]
            continue
        centers = boxes[items, :3] + boxes[items, 3:]
        axis = int(np.argmax(np.ptp(centers, axis=0)))
        items = items[np.argsort(centers[:, axis], kind="stable")]
        node.left, node.right = used, used + 1
        half = len(items) // 2
        todo += [(used, items[:half]), (used + 1, items[half:])]
        used += 2
    return nodes
