import numpy as np
import pytest

from rampe_guard.core.config import ActuatorConfig, InputConfig
from rampe_guard.core.inputs import Accepted, InputGate, Rejection
from rampe_guard.core.types import ActuatorSample, JoystickSample

ACTUATORS = (
    ActuatorConfig("swing", 0, 1, 0.6, 1.2, 0.1, 0.1, "rad"),
    ActuatorConfig("boom", 1, 1, 0.2, 0.5, 0.1, 0.1, "m"),
)
LIMITS = np.array([[-np.inf, np.inf], [0.0, 1.0]])


def gate() -> InputGate:
    return InputGate(ACTUATORS, LIMITS, InputConfig(), axes=2)


def lever(stamp: float, *axes: float, arrival: float | None = None) -> JoystickSample:
    return JoystickSample(stamp, np.array(axes), stamp if arrival is None else arrival)


def arm(
    stamp: float,
    *q: float,
    arrival: float | None = None,
    velocity: tuple[float, ...] | None = None,
) -> ActuatorSample:
    v = None if velocity is None else np.array(velocity)
    return ActuatorSample(stamp, np.array(q), v, stamp if arrival is None else arrival)


@pytest.mark.parametrize(
    ("sample", "reason"),
    [
        (lever(1.0, 0.5), "wrong_length"),
        (lever(1.0, 0.5, float("nan")), "not_finite"),
        (lever(float("nan"), 0.5, 0.5), "not_finite"),
        (lever(1.0, 0.5, -1.2), "axis_out_of_range"),
    ],
)
def test_impossible_levers_are_refused(sample: JoystickSample, reason: str) -> None:
    result = gate().joystick(sample)
    assert isinstance(result, Rejection)
    assert (result.input, result.reason) == ("joystick", reason)


@pytest.mark.parametrize(
    ("sample", "reason"),
    [
        (arm(1.0, 0.5), "wrong_length"),
        (arm(1.0, 0.5, 0.5, velocity=(0.1,)), "wrong_length"),
        (arm(1.0, 0.5, float("inf")), "not_finite"),
        (arm(1.0, 0.5, 0.5, velocity=(0.1, float("nan"))), "not_finite"),
        (arm(1.0, 0.0, 1.06), "position_out_of_range"),
        (arm(1.0, 0.0, -0.06), "position_out_of_range"),
    ],
)
def test_impossible_positions_are_refused(sample: ActuatorSample, reason: str) -> None:
    result = gate().actuators(sample)
    assert isinstance(result, Rejection)
    assert (result.input, result.reason) == ("actuators", reason)


def test_a_little_beyond_is_calibration_and_not_a_fault() -> None:
    result = gate().joystick(lever(1.0, 1.04, -1.03))
    assert isinstance(result, Accepted)
    np.testing.assert_array_equal(result.sample.axes, [1.0, -1.0])
    assert isinstance(gate().actuators(arm(1.0, 100.0, 1.04)), Accepted)


def test_extra_axes_are_allowed() -> None:
    assert isinstance(gate().joystick(lever(1.0, 0.1, 0.2, 0.3)), Accepted)


def test_stamps_must_go_on() -> None:
    g = gate()
    assert isinstance(g.joystick(lever(10.0, 0, 0)), Accepted)
    for stamp, reason in ((10.0, "stamp_back"), (9.0, "stamp_back"), (20.0, "stamp_jump")):
        result = g.joystick(lever(stamp, 0, 0, arrival=10.01))
        assert isinstance(result, Rejection)
        assert result.reason == reason
    assert isinstance(g.joystick(lever(10.02, 0, 0)), Accepted)


def test_a_late_burst_after_a_network_stall_is_used() -> None:
    g = gate()
    g.actuators(arm(10.0, 0.0, 0.5))
    for k in range(1, 20):
        assert isinstance(g.actuators(arm(10.0 + 0.05 * k, 0.0, 0.5, arrival=12.0)), Accepted)


def test_an_arm_cannot_jump() -> None:
    g = gate()
    g.actuators(arm(1.0, 0.0, 0.2))
    result = g.actuators(arm(1.1, 0.0, 0.9))
    assert isinstance(result, Rejection)
    assert result.reason == "position_jump"
    assert isinstance(g.actuators(arm(1.2, 0.0, 0.25)), Accepted)


@pytest.mark.parametrize("offset", [-100.0, 3600.0])
def test_a_restarted_sender_is_taken_up_after_its_time_out(offset: float) -> None:
    g = gate()
    g.actuators(arm(200.0, 0.0, 0.5, arrival=0.0))
    results = [
        g.actuators(arm(200.0 + offset + 0.1 * k, 0.0, 0.5, arrival=0.1 * k)) for k in range(1, 9)
    ]
    kinds = [isinstance(r, Accepted) for r in results]
    assert kinds == [False] * 5 + [True] * 3
    assert [r.restarted for r in results if isinstance(r, Accepted)] == [True, False, False]


def test_an_arm_cannot_jump_over_a_gap_either() -> None:
    g = gate()
    g.actuators(arm(1.0, 0.0, 0.2))
    result = g.actuators(arm(1.8, 3.7, 0.2))
    assert isinstance(result, Rejection)
    assert result.reason == "position_jump"
    assert isinstance(g.actuators(arm(1.9, 0.5, 0.3)), Accepted)


