"""A guard that hears ROS 2 and nothing else: the same alerts as by JSON, and seen by ROS tools."""

from __future__ import annotations

import contextlib
import json
import math
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from rampe_guard.ros2.attachment import unpacked
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY
from tests.support import processes
from tests.support.ears import Ears
from tests.support.processes import BENCH, Process, until
from tests.support.ros2 import RosEars, angles_of, bench_in_ros2, joint_state, joy
from tests.support.station import REST

pytestmark = pytest.mark.e2e

BASE = "rampe/bench/ros2/guard"
SENDER = ("-m", "tests.support.ros2_sender")


@dataclass
class Stage:
    site: Site
    ros: Ears
    plain: Ears
    diagnostics: RosEars
    markers: RosEars
    sender: Process
    guard: Process

    def protection(self) -> Any:
        return self.diagnostics.all()[-1][2].status[0]

    def rejected(self) -> dict[str, dict[str, int]]:
        (state,) = self.ros.ask(f"{BASE}/state")
        counts: dict[str, dict[str, int]] = state["heartbeat"]["rejected"]
        return counts

    def put(self, key: str, payload: bytes) -> None:
        self.sender.tell(json.dumps({"key": key, "hex": payload.hex()}))


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    """Two guards of the bench, one by ROS 2 and one by JSON; the machine has worked for both."""
    folder = tmp_path_factory.mktemp("ros2")
    path = bench_in_ros2(folder)
    path.write_text(path.read_text("utf-8").replace("rampe/bench/excavator/guard", BASE), "utf-8")
    endpoint = processes.free_endpoint()
    for name in ("a", "b"):
        (folder / name).mkdir()
    with contextlib.ExitStack() as stack:
        stack.enter_context(processes.router(folder, endpoint))
        site = load_site(path)
        ros = stack.enter_context(Ears(endpoint, BASE))
        plain = stack.enter_context(Ears(endpoint, load_site(BENCH).keys.base))
        diagnostics, markers = RosEars(), RosEars()
        keep = [
            ros.session.declare_subscriber("0/diagnostics/*/*", diagnostics.hear),
            ros.session.declare_subscriber("0/rampe_guard/markers/*/*", markers.hear),
        ]
        guard = stack.enter_context(processes.guard(folder / "a", path, endpoint))
        stack.enter_context(processes.guard(folder / "b", BENCH, endpoint))
        sender = stack.enter_context(
            Process(folder, "sender", [*SENDER, endpoint, path, BENCH], talk=True)
        )
        sender.wait_for("done", 40.0)
        yield Stage(site, ros, plain, diagnostics, markers, sender, guard)
        assert "Traceback" not in guard.err, guard.err
        assert keep


GRAVITY = ("clear", "caution", "warning", "imminent")


def episodes(ears: Ears) -> list[tuple[str, str]]:
    """Zones that were alarmed, and how gravely at most, in the order in which they ended.

    How an episode climbs depends on how messages fell into steps; in replay it does not
    (tests/unit/test_recording_bag.py).
    """
    worst: dict[str, str] = {}
    found = []
    for heard in ears.all():
        if heard.topic != "alert" or heard.body["zone"] is None:
            continue
        zone, level = str(heard.body["zone"]), str(heard.body["level"])
        if level != "clear":
            worst[zone] = max(worst.get(zone, level), level, key=GRAVITY.index)
        elif zone in worst:
            found.append((zone, worst.pop(zone)))
    return [*found, *((f"{zone} still", level) for zone, level in sorted(worst.items()))]


def test_ros_2_gives_the_alerts_that_json_gives(stage: Stage) -> None:
    assert any(
        zone.startswith("crate") and worst == "imminent" for zone, worst in episodes(stage.ros)
    )
    assert episodes(stage.ros) == episodes(stage.plain)
    assert stage.rejected() == {}


def test_ros_tools_see_node_and_topics(stage: Stage) -> None:
    tokens = stage.ros.tokens("@ros2_lv/0/**")
    parts = sorted(token.split("/") for token in tokens)
    assert [p[5] for p in parts] == ["NN", "MP", "MP"]
    assert len({p[2] for p in parts}) == 1, "one session"
    assert parts[0][6:] == ["%", "%", "rampe_guard"]
    published = {key for key, _, _ in (*stage.diagnostics.all(), *stage.markers.all())}
    told = {"/".join(["0", p[9].replace("%", "/")[1:], p[10], p[11]]) for p in parts[1:]}
    assert told == published
    for ears in (stage.diagnostics, stage.markers):
        attached = [unpacked(attachment) for _, attachment, _ in ears.all()]
        numbers = [a.sequence for a in attached if a is not None]
        assert numbers == list(range(numbers[0], numbers[0] + len(ears.all())))
        assert len({a.gid for a in attached if a is not None}) == 1


