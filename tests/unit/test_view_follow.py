"""Messages of the contract become a screen: real structs, encoded and decoded."""

from __future__ import annotations

from typing import Any

import pytest
from msgspec import structs

from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level
from rampe_guard.core.config import ActuatorConfig
from rampe_guard.view import follow
from rampe_guard.view.state import ViewState
from rampe_guard.wire import (
    ActuatorsMessage,
    Alert,
    Heartbeat,
    InputAges,
    InputRates,
    JoystickMessage,
    Prediction,
    Reason,
    State,
    decode,
    encode,
)
from tests.support import messages

ACTUATORS = (
    ActuatorConfig("swing", 1, 1, 0.8, 1.2, 0.12, 0.08, "rad"),
    ActuatorConfig("boom", 0, -1, 0.3, 1.0, 0.16, 0.08, "m"),
)
HEARTBEAT = structs.replace(
    messages.HEARTBEAT,
    input_age_s=InputAges(joystick_s=0.01, actuators_s=None),
    rates_hz=InputRates(joystick=50.0, actuators=None),
)
ALERT = structs.replace(messages.ALERT, alert_id="boot-1-wall-1")
PREDICTION = Prediction(
    boot_id="boot-1",
    seq=1,
    site="quarry-north",
    machine="excavator-7",
    event="started",
    category=(1, -1),
    observations=12,
    mean={"swing": 0.7, "boom": -0.1},
    scale={"swing": 0.1, "boom": 0.02},
    dof={"swing": 9.0, "boom": 9.0},
    start={"swing": 0.1, "boom": 0.8},
    endpoint={"swing": 0.8, "boom": 0.7},
    progress={"swing": 0.0, "boom": 0.0},
    displacement=None,
    learned=None,
    any_path=None,
    sweeps=(),
    stamp=12.0,
    published_unix_s=1e9,
)


def fresh() -> ViewState:
    limits = [(None, float("inf")), (0.0, 1.2)]
    return follow.begin("excavator-7", "quarry-north", ACTUATORS, limits, 10.0)


def at(now_s: float, message: Heartbeat = HEARTBEAT) -> Heartbeat:
    """A heartbeat that a guard sends at a time of ours."""
    return structs.replace(message, uptime_s=now_s, published_unix_s=1e9 + now_s - 10.0)


def heard(now_s: float) -> ViewState:
    """A guard that has told its state."""
    message = structs.replace(messages.STATE, heartbeat=at(now_s), alerts=(), predictions=())
    return follow.on_state(fresh(), message, now_s)


def sent(alert: Alert) -> Alert:
    return decode(encode(alert), Alert)


def alerts(*changes: dict[str, object]) -> ViewState:
    state = heard(10.0)
    for i, change in enumerate(changes):
        now_s = 10.0 + 0.1 * i
        message = sent(structs.replace(ALERT, **{"uptime_s": now_s, **change}))
        state = follow.on_alert(state, message, now_s)
    return state


def texts(state: ViewState) -> list[str]:
    return [event.text for event in state.events]


def test_before_the_first_message_nobody_is_protected() -> None:
    state = fresh()
    assert state.protection is Protection.UNAVAILABLE
    assert state.position_stale
    assert (state.actuators[0].lower, state.actuators[0].upper) == (None, None)
    assert state.actuators[1].upper == 1.2


def test_levers_are_shown_in_the_direction_of_the_actuator() -> None:
    state = follow.on_joystick(fresh(), JoystickMessage(axes=(0.5, -0.25)), 10.2)
    assert [a.command for a in state.actuators] == [-0.25, -0.5]
    assert not state.command_stale
    assert follow.at(state, 11.3).command_stale


def test_positions_with_and_without_velocity() -> None:
    state = follow.on_actuators(
        fresh(), ActuatorsMessage(position=(0.1, 0.2), velocity=(0.3, 0.4)), 10.2
    )
    assert [(a.position, a.velocity) for a in state.actuators] == [(0.1, 0.3), (0.2, 0.4)]
    state = follow.on_actuators(state, ActuatorsMessage(position=(0.5, 0.6)), 10.3)
    assert [(a.position, a.velocity) for a in state.actuators] == [(0.5, None), (0.6, None)]


def test_a_prediction_is_shown_until_its_primitive_ends() -> None:
    state = follow.on_prediction(fresh(), PREDICTION, 10.1)
    boom = state.actuators[1]
    assert (boom.sign, boom.displacement, boom.spread, boom.endpoint) == (-1, -0.1, 0.02, 0.7)
    assert state.observations == 12
    ended = structs.replace(PREDICTION, event="ended", displacement={"swing": 0.7, "boom": -0.1})
    state = follow.on_prediction(state, ended, 10.2)
    assert {(a.sign, a.displacement) for a in state.actuators} == {(0, None)}
    assert state.prediction_received_s is None


