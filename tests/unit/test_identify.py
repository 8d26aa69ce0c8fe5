"""What is told of a machine, and what is not guessed."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.identify import Measured, Traces, identify
from tests.support import small_arm

LOGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "excavator_logs"
SCALES = ((7.4695, 2.53), (7.4745, 2.56), (6.9645, 2.04), (7.6140, 2.42))
JOINTS = ("Swing", "Boom", "Stick", "Bucket")


@pytest.fixture(scope="module")
def traces() -> Traces:
    moments = small_arm.ticks()
    times = np.array([tick.time_s for tick in moments])
    axes = np.array([tick.axes for tick in moments])
    return Traces(times, axes, times, np.array([tick.position for tick in moments]))


def test_levers_in_another_order_are_told(traces: Traces) -> None:
    found = identify(traces)
    assert [(m.lever.axis, m.lever.sign) for m in found] == [(2, 1), (0, -1), (1, 1)]
    assert [m.problems for m in found[:2]] == [(), ()]
    assert [p.partition(":")[2] for p in found[2].problems] == [" deadband not measured"]


def test_what_was_not_moved_is_not_guessed(traces: Traces) -> None:
    still = traces.position.copy()
    still[:, 1] = 0.3 + np.random.default_rng(1).normal(0.0, 2e-4, len(still))
    found = identify(Traces(traces.lever_s, traces.axes, traces.time_s, still))
    assert not found[1].moved
    assert found[1].lever.axis is None
    assert found[1].max_velocity is None
    assert found[1].problems == ("it did not move",)
    assert found[0].lever.axis == 2


def test_levers_that_move_together_are_ambiguous(traces: Traces) -> None:
    axes = traces.axes.copy()
    axes[:, 0] = axes[:, 2]
    found = identify(Traces(traces.lever_s, axes, traces.time_s, traces.position))
    assert found[0].lever.axis is None
    assert "no lever" in found[0].problems[0] or "alike" in found[0].problems[0]
    assert found[0].max_velocity is not None  # how fast it was is known whatever moved it


def test_one_lever_for_two_actuators_is_told(traces: Traces) -> None:
    position = traces.position.copy()
    position[:, 1] = 0.5 * position[:, 0] + np.random.default_rng(2).normal(
        0.0, 1e-3, len(position)
    )
    found = identify(Traces(traces.lever_s, traces.axes, traces.time_s, position))
    assert found[0].lever.axis == 2
    assert found[1].lever.axis is None
    assert "moves actuator 0 too" in found[1].problems[0]


def test_an_actuator_that_drifts_has_no_lever(traces: Traces) -> None:
    position = traces.position.copy()
    position[:, 1] = np.sin(0.7 * traces.time_s)
    found = identify(Traces(traces.lever_s, traces.axes, traces.time_s, position))
    assert found[1].lever.axis is None
    assert "no lever explains" in found[1].problems[0]


@pytest.mark.parametrize("seed", range(8))
def test_a_few_seconds_of_work_are_no_evidence(seed: int) -> None:
    """Among some levers and all lags, one explains a short motion by chance."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 4.0, 0.02)
    axes = np.repeat(rng.choice([-1.0, 0.0, 1.0], (8, 4)), 25, axis=0)
    position = np.cumsum(np.repeat(rng.choice([-1.0, 0.5, 1.0], (8, 2)), 25, axis=0), axis=0)
    for one in identify(Traces(times, axes, times, 0.02 * position)):
        assert one.lever.axis is None or one.lever.sign == 0


def test_one_push_each_way_is_enough(traces: Traces) -> None:
    """A lever moved once each way, from rest: that is what people do first."""
    late = traces.time_s < 7.0
    found = identify(
        Traces(traces.lever_s[late], traces.axes[late], traces.time_s[late], traces.position[late])
    )
    assert (found[0].lever.axis, found[0].lever.sign) == (2, 1)
    assert [one.moved for one in found] == [True, False, False]


