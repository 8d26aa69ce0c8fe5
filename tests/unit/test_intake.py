"""Zenoh messages to core inputs, on a bus that is made up."""

from __future__ import annotations

import json
import time
from collections import defaultdict
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from rampe_guard.core.types import EnabledSample, Inputs
from rampe_guard.runtime.decoding import decoders_of
from rampe_guard.runtime.intake import Intake
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.worker import arrived
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.runtime.zenoh_queries import Message
from rampe_guard.settings import load_site

SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard, enabled: r/enabled}
arm:
  urdf: arm.urdf
  actuators:
    - {name: swing, joint: swing_joint, max_velocity: 0.6}
scene: scene.yaml
"""
SCENE = """\
objects:
  - {name: wall, type: sphere, radius_m: 1, center: [9, 0, 0]}
  - {name: truck, type: sphere, radius_m: 1, center: [0, 0, 0], key: r/truck, max_speed: 2}
  - {name: van, type: box, size: [1, 1, 1], key: r/van, max_speed: 2}
"""


class Ring:
    """Messages that wait on one key."""

    def __init__(self) -> None:
        self.waiting: list[Message] = []
        self.overruns = 0

    def drain(self) -> list[Message]:
        taken, self.waiting = self.waiting, []
        return taken


class Post:
    """Stands in for the bus: one ring for each key that was subscribed to."""

    def __init__(self) -> None:
        self.rings: defaultdict[str, Ring] = defaultdict(Ring)

    def inbox(self, key: str) -> Ring:
        return self.rings[key]

    def put(self, key: str, body: Any, on: str | None = None) -> None:
        payload = body if isinstance(body, bytes) else json.dumps(body).encode()
        self.rings[key].waiting.append(Message(on or key, payload))


@pytest.fixture
def post() -> Post:
    return Post()


@pytest.fixture
def intake(post: Post, tmp_path: Path) -> Intake:
    (tmp_path / "arm.urdf").write_text("<robot name='arm'/>", encoding="utf-8")
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    site = load_site(tmp_path / "site.yaml")
    decoders = decoders_of(site, np.array([[-1.0, 1.0]]))
    return Intake(cast("Bus", post), site, Sayer("test"), decoders)


def test_only_objects_with_a_key_are_subscribed_to(post: Post, intake: Intake) -> None:
    assert set(post.rings) == {"r/joystick", "r/actuators", "r/enabled", "r/truck", "r/van"}
    assert not arrived(intake.collect(1.0))


def test_poses_become_samples_in_order(post: Post, intake: Intake) -> None:
    turn = [0.0, 0.0, np.sin(0.25), np.cos(0.25)]
    post.put("r/truck", {"stamp": 7.0, "xyz_m": [1, 2, 3], "rpy_rad": [0, 0, 0.5]})
    post.put("r/truck", {"xyz_m": [4, 5, 6], "quaternion_xyzw": turn})
    inputs = intake.collect(12.0)
    assert arrived(inputs)
    first, second = inputs.objects
    assert (first.name, first.stamp_s, first.arrival_s, first.stamped) == ("truck", 7.0, 12.0, True)
    assert (second.stamp_s, second.stamped) == (12.0, False)
    assert first.pose[:3, 3].tolist() == [1, 2, 3]
    assert second.pose[:3, 3].tolist() == [4, 5, 6]
    assert first.pose[3].tolist() == [0, 0, 0, 1]
    c, s = np.cos(0.5), np.sin(0.5)
    assert first.pose[:3, :3] == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    assert second.pose == pytest.approx(
        np.vstack([np.column_stack([first.pose[:3, :3], [4, 5, 6]]), [0, 0, 0, 1]])
    )


def test_roll_pitch_and_yaw_turn_about_fixed_axes(post: Post, intake: Intake) -> None:
    post.put("r/van", {"xyz_m": [0, 0, 0], "rpy_rad": [0.3, -0.4, 0.5]})
    (sample,) = intake.collect(1.0).objects
    (cr, cp, cy), (sr, sp, sy) = np.cos([0.3, -0.4, 0.5]), np.sin([0.3, -0.4, 0.5])
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    assert sample.pose[:3, :3] == pytest.approx(yaw @ pitch @ roll)


def test_what_is_no_pose_is_refused_by_name(post: Post, intake: Intake) -> None:
    good = {"xyz_m": [0, 0, 0], "rpy_rad": [0, 0, 0]}
    post.put("r/truck", b"{")
    post.put("r/van", {"xyz_m": [0, 0, 0]})
    post.put("r/van", good, on="r/*")
    post.put("r/van", good)
    inputs = intake.collect(1.0)
    refused = (("truck", "bad_json"), ("van", "bad_rotation"), ("van", "wildcard_key"))
    assert inputs.objects_rejected == refused
    assert [sample.name for sample in inputs.objects] == ["van"]
    assert inputs.rejected == ()


def test_refusals_alone_wake_the_guard() -> None:
    assert arrived(Inputs(objects_rejected=(("truck", "bad_json"),)))
    assert not arrived(Inputs())


def test_the_enable_key_speaks_in_plain_booleans(post: Post, intake: Intake) -> None:
    post.put("r/enabled", {"enabled": False, "stamp": 7.0})
    post.put("r/enabled", {"enabled": True})
    inputs = intake.collect(12.0)
    assert arrived(inputs)
    assert inputs.enabled == (
        EnabledSample(enabled=False, stamp_s=7.0, arrival_s=12.0),
        EnabledSample(enabled=True, stamp_s=12.0, arrival_s=12.0, stamped=False),
    )


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({"enabled": 0}, "bad_json"),
        ({"enabled": None}, "bad_json"),
        ({"stamp": 1.0}, "bad_json"),
        (b"false", "bad_json"),
        ({"enabled": False, "stamp": 1e15}, "not_finite"),
    ],
)
def test_what_is_no_plain_word_is_refused_and_never_off(
    post: Post, intake: Intake, body: Any, reason: str
) -> None:
    post.put("r/enabled", body)
    inputs = intake.collect(1.0)
    assert (inputs.enabled, inputs.rejected) == ((), (("enabled", reason),))


def test_lost_poses_are_counted(post: Post, intake: Intake) -> None:
    post.rings["r/van"].overruns = 2
    post.rings["r/joystick"].overruns = 1
    assert intake.overruns == 3


def levers(count: int) -> list[dict[str, Any]]:
    return [{"stamp": 1.0 + k * 1e-4, "axes": [k / count]} for k in range(count)]


def test_of_a_flood_the_newest_are_looked_at_and_the_others_counted(
    post: Post, intake: Intake
) -> None:
    for body in levers(1000):
        post.put("r/joystick", body)
    post.put("r/actuators", {"stamp": 1.0, "position": [0.1]})
    now_s = time.monotonic()
    inputs = intake.collect(now_s)
    assert len(inputs.joystick) == 8
    assert inputs.joystick[-1].axes == [0.999]
    assert inputs.joystick[0].axes == [0.992]
    assert inputs.rejected == (("joystick", "overload"),) * 992
    assert len(inputs.actuators) == 1  # which have a budget of their own


def test_a_flood_that_lasts_gets_the_long_run_rate_and_always_the_newest(
    post: Post, intake: Intake
) -> None:
    start_s = time.monotonic()
    seen = lost = 0
    for look in range(1000):  # a second of 10 kHz
        for body in levers(10):
            post.put(
                "r/truck",
                {"stamp": look + body["stamp"], "xyz_m": [look, 0, 0], "rpy_rad": [0, 0, 0]},
            )
        inputs = intake.collect(start_s + look * 1e-3)
        seen += len(inputs.objects)
        lost += len(inputs.objects_rejected)
        assert inputs.objects[-1].pose[0, 3] == look
    assert seen + lost == 10_000
    assert 1000 <= seen <= 1300


def test_a_full_ring_is_a_loss_too(post: Post, intake: Intake) -> None:
    post.put("r/joystick", {"axes": [0.5]})
    post.rings["r/joystick"].overruns = 1
    inputs = intake.collect(1.0)
    assert inputs.rejected == (("joystick", "overload"),)
    assert len(inputs.joystick) == 1
    assert intake.overruns == 1
    assert intake.collect(1.1).rejected == ()


def test_rubbish_on_a_wildcard_takes_nothing_from_the_budget(post: Post, intake: Intake) -> None:
    post.put("r/joystick", {"axes": [0.5]})
    for _ in range(1000):
        post.put("r/joystick", {"axes": [0.1]}, on="r/*")
    inputs = intake.collect(1.0)
    assert [s.axes.tolist() for s in inputs.joystick] == [[0.5]]
    assert set(inputs.rejected) == {("joystick", "wildcard_key")}


def test_a_burst_after_a_network_that_stood_still_is_taken_whole(
    post: Post, intake: Intake
) -> None:
    for body in levers(200):
        post.put("r/joystick", body)
    inputs = intake.collect(time.monotonic())
    assert len(inputs.joystick) == 200
    assert inputs.rejected == ()
