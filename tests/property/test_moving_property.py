"""Whatever order, delay or clock: the growth of an object covers where it truly is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.config import InputConfig
from rampe_guard.core.moving import MovingObjects
from rampe_guard.core.types import ActuatorSample, Inputs
from tests.support.movers import seen, truck

SPEED = 2.0
TIMEOUT_S = 1.0


@dataclass(frozen=True)
class Pose:
    """Measured at ``at_s`` (true time), arrived ``late_s`` later."""

    at_s: float
    late_s: float


times = st.floats(0.0, 20.0)
poses = st.lists(st.builds(Pose, times, st.floats(0.0, 3.0)), min_size=1, max_size=30).map(
    lambda found: sorted(found, key=lambda p: p.at_s + p.late_s)
)


def where(at_s: float) -> float:
    """The object swings to and fro at its top speed: x at a true time [m]."""
    return abs((SPEED * at_s) % 8.0 - 4.0)


@given(poses=poses, ahead_s=st.floats(-1e6, 1e6), asked_s=st.lists(times, max_size=10))
def test_the_true_place_lies_within_the_growth(
    poses: list[Pose], ahead_s: float, asked_s: list[float]
) -> None:
    moving = MovingObjects([truck(max_speed=SPEED, timeout_s=TIMEOUT_S)], InputConfig())
    moving.follow(ActuatorSample(ahead_s, np.zeros(1), None, 0.0), restarted=False)
    newest_s = None
    for pose in poses:
        arrival_s = pose.at_s + pose.late_s
        sample = seen(where(pose.at_s), pose.at_s + ahead_s, arrival_s)
        fresh, _ = moving.take(Inputs(objects=(sample,)), arrival_s)
        if fresh:
            newest_s = pose.at_s
        for now_s in (arrival_s, *(arrival_s + t for t in asked_s)):
            found = moving.placements(now_s)["truck"]
            if found is None:
                assert newest_s is None or now_s - newest_s > TIMEOUT_S - 1e-3
                continue
            gone = abs(where(now_s) - found.pose[0, 3])
            assert gone <= found.grown_m + 1e-3  # the clocks' drift that is granted: 1 ms/s
            assert found.grown_m <= SPEED * TIMEOUT_S + 1e-9


stamps = st.lists(st.tuples(times, st.floats(0.0, 0.5)), min_size=2, max_size=40)


@given(stamps=stamps)
def test_an_accepted_stamp_never_goes_back_unless_the_sender_was_away(
    stamps: list[tuple[float, float]],
) -> None:
    moving = MovingObjects([truck(timeout_s=TIMEOUT_S)], InputConfig())
    now_s, last, last_s, refused_since_s = 0.0, None, 0.0, None
    for stamp_s, step_s in stamps:
        now_s += step_s
        fresh, refused = moving.take(Inputs(objects=(seen(0.0, stamp_s, now_s),)), now_s)
        assert fresh is not bool(refused)
        if not fresh:
            refused_since_s = now_s if refused_since_s is None else refused_since_s
            continue
        if last is not None and (stamp_s <= last or stamp_s - last > now_s - last_s + 1.0):
            assert refused_since_s is not None
            assert now_s - refused_since_s >= TIMEOUT_S
        last, last_s, refused_since_s = stamp_s, now_s, None
    (health,) = moving.health(now_s)
    assert health.accepted + sum(health.rejected.values()) == len(stamps)


@given(steps=st.lists(st.floats(0.0, 0.7), min_size=1, max_size=20))
def test_between_poses_it_only_grows(steps: list[float]) -> None:
    moving = MovingObjects([truck(timeout_s=TIMEOUT_S)], InputConfig())
    moving.take(Inputs(objects=(seen(0.0, 0.0),)), 0.0)
    now_s, before = 0.0, 0.0
    for step_s in steps:
        now_s += step_s
        found = moving.placements(now_s)["truck"]
        grown = np.inf if found is None else found.grown_m
        assert grown >= before
        before = grown
