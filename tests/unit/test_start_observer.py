"""ξ: what is observed at the start of a primitive, from lever to forecast."""

from collections.abc import Sequence

import numpy as np
import pytest

from rampe_guard.core.config import (
    ActuatorConfig,
    Basis,
    GuardConfig,
    JoystickConfig,
    Observation,
    RampeConfig,
)
from rampe_guard.core.events import PredictionEvent
from rampe_guard.core.intention import Intention
from rampe_guard.core.start_observer import StartObserver
from rampe_guard.core.types import ActuatorSample, JoystickSample

DT = 0.02
ACTUATORS = (
    ActuatorConfig("swing", 0, 1, 1.0, 2.0, 0.1, 0.1, "rad"),
    ActuatorConfig("boom", 1, 1, 0.5, 2.0, 0.1, 0.1, "m"),
)
LIMITS = np.array([[-3.0, 3.0], [0.0, 2.0]])
ALL: tuple[Observation, ...] = ("q", "time", "command", "speed", "command_sum")


def test_order_is_that_of_the_names_and_q_is_no_part() -> None:
    observer = StartObserver(2, ["speed", "q", "time", "command"])
    assert observer.size == 5
    observer.update(10.0, np.array([0.1, 0.2]), np.array([0.3, 0.4]))
    observer.update(10.5, np.array([0.5, 0.6]), np.array([0.7, 0.8]))
    np.testing.assert_allclose(observer.start(), [0.7, 0.8, 0.5, 0.5, 0.6])


def test_sum_of_the_command_is_since_the_previous_start() -> None:
    observer = StartObserver(2, ["command_sum", "time"])
    for k in range(11):
        observer.update(0.1 * k, np.array([1.0, -0.5]), np.zeros(2))
    np.testing.assert_allclose(observer.start(), [1.0, -0.5, 1.0])
    for k in range(11, 14):
        observer.update(0.1 * k, np.array([0.0, 2.0]), np.zeros(2))
    np.testing.assert_allclose(observer.start(), [0.0, 0.6, 1.3])
    np.testing.assert_allclose(observer.start(), [0.0, 0.0, 1.3])


def test_no_time_passes_where_a_clock_starts_anew() -> None:
    observer = StartObserver(1, ["time", "command_sum"])
    observer.update(1000.0, np.ones(1), np.zeros(1))
    observer.update(1000.5, np.ones(1), np.zeros(1))
    observer.pause()
    observer.update(3.0, np.ones(1), np.zeros(1))
    observer.update(3.25, np.ones(1), np.zeros(1))
    observer.update(3.20, np.ones(1), np.zeros(1))  # a stamp that goes back takes nothing away
    np.testing.assert_allclose(observer.start(), [0.75, 0.75])


@pytest.mark.parametrize("names", [[], ["q"]])
def test_nothing_is_observed_unless_asked(names: Sequence[str]) -> None:
    observer = StartObserver(3, names)
    observer.update(0.0, np.ones(3), np.ones(3))
    assert observer.size == 0
    assert observer.start().shape == (0,)


class Machine:
    """Two actuators that follow their levers exactly, and the operator's intention."""

    def __init__(self, observations: tuple[Observation, ...], basis: Basis) -> None:
        rampe = RampeConfig(observations=observations, basis=basis)
        config = GuardConfig(ACTUATORS, axes=2, rampe=rampe, joystick=JoystickConfig())
        self.intention = Intention(config, LIMITS)
        self.q, self.now = np.array([0.0, 1.0]), 0.0
        self.events: list[PredictionEvent] = []

    def hold(self, swing: float, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.now += DT
            velocity = np.array([swing * ACTUATORS[0].max_velocity, 0.0])
            self.q = self.q + velocity * DT
            axes = np.array([swing, 0.0])
            sample = JoystickSample(self.now, axes, self.now)
            self.events += self.intention.joystick(sample, self.now, learn=True)
            position = ActuatorSample(self.now, self.q.copy(), velocity, self.now)
            self.events += self.intention.actuators(position, velocity, self.now, learn=True)


def operator(
    observations: tuple[Observation, ...], seed: int, basis: Basis = "radial", count: int = 60
) -> Machine:
    """Pushes hard for a long way and gently for a short one, wherever he begins."""
    rng = np.random.default_rng(seed)
    machine = Machine(observations, basis)
    for _ in range(count):
        push = rng.uniform(0.35, 1.0)
        way = 1.6 * push * push * (1.0 + 0.03 * rng.standard_normal())
        machine.hold(push, way / push)
        machine.hold(0.0, 0.4)
        here = float(machine.q[0])
        machine.hold(-0.9, (here - rng.uniform(-1.0, min(here - 0.15, 1.0))) / 0.9)
        machine.hold(0.0, 0.4)
    return machine


def errors(machine: Machine, skip: int = 15) -> list[float]:
    """|x̂ - x| of the swings to the right, forecast at their start, after ``skip`` of them."""
    found, told = [], None
    for event in machine.events:
        if event.prediction.category != (1, 0):
            continue
        if event.event == "started":
            told = event.prediction.mean
        elif event.event == "ended" and told is not None:
            found.append(abs(float(told[0] - event.prediction.progress[0])))
    return found[skip:]


@pytest.mark.parametrize(("basis", "share"), [("radial", 0.92), ("affine", 0.7)])
def test_the_lever_at_the_start_tells_how_far_it_goes(basis: Basis, share: float) -> None:
    """Displacement by the push alone: the error with the command in ξ over that without.

    The radial basis smooths over most of a range of ξ; what is linear in the command is better
    learned by the affine one.
    """
    blind = np.array(errors(operator(("q",), 0, basis)))
    seeing = np.array(errors(operator(("q", "command"), 0, basis)))
    assert len(blind) == len(seeing) > 40
    print(f"{basis}: without {blind.mean():.3f}, with the command {seeing.mean():.3f}")
    assert seeing.mean() < share * blind.mean()


def test_all_observations_arrive_and_are_of_use() -> None:
    machine = operator(ALL, 0)
    learned = machine.intention.rampe.snapshot()
    width = 2 + 1 + 2 + 2 + 2
    assert int(learned["observed"]) == width
    categories = [tuple(c) for c in learned["categories"].tolist()]
    first = categories.index((1, 0))
    counts = learned["remembered"].astype(int)
    starts = learned["starts"].reshape(-1, width)
    rows = starts[counts[:first].sum() : counts[: first + 1].sum()]
    time, command, speed, summed = rows[:, [2, 3, 5, 7]].astype(np.float64).T
    assert (np.diff(time) > 0.0).all()
    assert 0.2 < command.min() < 0.5
    assert 0.7 < command.max() < 1.0
    # he pushes as fast as it goes, and the filter lags behind
    assert float((command / speed).max()) <= 1.0 + 1e-9
    assert float((command / speed).min()) > 0.6
    assert (np.abs(summed) > 0.0).any()
    np.testing.assert_array_equal(rows[:, [4, 6, 8]], 0.0)  # the boom's lever was never touched
    blind = errors(operator(("q",), 0))
    seeing = errors(machine)
    print(f"without {np.mean(blind):.3f}, with all {np.mean(seeing):.3f}")
    assert np.mean(seeing) < 0.95 * np.mean(blind)
