"""Could any monotone way from start to end touch? Answered for all of them at once.

Every monotone way stays in the box between start and end in actuator space. If all links are
farther from a zone at the centre of a box than they can move within it, no way through that
box touches; else the box is split. A centre in contact lies on some monotone way: possible.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.convex import gaps, lower_support
from rampe_guard.core.sweep_limit import limit_clearance
from rampe_guard.core.sweep_path import valid_end
from rampe_guard.core.sweep_problem import Zone
from rampe_guard.core.sweep_rows import Budget, BudgetSpentError
from rampe_guard.core.types import AnyPath

if TYPE_CHECKING:
    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.sweep_problem import ClearanceOracle, SweepProblem
    from rampe_guard.core.types import FloatArray


def any_monotone_path(
    problem: SweepProblem,
    oracle: ClearanceOracle,
    config: SweepConfig,
    start: FloatArray,
    displacement: FloatArray,
    budget: Budget,
) -> AnyPath:
    """Free when proven for every monotone way, possible when one is shown, else unknown."""
    for zone in problem.zones:
        if not isinstance(zone, Zone):
            ends = start[zone.actuator], start[zone.actuator] + displacement[zone.actuator]
            if min(limit_clearance(zone, float(q)) for q in ends) <= 0.0:
                return AnyPath.POSSIBLE
    if valid_end(problem.arm, start, displacement) != 1.0:
        return AnyPath.UNKNOWN
    boxes = [(start, start + displacement)]
    try:
        while boxes:
            lower, upper = boxes.pop()
            worst = _box(problem, oracle, config, lower, upper, budget)
            if worst == CONTACT:
                return AnyPath.POSSIBLE
            if worst >= 0:
                middle = 0.5 * (lower[worst] + upper[worst])
                near, far = upper.copy(), lower.copy()
                near[worst] = far[worst] = middle
                boxes += [(far, upper), (lower, near)]
    except BudgetSpentError:
        return AnyPath.UNKNOWN
    return AnyPath.FREE


CONTACT = -2
CLEAR = -1


def _box(
    problem: SweepProblem,
    oracle: ClearanceOracle,
    config: SweepConfig,
    lower: FloatArray,
    upper: FloatArray,
    budget: Budget,
) -> int:
    """CLEAR, CONTACT, or the actuator along which the box should be split."""
    if problem.coarse is None:
        return CLEAR
    budget.spend()
    arm = problem.arm
    center = np.clip(0.5 * (lower + upper), arm.lower, arm.upper)
    corners = np.clip(np.stack([lower, center, upper]), arm.lower, arm.upper)
    theta = arm.joint_values(corners)
    half = np.maximum(np.abs(theta[1] - theta[0]), np.abs(theta[2] - theta[1]))
    shares = half[:, None] * arm.coefficients
    reach = shares.sum(axis=0)
    pose = arm.link_poses(corners[1:2])
    coarse = problem.coarse(pose[..., :3, :3], pose[..., :3, 3])[0]
    for index, table in enumerate(problem.rows):
        zone = problem.zones[index]
        if not isinstance(zone, Zone) or not len(table.body):
            continue
        near = zone.margin_m + config.tolerance_m
        bound = coarse[table.body, table.obstacle]
        doubtful = np.flatnonzero(bound <= near + reach[table.link])
        pairs = [(int(table.body[row]), int(table.obstacle[row])) for row in doubtful]
        cleared: set[int] = set()
        while pairs:
            body, obstacle = pairs.pop()
            link = problem.body_link[body]
            need = near + reach[link]
            if link in cleared:
                continue
            if _gap(problem, oracle, body, obstacle, pose[0, link], budget) > need:
                continue
            if problem.body_halves[body]:
                pairs += [(half, obstacle) for half in problem.body_halves[body]]
                continue
            budget.spend()
            distance = oracle.distance(link, index, pose[0, link]).distance_m
            if distance <= near:
                return CONTACT
            if distance <= need:
                split = np.zeros(len(lower))
                np.add.at(split, arm.actuator, shares[:, link])
                return int(np.argmax(split))
            cleared.add(link)
    return CLEAR


def _gap(
    problem: SweepProblem,
    oracle: ClearanceOracle,
    body: int,
    obstacle: int,
    pose: FloatArray,
    budget: Budget,
) -> float:
    budget.spend()
    n = oracle.direction(body, obstacle, pose, swapped=False)
    if n is None:
        return -np.inf
    low = lower_support(problem.obstacles[obstacle], n)
    rotation, translation = pose[None, :3, :3], pose[None, :3, 3]
    return float(gaps(problem.vertices[body], rotation, translation, n, low)[0])
