"""Another scene, and a memory that is wiped, while a guard works."""

from __future__ import annotations

import numpy as np

from rampe_guard.core.alarm import Level, State
from rampe_guard.core.scene import Sphere
from rampe_guard.core.types import Inputs, ObjectSample
from tests.support.core_rig import CoreRig, Wall


def fence(at: float = 1.1, *, moving: bool = False) -> Wall:
    """The wall under another name."""
    return Wall(at=at, name="fence", moving=moving)


def at_rest() -> CoreRig:
    rig = CoreRig()
    rig.hold(0.0, 1.0)
    assert rig.alerts() == []
    return rig


def test_a_wall_that_comes_is_evaluated_though_nothing_moves() -> None:
    rig = at_rest()
    for _ in range(20):
        rig.tick(0.5, speed=0.0)  # pushed, and held by something
    assert rig.alerts() == []
    rig.guard.change_scene(Wall(at=0.12), ["wall"])
    rig.now += 0.01
    events = rig.guard.step(Inputs(), rig.now)  # no new position
    assert [(e.zone, e.level) for e in events] == [("wall", Level.IMMINENT)]  # type: ignore[union-attr]


def test_the_alert_of_a_wall_that_goes_ends_as_all_do() -> None:
    rig = CoreRig()
    rig.hold(0.8, 1.3)
    rig.hold(0.0, 0.1)
    raised = rig.alerts()[-1]
    assert raised.level is Level.IMMINENT
    rig.guard.change_scene(fence(at=1.9), ["fence"])
    assert [a.zone for a in rig.guard.snapshot(rig.now).alerts] == ["wall"]  # not gone silently
    rig.events.clear()
    rig.hold(0.0, 3.0)
    ended = rig.alerts()
    assert [a.level for a in ended] == [Level.CLEAR]
    assert (ended[0].alert_id, ended[0].quality) == (raised.alert_id, "good")
    assert ended[0].now_s - raised.changed_s >= 1.0  # minimum-on
    assert rig.guard.snapshot(rig.now).alerts == ()
    rig.hold(0.8, 1.0)
    rig.hold(0.0, 0.1)
    assert rig.alerts("fence")[-1].level is Level.IMMINENT


def test_a_contact_with_a_wall_that_goes_still_waits_for_someone() -> None:
    rig = CoreRig()
    rig.hold(0.8, 1.6)  # into the wall itself
    assert rig.alerts()[-1].level is Level.IMMINENT
    rig.guard.change_scene(fence(at=9.0), ["fence"])
    rig.hold(0.0, 3.0)
    assert (rig.alerts()[-1].level, rig.alerts()[-1].state) == (Level.CLEAR, State.RTN_UNACKED)
    (waiting,) = rig.guard.snapshot(rig.now).alerts
    rig.guard.acknowledge(waiting.alert_id, "ann", rig.now)
    assert rig.guard.snapshot(rig.now).alerts == ()


def test_a_wall_that_comes_back_is_alarmed_anew() -> None:
    rig = CoreRig()
    rig.hold(0.8, 1.3)
    rig.hold(0.0, 0.1)
    first = rig.alerts()[-1].alert_id
    rig.guard.change_scene(fence(at=9.0), ["fence"])
    rig.hold(0.0, 3.0)
    rig.guard.change_scene(Wall(), ["wall"])
    rig.hold(0.3, 0.1)
    assert rig.alerts()[-1].level is Level.IMMINENT
    assert rig.alerts()[-1].alert_id != first


def truck(max_speed: float = 1.0) -> Sphere:
    return Sphere(
        name="truck",
        margin_m=0.0,
        key="a/truck",
        max_speed=max_speed,
        radius_m=1.0,
        center_m=(0, 0, 0),
    )


def placed(rig: CoreRig) -> bool:
    (health,) = rig.guard.snapshot(rig.now).health.objects
    return health.grown_m is not None


def test_an_object_that_stays_is_still_where_it_was_seen() -> None:
    rig = at_rest()
    rig.guard.change_scene(fence(moving=True), ["fence"], [truck()])
    assert not placed(rig)
    sample = ObjectSample("truck", np.eye(4), rig.now, rig.now, stamped=False)
    rig.guard.step(Inputs(objects=(sample,)), rig.now)
    assert placed(rig)
    rig.guard.change_scene(fence(moving=True), ["fence"], [truck()])
    assert placed(rig)
    rig.guard.change_scene(fence(moving=True), ["fence"], [truck(max_speed=2.0)])  # by other rules
    assert not placed(rig)


def test_what_was_learned_is_forgotten_and_learned_anew() -> None:
    rig = CoreRig()
    rig.strokes(4)
    assert rig.guard.rampe.categories
    assert rig.guard.situations.count > 0
    rig.guard.forget()
    assert not rig.guard.rampe.categories
    assert rig.guard.situations.count == 0
    rig.strokes(2)
    assert rig.guard.rampe.categories[(1,)] == 2
    assert rig.guard.situations.count > 0
