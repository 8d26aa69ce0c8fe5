import pytest

from rampe_guard.core.config import InputConfig
from rampe_guard.core.monitor import InputMonitor, Status
from rampe_guard.core.types import InputName


def fed(config: InputConfig | None = None) -> InputMonitor:
    monitor = InputMonitor(config or InputConfig(), start_s=0.0)
    monitor.accept("joystick", 1.0)
    monitor.accept("actuators", 1.0)
    return monitor


def codes(monitor: InputMonitor, now_s: float) -> list[str]:
    return [r.code for r in monitor.health(now_s).reasons]


def test_fresh_inputs_are_ok() -> None:
    health = fed().health(1.1)
    assert health.status is Status.OK
    assert health.reasons == ()
    assert health.ages_s == {"joystick": pytest.approx(0.1), "actuators": pytest.approx(0.1)}


def test_no_data_is_never_ok() -> None:
    monitor = InputMonitor(InputConfig(), start_s=0.0)
    assert monitor.health(0.6).status is Status.NOT_MONITORING
    assert codes(monitor, 0.6) == ["actuators_silent", "joystick_silent"]
    assert monitor.health(0.6).ages_s == {"joystick": None, "actuators": None}


@pytest.mark.parametrize("silent", ["joystick", "actuators"])
def test_the_silent_input_is_named(silent: str) -> None:
    monitor = fed()
    other = "joystick" if silent == "actuators" else "actuators"
    monitor.accept(other, 2.0)  # type: ignore[arg-type]
    health = monitor.health(2.0)
    assert health.status is Status.NOT_MONITORING
    assert [(r.code, r.input) for r in health.reasons] == [(f"{silent}_silent", silent)]


def test_back_by_itself() -> None:
    monitor = fed()
    assert monitor.health(3.0).status is Status.NOT_MONITORING
    monitor.accept("joystick", 3.1)
    monitor.accept("actuators", 3.1)
    assert monitor.health(3.1).status is Status.OK


def test_time_outs_are_per_input() -> None:
    monitor = fed(InputConfig(joystick_timeout_s=5.0, actuators_timeout_s=0.2))
    assert codes(monitor, 1.3) == ["actuators_silent"]


def test_an_on_change_joystick_may_be_silent() -> None:
    monitor = fed(InputConfig(joystick_on_change=True))
    monitor.accept("actuators", 60.0)
    assert monitor.health(60.0).status is Status.OK


def test_an_on_change_joystick_whose_token_is_gone_is_not() -> None:
    monitor = fed(InputConfig(joystick_on_change=True))
    monitor.joystick_alive(alive=True)
    assert monitor.health(1.1).status is Status.OK
    monitor.joystick_alive(alive=False)
    assert codes(monitor, 1.1) == ["joystick_gone"]
    assert monitor.health(1.1).status is Status.NOT_MONITORING


def test_an_on_change_joystick_never_heard_is_degraded() -> None:
    monitor = InputMonitor(InputConfig(joystick_on_change=True), start_s=0.0)
    monitor.accept("actuators", 1.0)
    assert monitor.health(1.0).status is Status.DEGRADED
    assert codes(monitor, 1.0) == ["joystick_unknown"]


def test_a_refusal_is_counted_named_and_forgiven() -> None:
    monitor = fed(InputConfig(joystick_timeout_s=100, actuators_timeout_s=100))
    for _ in range(3):
        monitor.reject("joystick", "bad_json", 1.0)
    monitor.accept("joystick", 1.1)
    health = monitor.health(2.0)
    assert health.status is Status.DEGRADED
    assert health.rejected == {("joystick", "bad_json"): 3}
    assert [r.code for r in health.reasons] == ["joystick_bad_json"]
    assert monitor.health(7.0).status is Status.OK
    assert monitor.health(7.0).rejected == {("joystick", "bad_json"): 3}