AHEAD_S = 1.7e9


def fed(judge: InputGate, stamps: list[float], arrivals: list[float]) -> list[float | str]:
    """How late each sample was [s], or why it was refused."""
    told: list[float | str] = []
    for stamp, arrival in zip(stamps, arrivals, strict=True):
        result = judge.joystick(lever(AHEAD_S + stamp, 0.0, 0.0, arrival=arrival))
        told.append(result.reason if isinstance(result, Rejection) else round(result.late_s, 2))
    return told


def prompt(judge: InputGate, until_s: float = 2.0) -> None:
    times = np.arange(1.0, until_s, 0.01).tolist()
    assert set(fed(judge, times, times)) == {0.0}


def test_what_a_network_kept_is_late_and_the_last_of_it_is_not() -> None:
    judge = gate()
    prompt(judge)
    # of five seconds the first two messages were kept, and the last two
    kept = [2.0, 2.01, 6.98, 6.99]
    assert fed(judge, kept, [7.0] * 4) == pytest.approx([5.0, 4.99, 0.02, 0.01], abs=0.02)
    assert fed(judge, [7.01], [7.01]) == [0.0]


def test_what_only_keeps_coming_late_stays_late() -> None:
    judge = gate()
    prompt(judge)
    arrivals = np.arange(4.0, 64.0, 0.01)
    told = fed(judge, (arrivals - 2.0).tolist(), arrivals.tolist())
    assert told[0] == 2.0
    assert isinstance(told[-1], float)
    assert 1.9 < told[-1] < 2.0


def test_a_stamp_beyond_its_own_clock_is_refused_though_the_last_was_late() -> None:
    judge = gate()
    prompt(judge)
    late_s, refused = fed(judge, [2.0, 9.5], [7.0, 7.0])
    assert late_s == pytest.approx(5.0, abs=0.02)
    assert refused == "stamp_jump"


def test_a_clock_that_was_set_back_a_little_is_waited_for_and_gone_by() -> None:
    judge = gate()
    prompt(judge)
    arrivals = np.arange(2.0, 3.0, 0.01)
    told = fed(judge, (arrivals - 0.3).tolist(), arrivals.tolist())
    assert told[:29] == ["stamp_back"] * 29
    assert set(told[31:]) == {0.0}


def test_what_is_refused_sets_nobody_elses_clock() -> None:
    judge = gate()
    prompt(judge)
    for k in range(20):  # somebody else speaks with a clock of his own in between
        now_s = 2.0 + 0.1 * k
        others = [now_s + 3600.0 + 0.01 * i for i in range(4)]
        arrivals = [now_s + 0.01 * i for i in range(4)]
        assert fed(judge, others, arrivals) == ["stamp_jump"] * 4
        assert fed(judge, [now_s + 0.05], [now_s + 0.05]) == [0.0]


def test_one_out_of_order_is_no_other_clock() -> None:
    judge = gate()
    prompt(judge)
    assert fed(judge, [1.5, 2.0], [3.0, 3.0]) == ["stamp_back", 1.0]


def test_a_clock_that_loses_half_a_millisecond_a_second_makes_nothing_late() -> None:
    judge = gate()
    arrivals = np.arange(1.0, 2000.0, 0.05)
    told = fed(judge, (arrivals * (1.0 - 5e-4)).tolist(), arrivals.tolist())
    assert set(told) == {0.0}


def test_a_simulation_may_run_at_half_the_pace_where_the_site_says_so() -> None:
    arrivals = np.arange(1.0, 20.0, 0.05)
    stamps = (0.5 * arrivals).tolist()
    usual = fed(gate(), stamps, arrivals.tolist())
    assert usual[-1] == pytest.approx(9.5, abs=0.1)
    slow = InputGate(ACTUATORS, LIMITS, InputConfig(max_clock_loss=1.0), axes=2)
    assert set(fed(slow, stamps, arrivals.tolist())) == {0.0}


def test_who_started_anew_brings_a_clock_of_his_own() -> None:
    judge = gate()
    prompt(judge)
    arrivals = np.arange(3.0, 4.0, 0.01)
    told = fed(judge, (arrivals - 3600.0).tolist(), arrivals.tolist())
    assert told[0] == "stamp_back"
    assert told[-1] == 0.0


@pytest.mark.parametrize("glitch_s", [0.02, 0.3, 0.45, 0.9])
def test_one_stamp_from_the_future_is_got_over(glitch_s: float) -> None:
    judge = gate()
    prompt(judge)
    assert fed(judge, [2.0 + glitch_s], [2.0]) == [0.0]
    arrivals = np.arange(2.01, 5.0, 0.01).tolist()
    told = fed(judge, arrivals, arrivals)
    assert set(told[:1]) == {"stamp_back"}
    assert told[-1] == pytest.approx(0.0, abs=0.02)
    assert [late for late in told if late != "stamp_back"] == pytest.approx(
        [0.0] * (len(told) - told.count("stamp_back")), abs=0.021
    )