def test_diagnostics_say_what_the_guard_says(stage: Stage) -> None:
    arrays = [said for _, _, said in stage.diagnostics.all()]
    assert {s.name for s in arrays[-1].status} == {"rampe_guard: protection", "rampe_guard: alerts"}
    # an imminent alert is an error, with its words
    loud = [a.status[1] for a in arrays if a.status[1].level == 2]
    assert any("crate (imminent)" in {v.key for v in status.values} for status in loud)
    until(lambda: stage.protection().level == 0, 5.0, "OK with both inputs")
    # never OK while nobody watched: at the beginning there were no inputs
    for array in arrays:
        protection, alerts = array.status
        if protection.message.startswith("NOT MONITORING"):
            assert protection.level in {2, 3}
            assert alerts.level == 3
    assert arrays[0].status[0].message.startswith("NOT MONITORING")


def test_markers_show_zones_and_contact(stage: Stage) -> None:
    arrays = [said.markers for _, _, said in stage.markers.all()]
    spaces = {m.ns for markers in arrays for m in markers}
    assert {"zones", "contacts", "alerts", "banner"} <= spaces
    for markers in arrays:
        for m in markers:
            assert m.header.frame_id == "world"
            turn = m.pose.orientation
            assert math.hypot(turn.x, turn.y, turn.z, turn.w) == pytest.approx(1.0)
            assert m.lifetime.sec + m.lifetime.nanosec > 0
            place = m.pose.position
            assert all(math.isfinite(v) for v in (place.x, place.y, place.z))
    red = [m for markers in arrays for m in markers if m.ns == "zones" and m.color.r > 0.85]
    assert red


def test_what_is_malformed_is_refused_by_its_reason(stage: Stage) -> None:
    keys, angles = stage.site.keys, angles_of(stage.site, REST)
    good = joint_state(angles, time.time())
    other = keys.joystick.replace(JOY.dds, JOINT_STATE.dds).replace(JOY.hash, JOINT_STATE.hash)
    boom = "boom_joint"
    cases = {
        ("actuators", "bad_cdr"): (keys.actuators, good[:20]),
        ("joystick", "bad_cdr"): (keys.joystick, b"\x00\x00" + joy((0.0,) * 4)[2:]),
        ("actuators", "missing_joint"): (keys.actuators, joint_state({boom: 0.0})),
        ("actuators", "duplicate_joint"): (
            keys.actuators,
            joint_state(angles, names=(*angles, boom)),
        ),
        ("actuators", "joint_out_of_reach"): (keys.actuators, joint_state({**angles, boom: 3.0})),
        ("actuators", "not_finite"): (keys.actuators, joint_state({**angles, boom: math.nan})),
        ("actuators", "wrong_hash"): (keys.actuators[:-4] + "0000", good),
        ("joystick", "wrong_type"): (other, good),
        ("joystick", "too_large"): (keys.joystick, joy((0.0,) * 20_000)),
    }
    for key, payload in cases.values():
        stage.put(key, payload)
    for name, reason in cases:
        until(lambda: stage.rejected().get(name, {}).get(reason), 5.0, f"{name} {reason}")  # noqa: B023
    assert sum(sum(counts.values()) for counts in stage.rejected().values()) == len(cases)
    assert stage.guard.alive


def test_what_is_lost_on_the_way_is_counted(stage: Stage) -> None:
    stage.sender.tell(json.dumps({"key": stage.site.keys.joystick, "lose": 7}))

    def told() -> str | None:
        values = {v.key: v.value for v in stage.protection().values}
        return values.get("joystick lost on the way")

    until(lambda: told() == "7", 5.0, lambda: f"7 of joystick lost, not {told()}")
    stage.guard.wait_for("joystick: 7 messages were lost on their way", 5.0)


def test_a_guard_that_ends_leaves_no_ok_behind(stage: Stage) -> None:
    until(lambda: stage.protection().level in {0, 1}, 10.0, "monitoring")
    stage.guard.signal_and_wait(signal.SIGTERM)
    until(lambda: "ended" in stage.protection().message, 5.0, "the guard's last words")
    assert stage.protection().level == 2
    assert stage.diagnostics.all()[-1][2].status[1].level == 3
    assert any(m.text == "NOT MONITORING" for m in stage.markers.all()[-1][2].markers)
    until(lambda: not stage.ros.tokens("@ros2_lv/0/**"), 5.0, "tokens are gone")