@pytest.mark.parametrize("name", ["joystick", "actuators"])
@pytest.mark.parametrize("on_change", [False, True])
def test_an_input_of_which_nothing_is_fit_is_not_waited_for(
    name: InputName, *, on_change: bool
) -> None:
    patient = InputConfig(
        joystick_timeout_s=100, actuators_timeout_s=100, joystick_on_change=on_change
    )
    monitor = fed(patient)
    for k in range(3):
        monitor.reject(name, "stamp_jump", 1.05 + 0.01 * k)
    assert monitor.health(1.2).status is Status.DEGRADED
    health = monitor.health(1.21)
    assert health.status is Status.NOT_MONITORING
    assert health.reasons[0].code == f"{name}_refused"
    monitor.accept(name, 1.3)
    assert monitor.health(1.3).status is Status.DEGRADED


def test_two_refused_in_a_row_are_a_gap() -> None:
    monitor = fed(InputConfig(joystick_timeout_s=100, actuators_timeout_s=100))
    monitor.reject("actuators", "stamp_back", 1.1)
    monitor.reject("actuators", "stamp_back", 1.2)
    assert monitor.health(5.0).status is Status.DEGRADED


def test_many_refusals_stop_the_learning_for_a_while() -> None:
    monitor = InputMonitor(InputConfig(), start_s=0.0)
    for k in range(100):
        monitor.accept("joystick", k * 0.05)
        if k % 5 == 0:
            monitor.reject("joystick", "axis_out_of_range", k * 0.05)
    assert not monitor.plausible(5.0)
    assert "implausible" in codes(monitor, 5.0)
    for k in range(300):
        monitor.accept("joystick", 5.0 + k * 0.05)
    assert monitor.plausible(20.0)


def test_an_unanswered_sweep_is_told() -> None:
    monitor = fed()
    monitor.sweep_unknown(1.0)
    assert codes(monitor, 1.1) == ["sweep_unknown"]


def test_before_the_first_data_nothing_is_monitored_but_no_fault_is_told_yet() -> None:
    monitor = InputMonitor(InputConfig(), start_s=0.0)
    first = monitor.health(0.01)
    assert (first.status, first.starting) == (Status.NOT_MONITORING, True)
    assert not monitor.health(0.6).starting
    monitor.accept("joystick", 0.1)
    assert not monitor.health(0.2).starting


def test_primitives_that_cannot_be_degrade_until_one_can() -> None:
    monitor = fed()
    for refusal in ("wrong_actuator", "outlier", "incomplete", "wrong_actuator"):
        monitor.lesson(refusal)
    assert codes(monitor, 1.1) == []
    monitor.lesson("no_motion")
    assert codes(monitor, 1.1) == ["primitives_refused"]
    assert "no_motion, wrong_actuator" in monitor.health(1.1).reasons[0].text
    monitor.lesson(None)
    assert codes(monitor, 1.1) == []


def streams(lag_s: dict[str, float], config: InputConfig | None = None) -> InputMonitor:
    """Both at 50 Hz for 2 s, stamped by one clock far from ours; one told of what was before."""
    monitor = InputMonitor(config or InputConfig(), start_s=100.0)
    for k in range(100):
        now_s = 100.0 + 0.02 * k
        monitor.accept("joystick", now_s, 5000.0 + now_s - lag_s.get("joystick", 0.0))
        monitor.accept("actuators", now_s, 5000.0 + now_s - lag_s.get("actuators", 0.0))
    return monitor


@pytest.mark.parametrize("late", ["joystick", "actuators"])
def test_an_input_that_keeps_coming_but_tells_of_long_ago_is_not_fresh(late: str) -> None:
    health = streams({late: 2.5}).health(102.0)
    assert health.status is Status.NOT_MONITORING
    (reason,) = health.reasons
    assert (reason.code, reason.input) == (f"{late}_late", late)
    assert "lag 2.5 s behind" in reason.text
    assert health.ages_s[late] == pytest.approx(2.52)  # type: ignore[index]