def test_a_primitive_seen_too_seldom_has_a_direction_but_no_prediction() -> None:
    young = structs.replace(PREDICTION, mean=None, scale=None, dof=None, endpoint=None)
    state = follow.on_prediction(fresh(), young, 10.1)
    assert [a.sign for a in state.actuators] == [1, -1]
    assert state.actuators[0].displacement is None
    assert state.prediction_received_s is None


def test_health_comes_from_the_heartbeat_and_its_changes_are_told() -> None:
    state = heard(10.0)
    assert state.protection is Protection.MONITORING
    assert state.health is not None
    assert (state.health.loop_p99_ms, state.health.sweep_p50_ms) == (4.2, None)
    lost = structs.replace(
        HEARTBEAT,
        status="not_monitoring",
        reasons=(Reason(code="joystick_stale", text="no joystick for 0.7 s"),),
    )
    state = follow.on_heartbeat(state, at(10.2, lost), 10.2)
    assert state.protection is Protection.NOT_MONITORING
    state = follow.on_heartbeat(state, at(10.4), 10.4)
    assert texts(state) == ["monitoring again", "NOT MONITORING: no joystick for 0.7 s"]


def test_a_guard_that_falls_silent_is_told_once_and_so_is_its_return() -> None:
    state = heard(10.0)
    for tenths in range(1, 30):
        state = follow.at(state, 10.0 + tenths / 10)
    assert texts(state) == ["PROTECTION UNAVAILABLE: no message from the guard for 1.1 s"]
    assert state.events[0].lost
    state = follow.on_heartbeat(state, at(13.0), 13.0)
    assert len(texts(state)) == 1  # alerts may stand that were never told
    assert state.protection is Protection.UNAVAILABLE
    state = follow.on_heartbeat(follow.at(state, 13.3), at(13.3), 13.3)
    assert texts(follow.at(state, 13.6))[0] == "monitoring again"


def test_a_heartbeat_that_was_kept_on_its_way_is_as_old_as_it_is() -> None:
    state = follow.at(heard(10.0), 20.0)
    for late in (11.0, 15.0, 18.9):
        state = follow.on_heartbeat(state, at(late), 20.0)
    assert state.protection is Protection.UNAVAILABLE
    assert state.silence_s == pytest.approx(1.1, abs=0.02)
    assert state.why.startswith("no message from the guard for 1.1 s")


def test_an_alert_that_was_kept_on_its_way_is_stale() -> None:
    old = structs.replace(ALERT, uptime_s=11.0, published_unix_s=1e9 + 1.0)
    state = follow.on_alert(follow.at(heard(10.0), 20.0), sent(old), 20.0)
    assert state.alerts[0].stale(20.0)


def test_a_guard_that_is_never_heard_is_told_after_a_second() -> None:
    assert texts(follow.at(fresh(), 10.9)) == []
    state = follow.at(follow.at(fresh(), 11.1), 12.0)
    assert texts(state) == ["PROTECTION UNAVAILABLE: no message from the guard yet"]


def test_not_monitoring_is_told_once_though_alert_and_heartbeat_say_it() -> None:
    said: dict[str, Any] = {
        "source": "system",
        "zone": None,
        "link": None,
        "text": "NOT MONITORING: joystick",
    }
    state = alerts(said)
    assert texts(state) == []
    assert [a.text for a in state.alerts] == ["NOT MONITORING: joystick"]
    lost = Reason(code="joystick_silent", text="joystick silent")
    beat = structs.replace(HEARTBEAT, status="not_monitoring", reasons=(lost,))
    state = follow.on_heartbeat(state, at(10.2, beat), 10.2)
    state = follow.on_alert(state, sent(structs.replace(ALERT, **said)), 10.3)
    state = follow.on_heartbeat(state, at(10.4), 10.4)
    over = structs.replace(ALERT, **said, level="clear", state="normal")
    state = follow.on_alert(state, sent(over), 10.4)
    assert texts(state) == ["monitoring again", "NOT MONITORING: joystick silent"]


def test_a_crash_is_told_though_the_guard_monitors_again() -> None:
    crash: dict[str, object] = {
        "source": "system",
        "zone": None,
        "level": "caution",
        "text": "guard restarted",
    }
    assert texts(alerts(crash)) == ["system: guard restarted"]


