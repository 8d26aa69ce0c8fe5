"""The demo's cycle on the demo's machine: lively, clean when done well, not when it slips."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.settings import load_site
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.operator import Operator
from rampe_guard.simulate.quarry import CYCLE, START, quarry_operator
from rampe_guard.simulate.run import Tick, simulate

SITE = load_site(Path(__file__).parents[2] / "config" / "sites" / "demo.yaml")
ACTUATORS = SITE.guard.actuators
MACHINE = build_machine(ACTUATORS, SITE.arm.limits)


def work(overshoot_probability: float, cycles: int, seed: int) -> tuple[list[Tick], Operator]:
    operator = quarry_operator(ACTUATORS, seed, overshoot_probability=overshoot_probability)
    run = simulate(ACTUATORS, operator, MACHINE, START, rate_hz=25.0, cycles=cycles)
    return list(run), operator


def test_a_cycle_takes_eight_to_ten_seconds() -> None:
    ticks, _ = work(0.0, 6, seed=1)
    assert 8.0 < ticks[-1].time_s / 6 < 10.5


def test_a_good_day_keeps_well_inside_the_travel() -> None:
    ticks, operator = work(0.0, 10, seed=2)
    position = np.array([tick.position for tick in ticks])
    assert operator.overshoots == 0
    assert position[:, 0].max() < 1.40
    assert position[:, 0].min() > -0.20
    assert position[:, 1].max() < 1.00
    for i, (lower, upper) in enumerate(SITE.arm.limits):
        assert lower is not None
        assert upper is not None
        assert lower < position[:, i].min() < position[:, i].max() < upper


def test_slips_go_past_the_wall_or_up_to_the_line() -> None:
    slips = set()
    for seed in range(4):
        ticks, operator = work(1.0, 2, seed)
        assert operator.overshoots == 2
        position = np.array([tick.position for tick in ticks])
        if position[:, 0].max() > 1.55:
            slips.add("wall")
        if position[:, 1].max() > 1.10:
            slips.add("line")
    assert slips == {"wall", "line"}


def test_one_to_three_actuators_move_together() -> None:
    assert {len(waypoint.moves) for waypoint in CYCLE} <= {1, 2, 3}
    ticks, _ = work(0.0, 3, seed=3)
    pushed = (np.abs([tick.axes for tick in ticks]) > 0.1).sum(axis=1)
    assert set(pushed.tolist()) == {0, 1, 2, 3}


def test_another_machine_is_refused() -> None:
    with pytest.raises(ValueError, match="needs a machine with"):
        quarry_operator((ActuatorConfig("swing", 0, 1, 0.8, 1.2, 0.1, 0.05, "rad"),), 1)
