"""Where an object that moves may be: grown by its age, and nowhere known when it is silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.config import InputConfig
from rampe_guard.core.moving import MovingObjects
from rampe_guard.core.sender_clock import SenderClock
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, ObjectSample, Placement
from tests.support.movers import at, seen, truck

AHEAD_S = 1.7e9
"""The senders' clock against ours."""


def objects(*names: str) -> MovingObjects:
    return MovingObjects([truck(name) for name in names or ("truck",)], InputConfig())


def take(moving: MovingObjects, *samples: ObjectSample) -> list[str]:
    """Feed samples; returns the reasons of those that were refused."""
    _, refused = moving.take(Inputs(objects=samples), samples[-1].arrival_s)
    return [event.reason for event in refused]


def placed(moving: MovingObjects, now_s: float, name: str = "truck") -> Placement:
    found = moving.placements(now_s)[name]
    assert found is not None
    return found


def codes(moving: MovingObjects, now_s: float) -> list[str]:
    return [reason.code for reason in moving.weaknesses(now_s)]


def arm(stamp_s: float, arrival_s: float) -> ActuatorSample:
    return ActuatorSample(stamp_s, np.zeros(1), None, arrival_s)


def test_before_its_first_pose_nobody_knows_where_it_is() -> None:
    moving = objects("truck", "van")
    assert moving.placements(0.0) == {"truck": None, "van": None}
    (first, _) = moving.weaknesses(0.0)
    assert (first.code, first.input, first.key) == ("object_silent", None, "site/truck/pose")
    assert first.text == "no good pose of truck on site/truck/pose yet: taken as contact"
    take(moving, seen(3.0, 1.0, name="van"))
    assert moving.placements(1.0)["truck"] is None
    assert placed(moving, 1.0, "van").pose[0, 3] == 3.0


def test_it_grows_by_its_speed_until_it_is_too_old() -> None:
    moving = objects()
    take(moving, seen(3.0, 10.0))
    assert placed(moving, 10.0).grown_m == 0.0
    assert placed(moving, 10.4).grown_m == pytest.approx(0.8)
    assert placed(moving, 11.0).grown_m == pytest.approx(2.0)
    assert moving.placements(11.01) == {"truck": None}
    assert codes(moving, 10.9) == []
    (reason,) = moving.weaknesses(11.01)
    assert reason.code == "object_silent"
    assert reason.text == (
        "no good pose of truck on site/truck/pose for more than 1 s: taken as contact"
    )
    take(moving, seen(3.5, 12.0))
    assert placed(moving, 12.0).grown_m == 0.0
    assert codes(moving, 12.0) == []


def test_the_newest_pose_counts() -> None:
    moving = objects()
    assert take(moving, seen(1.0, 1.0), seen(1.1, 1.1), seen(1.05, 1.05)) == ["stamp_back"]
    assert placed(moving, 1.1).pose[0, 3] == 1.1
    (health,) = moving.health(1.1)
    assert (health.accepted, health.rejected) == (2, {"stamp_back": 1})
    assert codes(moving, 6.0) == ["object_silent", "object_stamp_back"]
    assert codes(moving, 6.2) == ["object_silent"]  # told for five seconds


def test_a_stamp_from_the_future_is_refused() -> None:
    moving = objects()
    assert take(moving, seen(0.0, 1.0), seen(0.1, 9.0, 1.1)) == ["stamp_jump"]
    assert placed(moving, 1.1).pose[0, 3] == 0.0


def test_a_sender_that_started_anew_is_taken_up_after_the_time_out() -> None:
    moving = objects()
    take(moving, seen(0.0, 100.0, 1.0))
    reasons = [take(moving, seen(5.0, 0.1 * k, 1.0 + 0.1 * k)) for k in range(1, 12)]
    assert reasons == [["stamp_back"]] * 10 + [[]]
    assert placed(moving, 2.1).pose[0, 3] == 5.0
    assert "object_too_fast" not in codes(moving, 2.1)


@pytest.mark.parametrize(
    ("pose", "reason"),
    [
        (np.eye(3), "wrong_length"),
        (np.eye(4) * np.nan, "not_finite"),
        (np.diag([2.0, 1.0, 1.0, 1.0]), "bad_rotation"),
        (np.diag([-1.0, 1.0, 1.0, 1.0]), "bad_rotation"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "bad_rotation"),
    ],
)
def test_what_is_no_pose_is_refused_and_counted(pose: FloatArray, reason: str) -> None:
    moving = objects()
    sample = replace(seen(0.0, 1.0), pose=pose)
    assert take(moving, sample) == [reason]
    assert moving.placements(1.0) == {"truck": None}
    assert moving.health(1.0)[0].rejected == {reason: 1}


