"""A straight motion in actuator space, measured: poses, and how far the points of links move.

The ways are measured on the real poses of a grid of samples, not taken from Jacobians, limits
of joints or anything else of the sweep's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.support.dense import DenseArm

GRID = 1024
COARSE = 8
"""Grid samples to a sample of the balls round links."""
SAFE = 1.02
"""Ways are taken that much longer than the chords between grid samples."""


class Motion:
    """A straight motion in actuator space, measured.

    Attributes:
        links: names of the links that have geometry.
        at: the grid's fractions (k + 1,).
        way: per link, the way of its points from the start to each grid sample [m].
        coarse: per link, centers (k / COARSE + 1, g, 3) of its balls [m].
    """

    def __init__(
        self, arm: DenseArm, start: FloatArray, displacement: FloatArray, grid: int = GRID
    ) -> None:
        self._arm, self._start, self._displacement = arm, start, displacement
        self.at = np.linspace(0.0, 1.0, grid + 1)
        self._grid = arm.poses(start + self.at[:, None] * displacement)
        self._poses: dict[tuple[str, float], FloatArray] = {}
        self.links = [name for name in arm.names if arm.bodies[name] is not None]
        self.way, self.coarse = {}, {}
        for name in self.links:
            steps = SAFE * arm.way(name, self._grid[name])
            self.way[name] = np.concatenate([[0.0], np.cumsum(steps)])
            pose = self._grid[name][::COARSE]
            centers = arm.body(name).centers @ pose[:, :3, :3].transpose(0, 2, 1)
            self.coarse[name] = centers + pose[:, None, :3, 3]

    def between(self, link: str, a: float, b: float) -> float:
        """At least the way of every point of a link from fraction a to b [m]."""
        way = np.interp([a, b], self.at, self.way[link])
        return float(abs(way[1] - way[0]))

    def moved(self, link: str, a: float, b: float) -> float:
        """Way of the farthest moving point of a link from fraction a to b [m]."""
        return self.between(link, a, b) / SAFE

    def farthest(self, link: str, direction: FloatArray, samples: slice) -> FloatArray:
        """How far a link extends towards a direction (3,) at some of the grid samples [m]."""
        pose, body = self._grid[link][samples], self._arm.body(link)
        local = direction @ pose[:, :3, :3]
        far = (local @ body.hull.T).max(axis=1) + body.reach
        return np.asarray(far + pose[:, :3, 3] @ direction)

    def pose(self, link: str, fraction: float) -> FloatArray:
        """World pose (4, 4) of a link."""
        key = link, fraction
        if key not in self._poses:
            q = self._start + fraction * self._displacement
            self._poses[key] = self._arm.pose(link, q)
        return self._poses[key]
