"""The simulated engineering test: targets met as a person meets them, primitives that follow."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.paper_primitives import primitives_of
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.paper_arm import (
    ACTUATORS,
    LIMITS,
    RATE_HZ,
    SENSOR_NOISE,
    TARGETS,
    WAY,
    Recording,
    paper_run,
    paper_waypoints,
)
from rampe_guard.simulate.paper_operator import CORRECTION, Care, CarefulOperator
from rampe_guard.simulate.run import simulate
from rampe_guard.simulate.work import Habits, Overshoot


@pytest.fixture(scope="module")
def run() -> Recording:
    return paper_run(seed=5, cycles=6)


def test_the_way_is_that_of_table_ii() -> None:
    steps = [np.subtract(TARGETS[b], TARGETS[a]) for a, b in pairwise(WAY)]
    printed = [(-41.7, 0.16), (-22.7, -0.16), (0, -0.19), (0, 0.19), (22.7, 0.16), (41.7, -0.16)]
    assert np.array(steps) == pytest.approx(np.array(printed), abs=1e-9)
    assert [len(w.moves) for w in paper_waypoints()] == [2, 2, 1, 1, 2, 2]


def test_he_meets_every_target_in_every_cycle_and_never_twice_alike(run: Recording) -> None:
    visits: list[str] = []
    for q in run.position:
        near = [n for n, t in TARGETS.items() if np.all(np.abs(q - t) < [8.0, 0.04])]
        if near and visits[-1:] != near:
            visits += near
    assert visits == [*(WAY[:-1] * 6), "A"]
    lowest = [run.position[i : i + 900, 1].min() for i in range(0, len(run.position) - 900, 900)]
    assert np.std(lowest) > 0.002


def test_the_motion_keeps_to_what_the_arm_can_do(run: Recording) -> None:
    smooth = np.array([np.convolve(p, np.ones(5) / 5, "valid") for p in run.position.T]).T
    velocity = np.diff(smooth, axis=0) * RATE_HZ
    top = np.array([a.max_velocity for a in ACTUATORS])
    noise = 5.0 * SENSOR_NOISE * RATE_HZ / 5
    assert np.all(np.abs(velocity) <= top + noise)
    assert np.all(np.abs(velocity).max(axis=0) > 0.7 * top)
    assert np.all((run.position > LIMITS[:, 0]) & (run.position < LIMITS[:, 1]))
    assert np.all(np.abs(run.axes) <= 1.0)


def test_one_seed_one_run(run: Recording) -> None:
    again, other = paper_run(5, 1), paper_run(6, 1)
    n = min(len(again.time_s), len(other.time_s))
    assert np.array_equal(again.axes, run.axes[: len(again.axes)])
    assert not np.allclose(again.position[:n], other.position[:n], atol=0.5)


def test_levers_seldom_come_to_rest_together_so_there_are_tails(run: Recording) -> None:
    primitives = primitives_of(run.time_s, run.axes, run.position, ACTUATORS)
    assert {(-1, 1), (-1, -1), (0, -1), (0, 1), (1, 1), (1, -1)} <= set(primitives.category)
    both = [c for c in primitives.category if 0 not in c]
    one = [c for c in primitives.category if 0 in c]
    assert len(one) > len(both) >= 4 * 6


@pytest.mark.parametrize("cycles", [0, -2])
def test_no_cycles_are_refused(cycles: int) -> None:
    with pytest.raises(ValueError, match=f"cycles={cycles}"):
        paper_run(1, cycles)


def left_off(care: Care) -> tuple[CarefulOperator, FloatArray, list[str]]:
    """How far off each move was left (N, 2), by an operator who hardly foresees the stop."""
    habits = Habits(foresight=(0.0, 0.4), overshoot_probability=0.0)
    operator = CarefulOperator(ACTUATORS, paper_waypoints(), 2, habits, care)
    machine = build_machine(ACTUATORS, LIMITS)
    start = np.array(TARGETS["A"])
    off, phases = [], [operator.phase]
    for tick in simulate(ACTUATORS, operator, machine, start, cycles=3):
        if operator.phase != phases[-1]:
            if operator.phase != CORRECTION:
                done = next((p for p in reversed(phases) if p != CORRECTION), "idle")
                if done != "idle":
                    off.append(np.abs(tick.position - TARGETS[done[-1]]))
            phases.append(operator.phase)
    return operator, np.array(off), phases


def test_who_cares_corrects_and_comes_nearer_than_who_does_not() -> None:
    careless, far, _ = left_off(Care(np.array([1e3, 1e3])))
    tolerance = np.array([1.0, 0.005])
    careful, near, _ = left_off(Care(tolerance, foresight=(0.9, 1.1)))
    assert careless.corrections == 0
    assert careful.corrections > 0
    assert careful.cycles == careless.cycles == 3
    assert np.all(np.mean(near, axis=0) < 0.7 * np.mean(far, axis=0))


def test_he_gives_up_after_his_tries() -> None:
    operator, _, phases = left_off(Care(np.array([1e-6, 1e-9]), tries=1))
    moves = sum(p not in {CORRECTION, "idle"} for p in phases)
    assert operator.corrections in {moves, moves - 1}  # the last move may not be over yet


@pytest.mark.parametrize("tolerance", [[1.0], [1.0, 0.0], [1.0, 1.0, 1.0]])
def test_a_tolerance_for_every_actuator(tolerance: list[float]) -> None:
    with pytest.raises(ValueError, match="tolerance"):
        CarefulOperator(ACTUATORS, paper_waypoints(), 1, Habits(), Care(np.array(tolerance)))


def test_who_goes_too_far_comes_back_and_then_corrects_towards_the_target() -> None:
    far = Overshoot("swing", -20.0, -15.0)
    waypoints = [replace(w, overshoot=far) if w.name == "A to B" else w for w in paper_waypoints()]
    care = Care(np.array([1.0, 0.005]), foresight=(0.9, 1.1))
    operator = CarefulOperator(ACTUATORS, waypoints, 3, Habits(overshoot_probability=1.0), care)
    phases, swing = [""], []
    machine, start = build_machine(ACTUATORS, LIMITS), np.array(TARGETS["A"])
    for tick in simulate(ACTUATORS, operator, machine, start, cycles=2):
        if operator.phase != phases[-1]:
            phases.append(operator.phase)
            swing.append(tick.position[0])
    at = phases.index("A to B")
    assert phases[at + 1] == "come back"  # nothing in between
    assert operator.overshoots >= 2
    assert swing[at] < TARGETS["B"][0] - 10.0
    after = swing[phases.index("B to C") - 1]
    assert after == pytest.approx(TARGETS["B"][0], abs=2.0)


def test_waypoints_need_names_of_their_own() -> None:
    twice = [*paper_waypoints(), paper_waypoints()[0]]
    with pytest.raises(ValueError, match="names of their own"):
        CarefulOperator(ACTUATORS, twice, 1, Habits(), Care(np.array([1.0, 0.01])))
    clash = [replace(paper_waypoints()[0], name=CORRECTION)]
    with pytest.raises(ValueError, match="names of their own"):
        CarefulOperator(ACTUATORS, clash, 1, Habits(), Care(np.array([1.0, 0.01])))