def test_messages_that_were_no_pose_at_all_are_counted() -> None:
    moving = objects("truck", "van")
    moving.take(Inputs(objects_rejected=(("van", "bad_json"), ("van", "bad_json"))), 1.0)
    assert [h.rejected for h in moving.health(1.0)] == [{}, {"bad_json": 2}]
    texts = [r.text for r in moving.weaknesses(1.0)]
    assert "2 poses of van refused: bad_json" in texts


def test_an_object_that_the_scene_does_not_know_is_a_mistake() -> None:
    with pytest.raises(ValueError, match=r"object 'ship' has no key in this scene \(truck\)"):
        take(objects(), seen(0.0, 1.0, name="ship"))


def test_a_pose_that_waited_is_as_old_as_its_stamp_says() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.0), restarted=False)
    take(moving, seen(0.0, AHEAD_S + 9.6, 10.0))
    assert placed(moving, 10.0).grown_m == pytest.approx(0.8)
    assert placed(moving, 10.5).grown_m == pytest.approx(1.8)
    assert moving.placements(10.7) == {"truck": None}


def test_stamps_of_another_clock_are_told() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.0), restarted=False)
    take(moving, seen(0.0, AHEAD_S - 20.0, 10.0))
    assert moving.placements(10.0) == {"truck": None}
    (reason,) = moving.weaknesses(10.0)
    assert reason.code == "object_late"
    assert "are 30.0 s behind the actuators by their stamps" in reason.text
    assert codes(moving, 11.5) == ["object_silent"]


def test_a_pose_that_is_a_little_newer_than_the_newest_position_is_fresh() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.1), restarted=False)
    for k, early_s in enumerate((0.0, 0.1, 0.29)):  # shorter ways than the actuators' own
        now_s = 10.0 + k
        take(moving, seen(0.0, AHEAD_S + now_s - 0.1 + early_s, now_s))
        assert placed(moving, now_s).grown_m == 0.0
        assert codes(moving, now_s) == []


def test_a_clock_that_is_ahead_is_told_and_places_nothing() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.0), restarted=False)
    take(moving, seen(8.0, AHEAD_S + 9.9, 10.0))
    reasons = []
    for k in range(1, 30):  # an hour ahead, and steadily so
        now_s = 10.0 + 0.1 * k
        moving.follow(arm(AHEAD_S + now_s, now_s), restarted=False)
        reasons += take(moving, seen(8.0, AHEAD_S + now_s + 3600.0, now_s))
    assert set(reasons) == {"stamp_jump"}  # for as long as its time-out, then it is taken...
    assert moving.health(now_s)[0].accepted > 10
    assert moving.placements(now_s) == {"truck": None}  # ...and believed in nothing
    assert moving.health(now_s)[0].grown_m is None
    assert moving.restless("truck", now_s)
    reason = moving.weaknesses(now_s)[0]
    assert (reason.code, reason.key) == ("object_early", "site/truck/pose")
    assert "are 3600.0 s ahead of the actuators by their stamps" in reason.text
    assert "do both come from one clock?" in reason.text
    assert "object_silent" in codes(moving, now_s + 1.01)


def test_the_first_pose_of_all_may_not_come_from_the_future_either() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.0), restarted=False)
    assert take(moving, seen(8.0, AHEAD_S + 10.4, 10.0)) == []
    assert moving.placements(10.0) == {"truck": None}
    assert codes(moving, 10.0) == ["object_early"]


def test_a_clock_that_was_seen_ahead_makes_no_delayed_pose_young() -> None:
    moving = objects()
    for k in range(20):  # two seconds ahead at first; then its poses wait two seconds on their way
        now_s = 10.0 + 0.1 * k
        moving.follow(arm(AHEAD_S + now_s, now_s), restarted=False)
        early_s = 2.0 if k < 5 else 2.0 - 0.05 * (k - 5)
        assert take(moving, seen(8.0, AHEAD_S + now_s + early_s, now_s)) == []
        assert moving.placements(now_s) == {"truck": None}
        assert codes(moving, now_s) == ["object_early"]


def test_a_clock_that_was_set_right_is_believed_again() -> None:
    moving = objects()
    for k in range(40):
        now_s = 10.0 + 0.125 * k
        moving.follow(arm(AHEAD_S + now_s, now_s), restarted=False)
        take(moving, seen(8.0, AHEAD_S + now_s + (5.0 if k < 20 else 0.0), now_s))
        assert (moving.placements(now_s)["truck"] is None) is (k < 28)  # refused for its time-out


