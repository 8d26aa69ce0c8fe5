"""The simulated operator: reaches his waypoints, varies, repeats for a seed, goes too far."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.operator import Operator
from rampe_guard.simulate.run import Tick, simulate
from rampe_guard.simulate.work import Habits, Move, Overshoot, Waypoint, plan_cycle

ACTUATORS = (
    ActuatorConfig("swing", 2, 1, 0.9, 1.8, 0.12, 0.08, "rad"),
    ActuatorConfig("boom", 0, -1, 0.4, 1.2, 0.16, 0.05, "m"),
)
MACHINE = build_machine(ACTUATORS, [(None, None), (0.0, 1.3)])
WORK = (
    Waypoint("lift", (Move("boom", 0.9, 0.02),)),
    Waypoint(
        "swing",
        (Move("swing", 1.2, 0.03), Move("boom", 1.0, 0.02, start_s=0.3)),
        overshoot=Overshoot("swing", 0.2, 0.35),
    ),
    Waypoint("return", (Move("swing", 0.0, 0.03), Move("boom", 0.4, 0.02, start_s=0.4))),
)
NEVER = Habits(overshoot_probability=0.0)
ALWAYS = Habits(overshoot_probability=1.0)
START = np.array([0.0, 0.4])


def work(habits: Habits, cycles: int, seed: int = 3) -> tuple[list[Tick], list[str], Operator]:
    operator = Operator(ACTUATORS, WORK, seed, habits)
    ticks, phases = [], []
    for tick in simulate(ACTUATORS, operator, MACHINE, START, rate_hz=50.0, cycles=cycles):
        ticks.append(tick)
        phases.append(operator.phase)
    return ticks, phases, operator


def test_he_reaches_each_waypoint_about_where_he_aims() -> None:
    ticks, phases, operator = work(NEVER, 5)
    assert operator.cycles == 5
    assert operator.overshoots == 0
    ends = [
        (name, tick.position)
        for tick, name, following in zip(ticks, phases, phases[1:], strict=False)
        if name != following
    ]
    goals = {"lift": (None, 0.9), "swing": (1.2, 1.0), "return": (0.0, 0.4)}
    for name, position in ends:
        for reached, goal in zip(position, goals[name], strict=True):
            assert goal is None or reached == pytest.approx(goal, abs=0.12)
    swings = [position[0] for name, position in ends if name == "swing"]
    assert np.std(swings) > 0.005


def test_going_too_far_is_seen_late_and_put_right() -> None:
    ticks, phases, operator = work(ALWAYS, 5)
    assert operator.overshoots == 5
    assert "come back" in phases
    swing = np.array([tick.position[0] for tick in ticks])
    beyond = swing > 1.2 + 0.12
    assert 5 <= np.count_nonzero(np.diff(beyond.astype(int)) == 1) <= 6
    assert swing.max() < 1.2 + 0.35 + 0.12
    assert not beyond[-1]


def test_the_same_seed_is_the_same_day() -> None:
    first, again, other = (work(ALWAYS, 2, seed)[0] for seed in (3, 3, 4))
    assert len(first) == len(again)
    for a, b in zip(first, again, strict=True):
        assert np.array_equal(a.axes, b.axes)
        assert np.array_equal(a.position, b.position)
    assert not np.array_equal(first[100].axes, other[100].axes)


def test_his_plans_do_not_depend_on_the_rate() -> None:
    slips = []
    for rate_hz in (20.0, 50.0):
        operator = Operator(ACTUATORS, WORK, 5, Habits(overshoot_probability=0.5))
        run = simulate(ACTUATORS, operator, MACHINE, START, rate_hz=rate_hz, cycles=4)
        slips.append([operator.overshoots for _ in run][-1])
    assert slips[0] == slips[1] > 0


def test_levers_keep_their_range_their_axis_and_their_sign() -> None:
    ticks, phases, _ = work(NEVER, 2)
    axes = np.array([tick.axes for tick in ticks])
    assert axes.shape[1] == 3
    assert np.abs(axes).max() <= 1.0
    assert not axes[:, 1].any()
    lifting = axes[[phase == "lift" for phase in phases]]
    assert lifting[:, 0].min() < -0.5
    assert lifting[:, 0].max() <= 0.0
    assert not lifting[20:, 2].any()


def test_levers_do_not_jump() -> None:
    ticks, _, _ = work(NEVER, 2)
    axes = np.array([tick.axes for tick in ticks])
    assert np.abs(np.diff(axes, axis=0)).max() < 8.0 / 50.0 + 0.1


def test_a_move_that_cannot_be_finished_is_given_up() -> None:
    beyond = (Waypoint("press", (Move("boom", 2.0),)), Waypoint("back", (Move("boom", 0.5),)))
    operator = Operator(ACTUATORS, beyond, 1, NEVER)
    ticks = list(
        simulate(ACTUATORS, operator, MACHINE, START, rate_hz=20.0, cycles=1, duration_s=60.0)
    )
    assert operator.cycles == 1
    assert max(tick.position[1] for tick in ticks) == pytest.approx(1.3, abs=0.002)


def test_a_plan_goes_too_far_as_often_as_its_probability_says() -> None:
    rng = np.random.default_rng(0)
    names = [a.name for a in ACTUATORS]
    plans = [plan_cycle(WORK, names, Habits(overshoot_probability=0.2), rng) for _ in range(2000)]
    share = np.mean([any(phase.too_far for phase in plan) for plan in plans])
    assert share == pytest.approx(0.2, abs=4 * np.sqrt(0.2 * 0.8 / 2000))


def test_a_run_ends_when_asked_and_the_period_is_exact() -> None:
    operator = Operator(ACTUATORS, WORK, 1, NEVER)
    ticks = list(simulate(ACTUATORS, operator, MACHINE, START, rate_hz=40.0, duration_s=1.0))
    assert [tick.time_s for tick in ticks] == [k / 40.0 for k in range(40)]
    endless = simulate(ACTUATORS, Operator(ACTUATORS, WORK, 1), MACHINE, START)
    assert len(list(islice(endless, 3000))) == 3000


def test_impossible_work_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one waypoint"):
        Operator(ACTUATORS, (), 1)
    with pytest.raises(ValueError, match=r"moves \['stick'\]; the machine has"):
        Operator(ACTUATORS, (Waypoint("dig", (Move("stick", 1.0),)),), 1)
    lost = Waypoint("lift", (Move("boom", 1.0),), Overshoot("swing", 0.1, 0.2))
    with pytest.raises(ValueError, match="which it does not move"):
        Operator(ACTUATORS, (lost,), 1)


def test_impossible_runs_are_refused() -> None:
    operator = Operator(ACTUATORS, WORK, 1)
    with pytest.raises(ValueError, match="rate_hz"):
        next(simulate(ACTUATORS, operator, MACHINE, START, rate_hz=0.0))
    with pytest.raises(ValueError, match=r"start\.shape"):
        next(simulate(ACTUATORS, operator, MACHINE, np.zeros(3)))