def test_a_machine_that_is_off_is_no_loss() -> None:
    off = Reason(code="machine_off", text="the machine is switched off")
    beat = structs.replace(HEARTBEAT, status="not_monitoring", reasons=(off,))
    state = follow.on_heartbeat(follow.on_heartbeat(fresh(), HEARTBEAT, 10.0), beat, 10.2)
    assert state.protection is Protection.MACHINE_OFF
    assert texts(state) == ["machine switched off: not monitored"]
    assert not state.events[0].lost
    both = structs.replace(beat, reasons=(off, Reason(code="canary_failed", text="wrong")))
    assert follow.on_heartbeat(state, both, 10.4).protection is Protection.NOT_MONITORING


def test_shelving_and_acknowledging_are_told() -> None:
    until: dict[str, object] = {
        "inhibit": "shelved",
        "shelved_by": "ann",
        "shelved_until_unix_s": 1e9 + 20.0,
    }
    state = alerts({}, until, until, {}, {"state": "acked", "acked_by": "bob"})
    assert texts(state)[:3] == [
        "wall: seen by bob",
        "wall: no longer shelved",
        "wall: shelved by ann for 20 s",
    ]
    (alert,) = alerts(until).alerts
    assert alert.shelved_left_s(15.0) == pytest.approx(15.0)
    assert not alert.flashes


def test_an_alert_rises_and_clears() -> None:
    state = alerts({}, {"level": "imminent", "text": "bucket → wall in 0.4 s"})
    assert [(a.zone, a.level) for a in state.alerts] == [("wall", Level.IMMINENT)]
    cleared = sent(structs.replace(ALERT, level="clear", state="normal"))
    state = follow.on_alert(state, cleared, 11.0)
    assert state.alerts == ()
    assert texts(state) == [
        "wall: clear",
        "wall: bucket → wall in 0.4 s",
        "wall: bucket → wall in 1.4 s",
    ]


def test_a_repeat_tells_nothing_new_but_keeps_the_alert_fresh() -> None:
    state = alerts({}, {}, {})
    assert len(state.events) == 1
    assert state.alerts[0].sent_s == pytest.approx(10.2)


def test_a_contact_tells_the_lead_of_its_warning_once() -> None:
    state = alerts(
        {},
        {"level": "imminent", "published_unix_s": 1e9 + 0.5},
        {"level": "imminent", "source": "contact", "published_unix_s": 1e9 + 0.84},
        {"level": "imminent", "source": "contact", "published_unix_s": 1e9 + 1.04},
    )
    assert texts(state)[0] == "wall: entered; warned 0.84 s ahead"
    assert sum("entered" in text for text in texts(state)) == 1


def test_a_contact_without_a_warning_says_so() -> None:
    state = alerts({"level": "imminent", "source": "contact"})
    assert texts(state) == ["wall: inside the margin"]
    # A caution long before is no warning.
    state = alerts({"level": "caution"}, {"level": "imminent", "source": "contact"})
    assert texts(state)[0] == "wall: inside the margin"


def test_quality_state_and_system_alerts_are_kept() -> None:
    state = alerts({"quality": "stale", "state": "acked"})
    assert not state.alerts[0].trusted
    assert not state.alerts[0].attention
    state = alerts({"zone": None, "source": "system", "level": "clear", "state": "rtn_unacked"})
    assert state.alerts[0].zone == "system"
    assert state.alerts[0].gone


def test_a_restarted_guard_takes_its_old_alerts_with_it() -> None:
    state = alerts({})
    state = follow.on_heartbeat(state, structs.replace(HEARTBEAT, boot_id="boot-2"), 11.0)
    assert state.alerts == ()
    assert "the guard restarted" in texts(state)


def test_who_comes_late_catches_up_from_the_state_message() -> None:
    message = State(heartbeat=HEARTBEAT, alerts=(ALERT,), predictions=(PREDICTION,), position=None)
    state = follow.on_state(fresh(), decode(encode(message), State), 10.0)
    assert state.protection is Protection.MONITORING
    assert len(state.alerts) == 1
    assert state.observations == 12


def test_events_are_bounded() -> None:
    state = fresh()
    for i in range(200):
        state = follow.add_event(state, Level.CLEAR, str(i))
    assert len(state.events) == 50
    assert state.events[0].text == "199"


def test_what_memory_says_of_an_alert_is_taken_over() -> None:
    known = {"source": "next", "similar_situations": 8, "similar_contacts": 6}
    assert [a.times for a in alerts(known).alerts] == [(6, 8)]
    assert [a.times for a in alerts({}).alerts] == [None]