def test_a_machine_that_fell_silent_is_no_exact_clock() -> None:
    def early_s(stamp_s: float, arrival_s: float) -> float | None:
        clock = SenderClock().followed(AHEAD_S + 10.0, 10.0)
        return clock.early_s(SenderClock().followed(AHEAD_S + stamp_s, arrival_s))

    assert early_s(10.31, 10.0) == pytest.approx(0.31)
    assert early_s(1010.31, 1010.0) is None  # 0.3 s after 17 minutes
    assert early_s(1011.5, 1010.0) == pytest.approx(1.5)


def test_without_a_stamp_the_arrival_counts() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S + 10.0, 10.0), restarted=False)
    take(moving, replace(seen(0.0, 10.0), stamped=False))
    assert placed(moving, 10.2).grown_m == pytest.approx(0.4)


def test_a_machine_without_stamps_leaves_the_arrival_to_count() -> None:
    moving = objects()
    moving.follow(replace(arm(10.0, 10.0), stamped=False), restarted=False)
    take(moving, seen(0.0, AHEAD_S, 10.0))
    assert placed(moving, 10.2).grown_m == pytest.approx(0.4)


def test_one_late_position_does_not_make_old_poses_young() -> None:
    clock = SenderClock().followed(AHEAD_S + 10.0, 10.0)
    clock = clock.followed(AHEAD_S + 10.1, 10.9)  # 0.8 s on the way
    assert clock.measured_s(AHEAD_S + 10.5, 11.0) == pytest.approx(10.5, abs=2e-3)


def test_clocks_that_drift_apart_are_followed() -> None:
    clock = SenderClock()
    for k in range(200_000):  # 33 minutes at 100 Hz, the sender losing 0.5 ms a second
        clock = clock.followed(AHEAD_S + 0.01 * k * (1.0 - 5e-4), 0.01 * k)
    assert clock.measured_s(AHEAD_S + 2000.0 * (1.0 - 5e-4), 2000.0) == pytest.approx(2000.0)


def test_a_machine_that_started_anew_brings_its_own_clock() -> None:
    moving = objects()
    moving.follow(arm(AHEAD_S, 9.8), restarted=False)
    moving.follow(arm(5.0, 10.0), restarted=True)
    take(moving, seen(0.0, 4.9, 10.0))  # measured at 9.9
    assert placed(moving, 10.2).grown_m == pytest.approx(0.6)


def test_what_is_faster_than_its_settings_say_is_taken_and_told() -> None:
    moving = objects()
    take(moving, seen(0.0, 1.0), seen(0.35, 1.1))
    assert codes(moving, 1.1) == []  # 2 m/s for 0.1 s, and as much for the jitter
    take(moving, seen(1.35, 1.2))
    assert placed(moving, 1.2).pose[0, 3] == 1.35
    (reason,) = moving.weaknesses(1.2)
    assert reason.code == "object_too_fast"
    assert reason.text == "truck went 1 m in 0.1 s, max_speed is 2 m/s"
    take(moving, seen(1.35, 6.3))
    assert codes(moving, 6.3) == []


def test_it_is_at_rest_once_it_was_seen_standing() -> None:
    moving = objects()
    assert moving.restless("truck", 0.0)  # anywhere
    assert not moving.restless("wall", 0.0)
    for k in range(30):
        take(moving, seen(3.0 + 0.005 * (k % 2), 1.0 + 0.1 * k))  # a tremble is no motion
        assert moving.restless("truck", 1.0 + 0.1 * k) is (k < 20)
    assert moving.restless("truck", 3.9 + 0.51)  # unseen for half a second


@pytest.mark.parametrize("pose", [at(3.03), at(3.0, yaw=0.01)])
def test_it_is_restless_again_when_it_moves(pose: FloatArray) -> None:
    moving = objects()
    for k in range(30):
        take(moving, seen(3.0, 1.0 + 0.1 * k))
    take(moving, seen(pose, 4.0))
    assert moving.restless("truck", 4.1)


def test_creeping_is_motion() -> None:
    moving = objects()
    restless = []
    for k in range(100):
        now_s = 1.0 + 0.1 * k
        take(moving, seen(0.0015 * k, now_s))  # 1.5 cm/s
        restless.append(moving.restless("truck", now_s))
    assert all(restless)
