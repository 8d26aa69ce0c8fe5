"""`Guard.step` with an object that moves: on one axis, in closed form."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from rampe_guard.core.alarm import Level
from rampe_guard.core.config import ActuatorConfig, GuardConfig
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent, Event, RefusalEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.monitor import Status
from rampe_guard.core.types import (
    ActuatorSample,
    Certificate,
    FloatArray,
    Inputs,
    JoystickSample,
    ObjectSample,
    Placement,
    SweepResult,
    ZoneSweep,
)
from tests.support.movers import seen, truck

DT = 0.02
CONFIG = GuardConfig((ActuatorConfig("slide", 0, 1, 1.0, 2.0, 0.1, 0.1, "m"),), axes=1)
LIMITS = np.array([[-2.0, 2.0]])
RADIUS, MARGIN = 0.5, 0.1


class Slide:
    """The arm is the point q of the x axis; the truck a ball on the same axis, beyond it."""

    def __init__(self) -> None:
        self.asked: list[Mapping[str, Placement | None]] = []

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        """Closed form."""
        assert not any_path
        assert not clearance
        assert placed is not None
        self.asked.append(placed)
        if only is not None and "truck" not in only:
            return SweepResult(())
        where = placed["truck"]
        if where is None:
            kind = Certificate.UNKNOWN
            lost = ZoneSweep("truck", kind, 0.0, None, None, None, None, closing=True)
            return SweepResult((lost,))
        edge = float(where.pose[0, 3]) - RADIUS - where.grown_m - MARGIN
        now, way = edge - float(start[0]), float(displacement[0])
        left = now - wider_m
        fraction = 0.0 if left <= 0 else left / way if way >= left > 0 else None
        kind = Certificate.FREE if fraction is None else Certificate.CONTACT
        near = max(now - max(way, 0.0), 0.0)
        zone = ZoneSweep("truck", kind, fraction, "arm", None, near, now, way > 0, MARGIN)
        return SweepResult((zone,))


class Yard:
    """A guard, an arm that follows its lever, and a truck that says where it is."""

    def __init__(self) -> None:
        self.sweeper = Slide()
        self.guard = Guard(CONFIG, LIMITS, self.sweeper, 0.0, moving=[truck(max_speed=2.0)])
        self.q, self.now = 0.0, 0.0
        self.events: list[Event] = []

    def tick(
        self, x: float | None = None, lever: float = 0.0, *, arm: bool = True
    ) -> tuple[Event, ...]:
        """One step; the truck tells that it is at ``x``, unless None."""
        self.now += DT
        self.q += lever * DT
        stick = JoystickSample(self.now, np.array([lever]), self.now)
        arms: tuple[ActuatorSample, ...] = ()
        if arm:
            arms = (ActuatorSample(self.now, np.array([self.q]), None, self.now),)
        poses: tuple[ObjectSample, ...] = () if x is None else (seen(x, self.now),)
        events = self.guard.step(Inputs((stick,), arms, objects=poses), self.now)
        self.events += events
        return events

    def hold(self, seconds: float, x: float | None = None, lever: float = 0.0) -> None:
        for _ in range(round(seconds / DT)):
            self.tick(x, lever)

    def drive(self, start: float, end: float, speed: float) -> None:
        """The truck drives from ``start`` to ``end`` while the arm stands."""
        for x in np.arange(start, end, np.copysign(speed * DT, end - start)):
            self.tick(float(x))

    def transitions(self, zone: str = "truck") -> list[AlertEvent]:
        return [
            e
            for e in self.events
            if isinstance(e, AlertEvent) and e.zone == zone and e.kind == "transition"
        ]

    def codes(self) -> list[str]:
        return [r.code for r in self.guard.snapshot(self.now).health.reasons]


def test_a_truck_nobody_has_seen_is_taken_as_contact_and_named() -> None:
    yard = Yard()
    yard.hold(0.3)
    (raised,) = yard.transitions()
    assert raised.level is Level.IMMINENT
    assert raised.quality == "degraded"
    health = yard.guard.snapshot(yard.now).health
    assert health.status is Status.DEGRADED
    (reason,) = health.reasons  # not a sweep without an answer too
    assert (reason.code, reason.key) == ("object_silent", "site/truck/pose")
    assert [(o.name, o.age_s, o.grown_m, o.accepted) for o in health.objects] == [
        ("truck", None, None, 0)
    ]
    assert yard.transitions(SYSTEM_ZONE) == []  # all else is guarded as before


def test_a_truck_far_away_disturbs_nobody() -> None:
    yard = Yard()
    yard.hold(3.0, x=8.0)
    assert yard.transitions() == []
    health = yard.guard.snapshot(yard.now).health
    assert health.status is Status.OK
    assert health.objects[0].accepted == 150


def test_a_truck_that_drives_up_to_an_arm_at_rest_is_alarmed_at_its_margin() -> None:
    yard = Yard()
    yard.tick(8.0)
    yard.drive(8.0, 0.55, 1.0)
    (raised,) = yard.transitions()
    assert (raised.level, raised.evidence.source) == (Level.IMMINENT, "contact")
    assert raised.quality == "good"
    entered_s = DT + (8.0 - (RADIUS + MARGIN)) / 1.0  # speed 1 m/s
    assert raised.now_s == pytest.approx(entered_s, abs=2 * DT)


def test_a_truck_that_stays_where_it_was_seen_is_like_any_other_object() -> None:
    yard = Yard()
    yard.drive(8.0, 0.55, 1.0)
    assert yard.transitions()[-1].level is Level.IMMINENT
    yard.hold(4.0, x=0.58)  # it stands inside the margin; the arm stands too
    assert yard.transitions()[-1].level is Level.CLEAR
    yard.events.clear()
    yard.hold(0.5, x=0.58, lever=-0.3)  # backing out
    assert yard.transitions() == []
    yard.hold(1.5, x=0.58, lever=0.3)
    assert yard.transitions()[-1].level is Level.IMMINENT


def test_an_arm_that_backs_out_of_a_truck_that_comes_after_it_is_warned() -> None:
    yard = Yard()
    yard.hold(3.0, x=0.55)
    yard.hold(2.0, x=0.55)
    yard.events.clear()
    for k in range(50):
        yard.tick(0.55 - 0.5 * DT * (k + 1), lever=-0.3)
    assert yard.transitions()[0].level is Level.IMMINENT


def test_silence_grows_the_truck_then_makes_it_unknown() -> None:
    yard = Yard()
    yard.hold(3.0, x=2.0)
    assert yard.transitions() == []
    yard.hold(0.6)
    assert yard.transitions() == []  # 2.0 - 0.5 - 0.1 = 1.4 m off, grown by 1.2 m
    yard.hold(0.2)
    (raised,) = yard.transitions()
    assert raised.level is Level.IMMINENT  # it may have come so far
    assert raised.evidence.sweep is not None
    assert raised.evidence.sweep.certificate is Certificate.CONTACT
    assert yard.codes() == []
    yard.hold(0.3)
    assert yard.codes() == ["object_silent"]
    assert yard.guard.snapshot(yard.now).alerts[0].quality == "degraded"
    yard.hold(3.0, x=2.0)
    assert yard.transitions()[-1].level is Level.CLEAR
    assert yard.codes() == []


def test_a_truck_whose_clock_is_an_hour_ahead_is_never_clear() -> None:
    yard = Yard()
    yard.hold(1.0, x=50.0)
    for _ in range(200):
        yard.tick()
        ahead = seen(50.0, yard.now + 3600.0, yard.now)
        yard.events += yard.guard.step(Inputs(objects=(ahead,)), yard.now)
    assert [e.level for e in yard.transitions()] == [Level.IMMINENT]
    health = yard.guard.snapshot(yard.now).health
    assert health.status is Status.DEGRADED
    assert [r.code for r in health.reasons] == ["object_early", "object_stamp_jump"]


def test_a_truck_that_dies_far_away_is_never_clear() -> None:
    yard = Yard()
    yard.hold(1.0, x=50.0)
    yard.hold(2.0)
    assert [e.level for e in yard.transitions()] == [Level.IMMINENT]
    assert yard.transitions()[0].evidence.sweep is not None


def test_new_poses_and_growth_are_swept_between_positions() -> None:
    yard = Yard()
    yard.hold(1.0, x=3.0)
    yard.sweeper.asked.clear()
    for k in range(15):  # 0.3 s without a position, a pose every 40 ms
        yard.tick(3.0 if k % 2 else None, arm=False)
    assert len(yard.sweeper.asked) == 7
    yard.tick(3.0)
    yard.sweeper.asked.clear()
    for _ in range(15):  # nothing new: growth alone
        yard.tick(arm=False)
    grown = [p["truck"].grown_m for p in yard.sweeper.asked if p["truck"] is not None]
    assert grown == pytest.approx([0.2, 0.4, 0.6])


def test_poses_alone_ask_for_fifty_sweeps_a_second_at_most() -> None:
    yard = Yard()
    yard.hold(1.0, x=3.0)
    yard.sweeper.asked.clear()
    for _ in range(200):  # 0.4 s
        yard.now += 0.002
        stick = JoystickSample(yard.now, np.array([0.0]), yard.now)
        yard.guard.step(Inputs((stick,), objects=(seen(3.0, yard.now),)), yard.now)
    assert len(yard.sweeper.asked) == 20


def test_refused_poses_are_told_and_harm_no_lesson() -> None:
    yard = Yard()
    yard.hold(0.5, x=5.0)
    yard.guard.step(Inputs(objects_rejected=(("truck", "bad_json"),)), yard.now)
    old = yard.guard.step(Inputs(objects=(seen(5.0, 0.1, yard.now),)), yard.now)
    assert old == (RefusalEvent("object truck", "stamp_back", "stamp 0.1 after 0.5"),)
    assert yard.codes() == ["object_bad_json", "object_stamp_back"]
    yard.hold(0.5, x=5.0, lever=0.5)
    yard.guard.step(Inputs(objects_rejected=(("truck", "bad_json"),)), yard.now)
    yard.hold(0.5, x=5.0, lever=0.5)
    yard.hold(0.3, x=5.0)
    assert yard.guard.lessons == {"learned": 1}
    assert yard.guard.snapshot(yard.now).health.objects[0].rejected == {
        "bad_json": 2,
        "stamp_back": 1,
    }


def test_while_the_arm_is_unseen_its_alerts_are_frozen_as_ever() -> None:
    yard = Yard()
    yard.drive(4.0, 0.55, 1.0)
    yard.events.clear()
    for _ in range(50):
        yard.tick(8.0, arm=False)
    assert yard.transitions() == []
    assert yard.guard.snapshot(yard.now).health.status is Status.NOT_MONITORING
    frozen = {e.zone: e for e in yard.guard.snapshot(yard.now).alerts}["truck"]
    assert (frozen.level, frozen.quality) == (Level.IMMINENT, "stale")


def test_the_same_inputs_give_the_same_events() -> None:
    def run() -> str:
        yard = Yard()
        yard.drive(4.0, 0.55, 1.0)
        yard.hold(1.5)
        yard.hold(0.5, x=1.0, lever=-0.5)
        return repr(yard.events)

    assert run() == run()


def test_a_pose_that_was_long_on_its_way_is_as_old_as_its_stamp_says() -> None:
    yard, ahead_s = Yard(), 1.7e9

    def step(now_s: float, sent_s: float, ahead_s: float) -> float | None:
        stamp_s = now_s + ahead_s
        stick = JoystickSample(stamp_s, np.zeros(1), now_s)
        arm = ActuatorSample(stamp_s, np.zeros(1), None, now_s)
        pose = seen(3.0, sent_s + ahead_s, now_s)
        yard.guard.step(Inputs((stick,), (arm,), objects=(pose,)), now_s)
        found = yard.sweeper.asked[-1]["truck"]
        return None if found is None else found.grown_m

    assert step(1.0, 0.7, ahead_s) == pytest.approx(0.6)  # 0.3 s old, 2 m/s
    assert step(1.1, 1.1, ahead_s) == pytest.approx(0.0, abs=1e-3)
    # all senders set their clock back, and are taken up again after their time-outs
    late = [step(1.1 + 0.1 * k, 0.9 + 0.1 * k, 5.0) for k in range(1, 25)]
    assert late[8] == pytest.approx(1.8, abs=5e-3)  # the newest good one is 0.9 s old
    assert late[-1] == pytest.approx(0.4, abs=5e-3)