def test_the_age_of_an_input_is_its_arrival_s_and_its_lag() -> None:
    monitor = streams({"joystick": 0.3}, InputConfig(joystick_timeout_s=0.5))
    assert monitor.health(102.0).status is Status.OK
    monitor.accept("actuators", 102.25, 5102.25)
    assert codes(monitor, 102.25) == ["joystick_late"]  # neither of both alone is too long
    monitor.accept("actuators", 102.6, 5102.6)
    assert codes(monitor, 102.6) == ["joystick_silent"]


def test_one_that_catches_up_is_believed_at_once() -> None:
    monitor = streams({"joystick": 2.5})
    monitor.accept("joystick", 102.0, 5102.0)
    assert monitor.health(102.0).status is Status.OK


@pytest.mark.parametrize("unstamped", ["joystick", "actuators", "both"])
def test_where_a_message_has_no_stamp_its_arrival_counts(unstamped: str) -> None:
    monitor = InputMonitor(InputConfig(), start_s=100.0)
    for now_s in (100.0, 100.1):
        for name, stamp_s in (("joystick", 1.0), ("actuators", 900.0)):
            told = None if unstamped in {name, "both"} else stamp_s
            monitor.accept(name, now_s, told)  # type: ignore[arg-type]
    assert monitor.health(100.1).status is Status.OK


def test_a_late_word_of_an_on_change_joystick_is_told_and_does_not_blind_for_ever() -> None:
    monitor = InputMonitor(InputConfig(joystick_on_change=True), start_s=100.0)
    monitor.accept("actuators", 101.0, 101.0)
    monitor.accept("joystick", 101.0, 98.0)
    for now_s, expected in ((101.0, ["joystick_late"]), (105.0, ["joystick_late"]), (107.0, [])):
        monitor.accept("actuators", now_s, now_s)
        assert codes(monitor, now_s) == expected


def test_messages_that_came_too_fast_degrade_and_say_how_many() -> None:
    monitor = fed()
    for k in range(1000):  # half a second at 2 kHz
        monitor.reject("joystick", "overload", 1.0 + k / 2000)
    monitor.accept("joystick", 1.5)
    monitor.accept("actuators", 1.5)
    health = monitor.health(1.5)
    assert health.status is Status.DEGRADED
    (reason,) = health.reasons
    assert (reason.code, reason.input) == ("overload", "joystick")
    assert "1000 messages beyond 1000/s" in reason.text
    for k in range(2000):
        monitor.reject("joystick", "overload", 1.5 + k / 2000)
    (reason,) = [r for r in monitor.health(2.5).reasons if r.code == "overload"]
    assert "messages/s" in reason.text
    assert float(reason.text.split()[1]) == pytest.approx(2000, rel=0.01)
    assert monitor.health(2.5).rejected["joystick", "overload"] == 3000


def test_what_was_lost_to_a_flood_says_nothing_of_the_columns() -> None:
    monitor = fed()
    for _ in range(1000):
        monitor.reject("joystick", "overload", 1.0)
    assert monitor.plausible(1.0)
    monitor.accept("joystick", 8.0)
    monitor.accept("actuators", 8.0)
    assert monitor.health(8.0).status is Status.OK  # and it is over when it is over


def test_both_inputs_may_be_late_alike() -> None:
    """A network that stood still hands on what it kept of both: no lag between them tells it."""
    monitor = streams({})
    for name in ("joystick", "actuators"):
        monitor.accept(name, 110.0, 5102.0, late_s=8.0)
    health = monitor.health(110.0)
    assert [reason.code for reason in health.reasons] == ["actuators_late", "joystick_late"]
    assert "8.0 s late by their stamps" in health.reasons[0].text
    assert health.ages_s["actuators"] == pytest.approx(8.0)
    for name in ("joystick", "actuators"):
        monitor.accept(name, 110.01, 5110.01, late_s=0.0)  # type: ignore[arg-type]
    assert monitor.health(110.01).status is Status.OK
