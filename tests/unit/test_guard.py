"""`Guard.step` on a one-joint machine with zones in closed form, so every fraction is known."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.alarm import Level, State
from rampe_guard.core.config import InputConfig
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent, RefusalEvent
from rampe_guard.core.monitor import Status
from rampe_guard.core.types import ActuatorSample, Certificate, Inputs, JoystickSample
from tests.support.core_rig import CONFIG, DT, Wall
from tests.support.core_rig import CoreRig as Rig


def first(times: Iterable[float]) -> float:
    return next(iter(times))


def test_an_unknown_operator_is_warned_before_the_wall() -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 2.0)
    raised = rig.alerts()[0]
    entered = first(t for t, q in rig.trace if q >= 1.0)
    assert (raised.level, raised.evidence.source) == (Level.IMMINENT, "stopping")
    assert entered - raised.now_s > 0.3
    assert raised.evidence.time_to_collision_s == pytest.approx(entered - raised.now_s, abs=0.1)


def test_a_known_operator_is_warned_earlier() -> None:
    rig = Rig()
    rig.strokes(4, length=1.2)
    rig.hold(0.5, 2.4)
    entered = first(t for t, q in reversed(rig.trace) if q < 1.0)
    raised = [a for a in rig.alerts() if a.previous_level is Level.CLEAR][-1]
    assert raised.evidence.source in {"intent", "next"}
    assert raised.level in {Level.CAUTION, Level.WARNING}
    assert entered - raised.now_s > 1.0
    assert [a.level for a in rig.alerts()][-1] is Level.IMMINENT


def test_memory_tells_in_how_many_similar_situations_it_came_to_contact() -> None:
    rig = Rig()
    rig.strokes(4, length=1.2)
    rig.hold(0.0, 2.0)
    rig.events.clear()
    rig.hold(0.5, 1.0)
    told = [e for e in rig.events if isinstance(e, AlertEvent) and e.evidence.source == "next"]
    assert (told[-1].evidence.similar, told[-1].evidence.met) == (4, 4)
    assert told[-1].evidence.onward is not None
    risk = rig.guard.snapshot(rig.now).risks[0]
    assert risk.probability > 0.8
    assert risk.within == tuple(sorted(risk.within))


def test_what_the_operator_always_ends_in_time_is_no_alarm_but_the_unavoidable_is() -> None:
    rig = Rig()
    rig.strokes(10, length=0.85)  # the stopping path touches in the end, and he always stops
    assert Level.IMMINENT not in [a.level for a in rig.alerts() if a.now_s > rig.now / 2.0]
    rig.hold(0.0, 2.0)
    rig.events.clear()
    rig.hold(0.5, 2.4)  # this time he does not
    entered = first(t for t, q in reversed(rig.trace) if q < 1.0)
    raised = next(a for a in rig.alerts() if a.level is Level.IMMINENT)
    assert entered - raised.now_s > 0.1


def test_an_operator_who_stops_short_is_left_in_peace() -> None:
    rig = Rig()
    rig.strokes(8, length=0.6)
    assert all(alert.level <= Level.CAUTION for alert in rig.alerts())
    rig.events.clear()
    rig.strokes(4, length=0.6)
    assert rig.alerts() == []


def test_backing_out_is_never_alarmed_and_ends_the_alert() -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.3)  # into the margin
    assert rig.alerts()[-1].level is Level.IMMINENT
    rig.hold(0.0, 1.5)
    assert rig.alerts()[-1].level is Level.CLEAR
    rig.events.clear()
    rig.hold(-0.8, 1.0)
    assert rig.alerts() == []


def test_who_stands_in_an_object_is_not_clear_of_it_until_he_has_left() -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.5)  # into the wall itself
    assert rig.alerts()[-1].level is Level.IMMINENT
    rig.hold(0.0, 3.0)
    told = rig.alerts()[-1]
    assert (told.level, told.state) == (Level.CAUTION, State.UNACKED)
    assert (told.evidence.source, told.link) == ("contact", "arm")
    rig.events.clear()
    rig.hold(-0.2, 0.4)  # on the way out, still in it
    assert rig.alerts() == []
    rig.hold(-0.8, 1.5)
    told = rig.alerts()[-1]
    assert (told.level, told.state) == (Level.CLEAR, State.RTN_UNACKED)
    assert all(e.level is not Level.IMMINENT for e in rig.alerts())


def test_a_guard_that_starts_inside_an_object_says_so() -> None:
    rig = Rig()
    rig.q = 1.3
    rig.hold(0.0, 1.0)
    assert [(e.level, e.evidence.source) for e in rig.alerts()] == [(Level.CAUTION, "contact")]


def test_primitives_are_learned_and_told() -> None:
    rig = Rig()
    rig.strokes(4)
    assert rig.guard.rampe.categories == {(1,): 4, (-1,): 4}
    started, ended = rig.predictions("started"), rig.predictions("ended")
    assert [e.prediction.category for e in ended[:2]] == [(1,), (-1,)]
    assert all(e.learned for e in ended)
    np.testing.assert_allclose(ended[0].prediction.progress, [0.8], atol=0.05)
    assert started[0].prediction.mean is None
    known = started[-1].prediction.mean
    assert known is not None
    np.testing.assert_allclose(known, [-0.8], atol=0.2)
    assert rig.predictions("updated")


def test_the_same_inputs_give_the_same_events() -> None:
    def run() -> str:
        rig = Rig()
        rig.strokes(3, 1.2)
        rig.hold(0.8, 2.0)
        rig.hold(None, 1.0, arm=False)
        return repr(rig.events)

    assert run() == run()


@pytest.mark.parametrize(
    ("silence", "code"),
    [
        (lambda rig: rig.hold(None, 1.0), "joystick_silent"),
        (lambda rig: rig.hold(0.8, 1.0, arm=False), "actuators_silent"),
    ],
)
def test_silence_freezes_alerts_and_says_so(silence: Callable[[Rig], None], code: str) -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.1)
    (before,) = rig.alerts()
    rig.events.clear()
    silence(rig)
    health = rig.guard.snapshot(rig.now).health
    assert health.status is Status.NOT_MONITORING
    assert code in [r.code for r in health.reasons]
    assert rig.alerts() == []
    repeats = rig.alerts(kind="repeat")
    assert repeats[-1].quality == "stale"
    assert repeats[-1].level is before.level
    (system,) = rig.alerts(SYSTEM_ZONE)
    assert (system.level, system.evidence.source) == (Level.WARNING, "system")
    rig.hold(0.0, 3.0)
    assert rig.guard.snapshot(rig.now).health.status is Status.OK
    assert rig.alerts(SYSTEM_ZONE)[-1].state is State.RTN_UNACKED
    assert rig.alerts()[-1].quality == "good"


def test_a_primitive_with_a_gap_is_not_learned() -> None:
    rig = Rig()
    rig.hold(0.0, 0.3)
    rig.hold(0.5, 0.4)
    rig.hold(None, 1.0, arm=False)
    rig.hold(0.5, 0.2)
    rig.hold(0.0, 0.3)
    assert rig.guard.rampe.categories == {}
    assert [e.learned for e in rig.predictions("ended")] == [False]


def test_refused_messages_are_counted_and_taint_the_primitive() -> None:
    rig = Rig()
    rig.hold(0.0, 0.3)
    rig.hold(0.5, 0.2)
    rig.tick(7.0, speed=0.5)
    rig.guard.step(Inputs(rejected=(("actuators", "bad_json"),)), rig.now)
    rig.hold(0.5, 0.2)
    rig.hold(0.0, 0.3)
    health = rig.guard.snapshot(rig.now).health
    assert health.rejected == {
        ("joystick", "axis_out_of_range"): 1,
        ("actuators", "bad_json"): 1,
    }
    assert health.status is Status.DEGRADED
    assert rig.guard.rampe.categories == {}
    (told,) = [e for e in rig.events if isinstance(e, RefusalEvent)]
    assert told == RefusalEvent("joystick", "axis_out_of_range", "axis 0 is 7")


@pytest.mark.parametrize("answer", [Certificate.UNKNOWN])
def test_a_sweep_without_an_answer_never_reads_as_clear(answer: Certificate) -> None:
    rig = Rig(Wall(answer=answer))
    rig.hold(0.0, 0.3)
    (raised,) = rig.alerts()
    assert raised.level is Level.IMMINENT
    assert raised.quality == "degraded"
    assert "sweep_unknown" in [r.code for r in rig.guard.snapshot(rig.now).health.reasons]


def test_active_alerts_are_repeated_at_5_hz() -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.4)
    raised = rig.alerts()[0].now_s
    told = [
        e.now_s
        for e in rig.events
        if isinstance(e, AlertEvent) and e.zone == "wall" and e.now_s >= raised
    ]
    gaps = np.diff([*told, rig.now])
    assert gaps.max() <= 0.2 + DT
    assert [e.seq for e in rig.events if isinstance(e, AlertEvent)] == list(range(1, len(told) + 1))


def test_touching_latches_until_someone_has_seen_it() -> None:
    rig = Rig()
    rig.hold(0.0, 0.5)
    rig.hold(0.8, 1.8)  # through the margin and into the wall itself
    rig.hold(-0.8, 2.5)
    last = rig.alerts()[-1]
    assert (last.level, last.state) == (Level.CLEAR, State.RTN_UNACKED)
    assert rig.guard.acknowledge("nobody.knows.1", "ann", rig.now) == ()
    (seen,) = rig.guard.acknowledge(last.alert_id, "ann", rig.now)
    assert isinstance(seen, AlertEvent)
    assert (seen.state, seen.acked_by) == (State.NORMAL, "ann")


def test_a_restarted_sender_is_followed_again_and_old_models_stay() -> None:
    rig = Rig()
    rig.strokes(3)
    learned = dict(rig.guard.rampe.categories)
    shift = 1000.0
    for k in range(80):
        now = rig.now + 0.02 * (k + 1)
        stick = JoystickSample(now + shift, np.array([0.0]), now)
        arm = ActuatorSample(now + shift, np.array([0.0]), None, now)
        rig.guard.step(Inputs((stick,), (arm,)), now)
        rig_now = now
    health = rig.guard.snapshot(rig_now).health
    assert health.rejected[("actuators", "stamp_jump")] >= 20
    assert health.status is Status.DEGRADED
    assert rig.guard.rampe.categories == learned


def test_snapshot_before_any_data() -> None:
    snapshot = Rig().guard.snapshot(0.1)
    assert snapshot.position is None
    assert snapshot.alerts == ()
    assert snapshot.prediction is None


def test_an_on_change_lever_needs_no_repetition() -> None:
    config = replace(CONFIG, inputs=InputConfig(joystick_on_change=True))
    rig = Rig(config=config)
    rig.tick(0.0)
    rig.hold(None, 2.0)
    rig.tick(0.8)
    for _ in range(60):
        rig.tick(None, speed=0.8)
    assert rig.guard.snapshot(rig.now).health.status is Status.OK
    assert rig.alerts()[0].level is Level.IMMINENT


def test_a_machine_that_is_parked_is_not_warned_of_what_it_did_before() -> None:
    rig = Rig()
    rig.strokes(6, length=1.2)
    rig.hold(0.0, 8.0)
    assert rig.alerts()[-1].level is Level.CLEAR
