"""Any monotone way: the front of `box_kernel`, and actuator limits, which need no geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.box_kernel import BOXES, FREE, POSSIBLE, any_way
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.core.sweep_limit import limit_clearance
from rampe_guard.core.types import AnyPath, Certificate

if TYPE_CHECKING:
    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.kernel_data import Records
    from rampe_guard.core.sweep_problem import SweepProblem
    from rampe_guard.core.types import FloatArray, SweepResult

POOL = 1 << 17


class AnyWay:
    """Asks about all monotone ways in one problem; keeps the room for it."""

    def __init__(self, problem: SweepProblem, config: SweepConfig, touch_m: float) -> None:
        self._problem, self._config, self._touch_m = problem, config, touch_m
        self._box = np.zeros((BOXES, 2, len(problem.arm.lower)))
        self._pool = np.zeros(POOL + 8 * len(problem.pairs.row))
        self._span = np.zeros((BOXES, 3))

    def answer(
        self, zones: Records, result: SweepResult, start: FloatArray, displacement: FloatArray
    ) -> tuple[AnyPath, FloatArray | None]:
        """Free, possible with a configuration (n,) that touches, or unknown.

        Args:
            zones: as they are now.
            result: of the straight way.
            start: of all ways (n,).
            displacement: of all ways (n,).
        """
        touched = [z for z in result.zones if z.certificate is Certificate.CONTACT]
        if touched:
            first = min(touched, key=lambda z: z.contact_fraction or 0.0)
            at = first.confirmed_fraction
            return AnyPath.POSSIBLE, None if at is None else start + at * displacement
        for zone in self._problem.zones:
            if isinstance(zone, ActuatorLimit):
                for end in (start, start + displacement):
                    if limit_clearance(zone, float(end[zone.actuator])) <= 0.0:
                        return AnyPath.POSSIBLE, end.copy()
        if result.certificate is not Certificate.FREE:
            return AnyPath.UNKNOWN, None
        problem = self._problem
        problem.path.way[0], problem.path.way[1] = start, displacement
        problem.scratch.spent[:] = 0, self._config.max_queries
        verdict = any_way(
            problem.tables,
            problem.shapes,
            problem.pairs,
            zones,
            problem.path,
            problem.scratch,
            self._box,
            self._pool,
            self._span,
            self._touch_m,
        )
        if verdict == POSSIBLE:
            return AnyPath.POSSIBLE, self._box[0, 0].copy()
        return (AnyPath.FREE if verdict == FREE else AnyPath.UNKNOWN), None
