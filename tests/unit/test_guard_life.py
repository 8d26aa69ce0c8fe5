"""Shelving, and the machine that is switched off, through `Guard.step`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.alarm import Inhibit, Level, State
from rampe_guard.core.config import InputConfig, NextConfig
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent, RefusalEvent
from rampe_guard.core.monitor import RECENT_S, Status
from rampe_guard.core.types import EnabledSample, Inputs
from rampe_guard.errors import RefusedError
from tests.support.core_rig import CONFIG, DT, CoreRig

ENABLED_S = 2.0
KEYED = replace(CONFIG, inputs=InputConfig(enabled_timeout_s=ENABLED_S))


def codes(rig: CoreRig) -> list[str]:
    return [reason.code for reason in rig.guard.snapshot(rig.now).health.reasons]


def status(rig: CoreRig) -> Status:
    return rig.guard.snapshot(rig.now).health.status


def warned() -> CoreRig:
    """An operator who is known, on his way to the wall: warned, not yet imminent."""
    # without what memory foresees, which would warn while he still rests
    rig = CoreRig(config=replace(CONFIG, next=NextConfig(enabled=False)))
    rig.strokes(4, length=1.2)
    rig.events.clear()
    while not any(a.level is Level.WARNING for a in rig.alerts()):
        rig.tick(0.5)
        assert rig.q < 1.0, "never warned"
    return rig


def at_the_wall(config: InputConfig | None = None) -> CoreRig:
    """At rest in the margin with the lever let go; the alert is not yet over."""
    rig = CoreRig(config=KEYED if config is None else replace(CONFIG, inputs=config))
    rig.says = True
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.3)
    rig.hold(0.0, 0.1)
    assert rig.alerts()[-1].level is Level.IMMINENT
    return rig


def test_a_shelved_warning_breaks_through_when_it_becomes_imminent() -> None:
    rig = warned()
    alert_id = rig.alerts()[-1].alert_id
    (told,) = rig.guard.shelve(alert_id, "ann", 20.0, rig.now)
    assert (told.kind, told.level, told.inhibit) == ("transition", Level.WARNING, Inhibit.SHELVED)
    assert (told.shelved_by, told.shelved_until_s) == ("ann", rig.now + 20.0)
    (late,) = rig.guard.snapshot(rig.now).alerts
    assert (late.inhibit, late.shelved_by) == (Inhibit.SHELVED, "ann")
    rig.tick(0.5)
    rig.hold(0.5, 0.3)
    assert {a.inhibit for a in rig.alerts(kind="repeat") if a.now_s > told.now_s} == {
        Inhibit.SHELVED
    }
    while rig.alerts()[-1].level is not Level.IMMINENT:
        rig.tick(0.5)
    risen = rig.alerts()[-1]
    assert (risen.alert_id, risen.state, risen.inhibit) == (alert_id, State.UNACKED, Inhibit.NONE)
    with pytest.raises(RefusedError, match="imminent"):
        rig.guard.shelve(alert_id, "ann", 1.0, rig.now)
    rig.hold(0.0, 3.0)
    assert {a.inhibit for a in rig.alerts() if a.now_s >= risen.now_s} == {Inhibit.NONE}


def test_silence_ends_by_itself_even_when_the_guard_cannot_see() -> None:
    rig = warned()
    alert_id, shelved_s = rig.alerts()[-1].alert_id, rig.now
    rig.guard.shelve(alert_id, "ann", 3.0, rig.now)
    rig.events.clear()
    rig.hold(None, 4.0, arm=False)
    (over,) = rig.alerts()
    assert over.now_s == pytest.approx(shelved_s + 3.0, abs=1.5 * DT)
    assert (over.level, over.state, over.quality) == (Level.WARNING, State.UNACKED, "stale")
    assert (over.inhibit, over.shelved_by, over.shelved_until_s) == (Inhibit.NONE, None, None)


def test_silence_can_be_ended_and_what_is_not_there_cannot_be_shelved() -> None:
    rig = warned()
    alert_id = rig.alerts()[-1].alert_id
    with pytest.raises(RefusedError, match="not shelved"):
        rig.guard.shelve(alert_id, "ann", 0.0, rig.now)
    rig.guard.shelve(alert_id, "ann", 5.0, rig.now)
    (told,) = rig.guard.shelve(alert_id, "bob", 0.0, rig.now)
    assert (told.inhibit, told.shelved_by) == (Inhibit.NONE, None)
    with pytest.raises(RefusedError, match=r"no alert 'offline\.wall\.99' is shown"):
        rig.guard.shelve("offline.wall.99", "ann", 5.0, rig.now)


def test_switching_off_ends_the_alert_and_its_silence_is_no_fault() -> None:
    rig = at_the_wall()
    (first,) = {a.alert_id for a in rig.alerts()}
    rig.events.clear()
    rig.says = False
    rig.hold(0.0, 0.6)
    over = rig.alerts()[-1]
    assert (over.alert_id, over.level, over.state) == (first, Level.CLEAR, State.NORMAL)
    assert over.inhibit is Inhibit.MACHINE_OFF
    assert (status(rig), codes(rig)) == (Status.NOT_MONITORING, ["machine_off"])
    rig.events.clear()
    rig.hold(None, 5.0, arm=False)
    assert codes(rig) == ["machine_off"]
    assert not rig.events
    assert not rig.guard.snapshot(rig.now).alerts


def test_it_watches_again_as_soon_as_the_machine_is_on() -> None:
    rig = at_the_wall()
    rig.says = False
    rig.hold(None, 3.0, arm=False)
    rig.events.clear()
    rig.says = True
    rig.hold(None, 0.3, arm=False)  # the inputs take a moment to come
    assert status(rig) is Status.NOT_MONITORING
    assert "machine_off" not in codes(rig)
    assert not rig.alerts(SYSTEM_ZONE)
    rig.hold(0.0, 0.5)
    assert (status(rig), codes(rig)) == (Status.OK, [])
    rig.hold(0.8, 0.3)
    assert rig.alerts()[-1].level is Level.IMMINENT
    assert rig.alerts()[-1].inhibit is Inhibit.NONE


def test_inputs_that_stay_away_after_switching_on_are_alarmed() -> None:
    rig = at_the_wall()
    rig.says = False
    rig.hold(None, 3.0, arm=False)
    rig.says = True
    rig.hold(None, 1.0, arm=False)
    assert rig.alerts(SYSTEM_ZONE)[-1].level is Level.WARNING


def test_an_old_word_reads_as_on() -> None:
    rig = at_the_wall()
    rig.says = False
    rig.hold(None, 3.0, arm=False)
    rig.says = None
    rig.hold(None, ENABLED_S - 0.1, arm=False)
    assert codes(rig) == ["machine_off"]
    rig.hold(None, 1.0, arm=False)
    assert {"actuators_silent", "joystick_silent", "enabled_silent"} <= set(codes(rig))
    assert rig.alerts(SYSTEM_ZONE)[-1].level is Level.WARNING


def test_a_refused_word_reads_as_on_and_is_counted_by_name() -> None:
    rig = at_the_wall()
    now = rig.now
    events = rig.guard.step(Inputs(enabled=(EnabledSample(False, now - 9.0, now),)), now)  # noqa: FBT003
    assert next(e for e in events if isinstance(e, RefusalEvent)).reason == "stamp_back"
    rig.guard.step(Inputs(rejected=(("enabled", "bad_json"),)), now)
    rig.says = None
    rig.hold(0.0, 0.3)
    assert codes(rig) == ["enabled_bad_json", "enabled_stamp_back"]
    assert status(rig) is Status.DEGRADED
    rejected = rig.guard.snapshot(rig.now).health.rejected
    assert rejected == {("enabled", "stamp_back"): 1, ("enabled", "bad_json"): 1}


@pytest.mark.parametrize(
    "then",
    [
        Inputs(rejected=(("enabled", "bad_json"),)),
        Inputs(enabled=(EnabledSample(False, -9.0, 2.0),)),  # noqa: FBT003 - a clock set back
        Inputs(enabled=(EnabledSample(True, -9.0, 2.0),)),  # noqa: FBT003
    ],
    ids=["refused", "stamp back", "on with another stamp"],
)
def test_off_holds_only_until_anything_else_comes(then: Inputs) -> None:
    rig = CoreRig(config=KEYED)
    rig.says = False
    rig.hold(None, 1.0, arm=False)
    assert codes(rig) == ["machine_off"]
    rig.guard.step(then, rig.now)
    assert "machine_off" not in codes(rig)
    assert status(rig) is Status.NOT_MONITORING  # no input has come yet


def test_a_word_that_lags_behind_the_machine_by_its_stamp_is_old() -> None:
    rig = CoreRig(config=KEYED)
    rig.hold(0.0, 3.0)
    late = EnabledSample(enabled=False, stamp_s=rig.now - 2.5, arrival_s=rig.now)
    rig.guard.step(Inputs(enabled=(late,)), rig.now)
    rig.hold(0.0, 0.1)
    (reason,) = rig.guard.snapshot(rig.now).health.reasons
    assert reason.code == "enabled_silent"
    assert "by the stamps of the actuators" in reason.text
    assert status(rig) is Status.DEGRADED


@pytest.mark.parametrize("ahead_s", [0.2, 3600.0])
def test_a_word_from_the_future_reads_as_on(ahead_s: float) -> None:
    rig = CoreRig(config=KEYED)
    rig.hold(0.0, 3.0)
    for _ in range(40):  # whose clock goes on like that
        word = EnabledSample(enabled=False, stamp_s=rig.now + ahead_s, arrival_s=rig.now)
        rig.guard.step(Inputs(enabled=(word,)), rig.now)
        rig.tick(0.0)
    if ahead_s < 1.0:  # jitter
        assert codes(rig) == ["machine_off"]
        return
    (reason,) = rig.guard.snapshot(rig.now).health.reasons
    assert (reason.code, reason.input) == ("enabled_early", "enabled")
    assert "are 3600.0 s ahead of the actuators by their stamps: taken as on" in reason.text
    assert status(rig) is Status.DEGRADED
    rig.guard.step(Inputs(enabled=(replace(word, enabled=True),)), rig.now)
    assert codes(rig) == []


def test_a_key_that_never_speaks_is_told_and_reads_as_on() -> None:
    rig = CoreRig(config=KEYED)
    rig.hold(0.0, ENABLED_S + 0.5)
    assert (status(rig), codes(rig)) == (Status.DEGRADED, ["enabled_silent"])


@pytest.mark.parametrize("sign", ["lever", "motion"])
def test_a_machine_that_works_is_not_off_whatever_it_says(sign: str) -> None:
    rig = CoreRig(config=KEYED)
    rig.says = False
    rig.hold(0.0, 1.5)
    assert codes(rig) == ["machine_off"]
    if sign == "lever":  # held against a stop
        for _ in range(20):
            rig.tick(0.8, speed=0.0)
    else:
        for _ in range(20):
            rig.tick(0.0, speed=0.8)
    assert codes(rig) == ["enabled_contradicted"]
    assert status(rig) is Status.DEGRADED
    rig.hold(0.8, 1.5)
    assert rig.alerts()[-1].level is Level.IMMINENT
    rig.hold(0.0, RECENT_S - 0.5)
    assert codes(rig) == ["enabled_contradicted"]
    rig.hold(0.0, 1.0)
    assert codes(rig) == ["machine_off"]


def test_an_arm_that_runs_out_is_watched_till_it_rests_and_contradicts_nothing() -> None:
    rig = CoreRig(config=KEYED)
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 0.5)
    rig.says = False
    for k in range(25):
        rig.tick(0.0, speed=0.8 * (1 - k / 25))
        assert status(rig) is Status.OK
    rig.hold(0.0, 0.5)
    assert codes(rig) == ["machine_off"]


def test_what_was_touched_stays_until_someone_has_seen_it() -> None:
    rig = CoreRig(config=KEYED)
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.8)  # into the wall itself
    assert rig.alerts()[-1].state is State.UNACKED
    rig.says = False
    rig.hold(0.0, 1.0)
    left = rig.alerts()[-1]
    assert (left.level, left.state) == (Level.CLEAR, State.RTN_UNACKED)
    assert left.inhibit is Inhibit.MACHINE_OFF
    rig.hold(None, 2.0, arm=False)
    (still,) = rig.guard.snapshot(rig.now).alerts
    assert (still.alert_id, still.state) == (left.alert_id, State.RTN_UNACKED)
    (seen,) = rig.guard.acknowledge(left.alert_id, "ann", rig.now)
    assert seen.state is State.NORMAL


def test_a_fault_of_the_guard_is_told_though_the_machine_is_off() -> None:
    rig = CoreRig(config=KEYED)
    rig.says = False
    rig.hold(0.0, 1.0)
    rig.events += rig.guard.step(Inputs(canary="FCL is wrong"), rig.now)
    rig.hold(0.0, 0.2)
    assert "canary_failed" in codes(rig)
    assert rig.alerts(SYSTEM_ZONE)[-1].level is Level.WARNING


def test_not_monitoring_ends_when_the_machine_turns_out_to_be_off() -> None:
    rig = at_the_wall()
    rig.says = None
    rig.hold(None, 1.0, arm=False)
    assert rig.alerts(SYSTEM_ZONE)[-1].inhibit is Inhibit.NONE
    rig.says = False
    rig.hold(None, 2.0, arm=False)
    over = rig.alerts(SYSTEM_ZONE)[-1]
    assert (over.level, over.state, over.inhibit) == (
        Level.CLEAR,
        State.RTN_UNACKED,
        Inhibit.MACHINE_OFF,
    )


def test_numbers_go_up_by_one_and_ids_are_unique_through_all_of_it() -> None:
    rig = at_the_wall()
    for says in (False, True, False, True, False):
        rig.says = says
        rig.hold(0.0, 1.0)
        rig.hold(-0.8 if says else 0.0, 0.5)
        rig.hold(0.8 if says else 0.0, 0.5)
        rig.hold(None, 1.0, arm=False)
    alerts = [e for e in rig.events if isinstance(e, AlertEvent)]
    assert [a.seq for a in alerts] == list(range(1, len(alerts) + 1))
    ended: set[str] = set()
    for alert in alerts:
        assert alert.alert_id not in ended, "an id never comes back"
        if alert.state is State.NORMAL:
            ended.add(alert.alert_id)
    assert len(ended) >= 3
    assert np.all(np.diff([a.now_s for a in alerts]) >= 0.0)
