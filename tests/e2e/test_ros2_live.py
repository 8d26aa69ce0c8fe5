"""``replay --live`` puts a log on the topics of ROS 2 as drivers would, for whoever listens."""

from __future__ import annotations

from pathlib import Path

import pytest
import zenoh

from rampe_guard.ros2.attachment import Attachment, unpacked
from rampe_guard.ros2.inputs import JointReader, decode_joy
from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.bench_log import write_log
from tests.support.ears import open_session
from tests.support.processes import Process
from tests.support.ros2 import LIMITS, bench_in_ros2

pytestmark = pytest.mark.e2e


def test_a_log_is_played_as_ros_2(tmp_path: Path) -> None:
    path, endpoint = bench_in_ros2(tmp_path), processes.free_endpoint()
    site, log = load_site(path), write_log(tmp_path / "log.csv", 1, 5)
    heard: dict[str, list[tuple[bytes, Attachment | None]]] = {}

    def hear(sample: zenoh.Sample) -> None:
        attached = None if sample.attachment is None else unpacked(sample.attachment.to_bytes())
        found = heard.setdefault(str(sample.key_expr), [])
        found.append((sample.payload.to_bytes(), attached))

    arguments: list[str | Path] = ["-m", "rampe_guard", "replay", path, log]
    arguments += ["--live", "--speed", "40", "--connect", endpoint]
    with processes.router(tmp_path, endpoint), open_session(endpoint) as session:
        keep = [
            session.declare_subscriber(key, hear)
            for key in (site.keys.joystick, site.keys.actuators)
        ]
        with Process(tmp_path, "replay", arguments) as player:
            player.wait_for("rows sent", 60.0)
        assert keep
    levers, joints = heard[site.keys.joystick], heard[site.keys.actuators]
    assert len(levers) == len(joints) > 50
    reader = JointReader(site.arm.joints[:4], LIMITS)
    for number, ((lever, _), (moved, attached)) in enumerate(zip(levers, joints, strict=True)):
        assert decode_joy(lever, 4).stamp == reader(moved).stamp
        assert attached is not None
        assert attached.sequence == number + 1
