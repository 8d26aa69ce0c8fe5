"""Other monotone ways to the same end: `any_path` held against dense search of some of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.types import AnyPath, Certificate
from tests.support.motion import Motion
from tests.support.obstacles import contained
from tests.support.search import ZoneTruth

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.types import FloatArray, SweepResult
    from tests.support.dense import DenseArm
    from tests.support.obstacles import Obstacle

WAYS = 2
LEG_GRID = 256
COMPLETE = 2.0
"""A witness must be within so many tolerances of a touch."""


@dataclass(frozen=True, slots=True)
class AnyVerdict:
    """What was found of one answer for all monotone ways.

    Attributes:
        answer: as the sweep gave it.
        fault: what is wrong with it, empty if nothing was found.
        witness_m: how far its witness is from a touch [m]; None without one.
    """

    answer: AnyPath | None
    fault: str = ""
    witness_m: float | None = None


def judge_any_path(
    arm: DenseArm,
    obstacles: Sequence[Obstacle],
    start: FloatArray,
    displacement: FloatArray,
    result: SweepResult,
    config: SweepConfig,
    rng: np.random.Generator,
) -> AnyVerdict:
    """Try to refute one answer: "free" by a way that touches, "possible" by its witness."""
    answer = result.any_path
    if answer is AnyPath.FREE:
        if result.certificate is not Certificate.FREE:
            return AnyVerdict(answer, f"any path free, but this one {result.certificate}")
        return AnyVerdict(answer, _touching_way(arm, obstacles, start, displacement, rng))
    witness = getattr(result, "witness", None)
    if answer is not AnyPath.POSSIBLE or witness is None:
        return AnyVerdict(answer)
    q = np.asarray(witness, dtype=float)
    low, high = np.minimum(start, start + displacement), np.maximum(start, start + displacement)
    if not ((q >= low - 1e-9) & (q <= high + 1e-9)).all():
        return AnyVerdict(answer, f"witness {q.tolist()} is on no monotone way")
    gap = _gap(arm, obstacles, q)
    far = gap > COMPLETE * config.tolerance_m
    return AnyVerdict(answer, f"witness {q.tolist()} is {gap:.6f} m off" if far else "", gap)


def staircase(
    start: FloatArray, displacement: FloatArray, rng: np.random.Generator
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Legs (start, displacement) of a random monotone way, one or two actuators at a time."""
    moving = np.flatnonzero(displacement)
    legs = [(int(i), share) for i in moving for share in _shares(rng)]
    order = rng.permutation(len(legs))
    q = start.copy()
    for group in np.array_split(order, max(len(order) - 1, 1)):
        leg = np.zeros(len(start))
        for k in group:
            actuator, share = legs[k]
            leg[actuator] += share * displacement[actuator]
        yield q.copy(), leg
        q += leg


def _shares(rng: np.random.Generator) -> list[float]:
    cut = float(rng.uniform(0.2, 0.8))
    return [cut, 1.0 - cut] if rng.random() < 0.5 else [1.0]


def _touching_way(
    arm: DenseArm,
    obstacles: Sequence[Obstacle],
    start: FloatArray,
    displacement: FloatArray,
    rng: np.random.Generator,
) -> str:
    for _ in range(WAYS):
        for q, leg in staircase(start, displacement, rng):
            motion = Motion(arm, q, leg, LEG_GRID)
            for obstacle in obstacles:
                margin = obstacle.item.margin_m
                found = ZoneTruth(arm, motion, obstacle).least(margin, enough=margin)
                if found.distance <= margin:
                    at = (q + found.fraction * leg).tolist()
                    return f"any path free, but {found.link} touches {obstacle.item.name} at {at}"
    return ""


def _gap(arm: DenseArm, obstacles: Sequence[Obstacle], q: FloatArray) -> float:
    """Least distance less margin over all links and obstacles [m], 0 if one holds the other."""
    gaps = [np.inf]
    for name in arm.names:
        body = arm.bodies[name]
        if body is None:
            continue
        pose = arm.pose(name, q)
        for obstacle in obstacles:
            if name not in obstacle.item.ignore_links:
                inside = contained(body, pose, obstacle)
                distance = 0.0 if inside else obstacle.distance(body, pose)[0]
                gaps.append(max(distance - obstacle.item.margin_m, 0.0))
    return float(min(gaps))