def test_a_speed_that_still_rose_is_no_top_speed() -> None:
    """Pushes as short as the machine is slow to answer."""
    times = np.arange(0.0, 30.0, 0.02)
    lever = np.where(times % 3.0 < 0.4, np.where(times % 6.0 < 3.0, 1.0, -1.0), 0.0)
    speed = np.zeros(len(times))
    for k in range(10, len(times)):  # 0.2 s late, up and down by 1 per second
        wanted = 0.9 * lever[k - 10]
        speed[k] = speed[k - 1] + np.clip(wanted - speed[k - 1], -0.02, 0.02)
    position = np.cumsum(speed) * 0.02
    (found,) = identify(Traces(times, lever[:, None], times, position[:, None]))
    assert (found.lever.axis, found.lever.sign) == (0, 1)
    assert found.max_velocity is not None
    assert found.max_velocity.value < 0.6
    assert found.max_velocity.events == 0
    assert "still rising" in found.max_velocity.how


def test_motion_to_and_fro_leaves_the_sign_open() -> None:
    """Half a period later, and turned round, it looks the same."""
    times = np.arange(0.0, 30.0, 0.02)
    lever = np.sign(np.sin(2.0 * np.pi * 1.1 * times))
    position = np.cumsum(np.sign(np.sin(2.0 * np.pi * 1.1 * (times - 0.25)))) * 0.02
    (found,) = identify(Traces(times, lever[:, None], times, position[:, None]))
    assert found.lever.axis == 0
    assert found.lever.sign == 0
    assert "which way" in found.problems[0]
    assert found.lag_s is None


def test_inputs_at_rates_of_their_own(traces: Traces) -> None:
    slow = slice(None, None, 3)
    found = identify(
        Traces(traces.lever_s, traces.axes, traces.time_s[slow], traces.position[slow])
    )
    assert [(m.lever.axis, m.lever.sign) for m in found] == [(2, 1), (0, -1), (1, 1)]


def test_a_stop_of_both_inputs_brings_no_motion(traces: Traces) -> None:
    """What is between two messages 5 s apart is not seen: no speed is made of it."""
    late = np.where(traces.time_s > 20.0, traces.time_s + 5.0, traces.time_s)
    whole = identify(traces)
    found = identify(Traces(late, traces.axes, late, traces.position))
    for one, other in zip(whole, found, strict=True):
        assert one.max_velocity is not None
        assert other.max_velocity is not None
        assert other.max_velocity.value == pytest.approx(one.max_velocity.value, rel=0.05)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_too_little_is_nothing(traces: Traces, count: int) -> None:
    few = slice(0, count)
    assert (
        identify(
            Traces(traces.lever_s[few], traces.axes[few], traces.time_s[few], traces.position[few])
        )
        == ()
    )


@pytest.mark.private_data
@pytest.mark.skipif(not LOGS.is_dir(), reason="the private operator logs are not here")
def test_a_real_machine_at_work() -> None:
    """Nobody moved one lever at a time; order, signs, speeds and lags are what is known of it."""
    found = _real("operator3_run1.csv")
    assert [(m.lever.axis, m.lever.sign) for m in found] == [(0, 1), (1, 1), (2, 1), (3, 1)]
    for one, top in zip(found, (0.95, 0.023, 0.035, 0.038), strict=True):
        assert one.max_velocity is not None
        assert 0.85 * top < one.max_velocity.value < 1.25 * top
        assert one.lag_s is not None
        assert 0.1 < one.lag_s.value < 0.5  # 0.11 to 0.16 s, the late ones


def _real(name: str) -> tuple[Measured, ...]:
    rows = []
    with (LOGS / name).open(newline="") as file:
        for row in csv.DictReader(file):
            try:
                lever = [
                    (float(row[f"{joint} Cmd"]) - neutral) / half
                    for joint, (neutral, half) in zip(JOINTS, SCALES, strict=True)
                ]
                place = [float(row[f"{joint} Ms"]) for joint in JOINTS]
                rows.append([float(row["Time"]), *lever, place[0], *(0.01 * p for p in place[1:])])
            except (TypeError, ValueError):  # its last line is cut off
                continue
    table = np.array(rows)
    return identify(Traces(table[:, 0], np.clip(table[:, 1:5], -1, 1), table[:, 0], table[:, 5:]))
