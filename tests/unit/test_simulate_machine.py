"""The simulated machine against closed-form motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.core.types import FloatArray
from rampe_guard.simulate.machine import (
    Machine,
    MachineState,
    at_rest,
    build_machine,
    measure,
    step,
)

SWING = ActuatorConfig("swing", 0, 1, 0.6, 1.2, 0.12, 0.08, "rad")
BOOM = ActuatorConfig("boom", 1, -1, 0.15, 0.5, 0.16, 0.05, "m")
MACHINE = build_machine([SWING, BOOM], [(None, None), (0.0, 1.3)])


def drive(
    machine: Machine, state: MachineState, command: list[float], steps: int, dt_s: float = 0.01
) -> list[MachineState]:
    states = [state]
    for _ in range(steps):
        states.append(step(machine, states[-1], np.array(command), dt_s))
    return states


def rest() -> MachineState:
    return at_rest(MACHINE, np.array([0.0, 0.5]))


def test_nothing_moves_before_the_dead_time_and_each_actuator_has_its_own() -> None:
    states = drive(MACHINE, rest(), [1.0, 1.0], 40)
    moved_s = [min(s.time_s for s in states if s.velocity[i] > 0.0) for i in range(2)]
    assert moved_s == pytest.approx([0.12 + 0.01, 0.16 + 0.01])


def test_full_command_reaches_the_top_speed_and_no_more() -> None:
    states = drive(MACHINE, rest(), [1.0, 1.0], 200)
    assert states[-1].velocity == pytest.approx([0.6, 0.15], rel=1e-3)


def test_command_within_the_deadband_moves_nothing() -> None:
    states = drive(MACHINE, rest(), [0.08, -0.05], 100)
    assert states[-1].position == pytest.approx([0.0, 0.5], abs=0.0)


def test_letting_go_stops_within_lag_and_braking_distance() -> None:
    cruising = drive(MACHINE, rest(), [1.0, 0.0], 200)[-1]
    stopped = drive(MACHINE, cruising, [0.0, 0.0], 200)[-1]
    travelled = stopped.position[0] - cruising.position[0]
    straight = 0.6 * 0.12 + 0.6**2 / (2 * 1.2)
    # The first-order end of the braking adds at most a·τ²/2; a step of 10 ms blurs the rest.
    assert straight - 0.005 < travelled < straight + 0.5 * 1.2 * 0.06**2 + 0.005
    assert stopped.velocity[0] == pytest.approx(0.0, abs=1e-6)


def test_end_stop_holds_and_kills_the_speed() -> None:
    states = drive(MACHINE, at_rest(MACHINE, np.array([0.0, 1.25])), [0.0, 1.0], 200)
    assert states[-1].position[1] == 1.3
    assert states[-1].velocity[1] == 0.0


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=30))
def test_speed_acceleration_and_end_stops_are_never_exceeded(
    commands: list[tuple[float, float]],
) -> None:
    state = rest()
    for command in commands:
        after = step(MACHINE, state, np.array(command), 0.01)
        assert np.all(np.abs(after.velocity) <= MACHINE.max_velocity + 1e-12)
        at_stop = (after.position <= MACHINE.lower) | (after.position >= MACHINE.upper)
        change = np.abs(after.velocity - state.velocity)
        assert np.all((change <= MACHINE.max_acceleration * 0.01 + 1e-12) | at_stop)
        assert np.all((after.position >= MACHINE.lower) & (after.position <= MACHINE.upper))
        state = after


def test_the_rate_of_the_caller_hardly_matters() -> None:
    fine = drive(MACHINE, rest(), [1.0, -1.0], 200, 0.005)[-1]
    coarse = drive(MACHINE, rest(), [1.0, -1.0], 20, 0.05)[-1]
    assert coarse.position == pytest.approx(fine.position, abs=0.005)


def test_pending_commands_do_not_pile_up() -> None:
    assert len(drive(MACHINE, rest(), [1.0, 0.0], 500)[-1].commands) <= 18


def test_measurements_are_noisy_and_seeded() -> None:
    def read(seed: int) -> FloatArray:
        return measure(MACHINE, rest(), np.random.default_rng(seed))[0]

    assert np.array_equal(read(1), read(1))
    assert not np.array_equal(read(1), read(2))
    assert read(1) == pytest.approx([0.0, 0.5], abs=2e-3)


def test_wrong_limits_are_refused() -> None:
    with pytest.raises(ValueError, match="1 limits for 2 actuators"):
        build_machine([SWING, BOOM], [(0.0, 1.0)])
    with pytest.raises(ValueError, match="below its upper"):
        build_machine([SWING], [(1.0, 1.0)])
