"""``rampe-guard ros2``: topics told, descriptions kept, logs as bags."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
import zenoh.ext
from rosbags.rosbag2 import StoragePlugin, Writer

from rampe_guard.errors import ConnectionFailedError, LogError, MessageError, SettingsError
from rampe_guard.programs.ros2_tools import save_description, topic_lines, write_bag
from rampe_guard.recording import open_log
from rampe_guard.ros2 import cdr
from rampe_guard.settings import load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, STRING, key_of
from tests.support import processes
from tests.support.bench_log import write_log
from tests.support.processes import BENCH
from tests.support.ros2 import bench_in_ros2

URDF = """<robot name="a"><link name="l"><visual><geometry>
<mesh filename="package://arm_description/l.stl"/></geometry></visual></link></robot>"""
TOPIC = "/robot_description"


def description_bag(path: Path, text: str, plugin: StoragePlugin) -> Path:
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        found = writer.add_connection(TOPIC, STRING.name, typestore=cdr.store())
        for number, said in enumerate(("<robot name='old'/>", text)):
            writer.write(
                found, 10**18 + number, cdr.encode(cdr.make(STRING.name, data=said), STRING)
            )
    return path


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_description_is_taken_from_a_bag(tmp_path: Path, plugin: StoragePlugin) -> None:
    bag = description_bag(tmp_path / "bag", URDF, plugin)
    out = tmp_path / "arm.urdf"
    for source in (bag, next(p for p in bag.iterdir() if p.suffix != ".yaml")):
        said = save_description(str(source), str(out), TOPIC, (), 1.0, force=True)
        assert out.read_text("utf-8") == URDF
        assert "1 meshes of arm_description (see arm.package_dirs)" in said
    with pytest.raises(SettingsError, match="exists already"):
        save_description(str(bag), str(out), TOPIC, (), 1.0, force=False)
    with pytest.raises(LogError, match=r"has no std_msgs/msg/String on /other; it has /robot"):
        save_description(str(bag), str(tmp_path / "b.urdf"), "/other", (), 1.0, force=False)
    words = description_bag(tmp_path / "words", "no robot at all", plugin)
    with pytest.raises(MessageError, match="has no <robot>"):
        save_description(str(words), str(tmp_path / "b.urdf"), TOPIC, (), 1.0, force=False)
    assert not (tmp_path / "b.urdf").exists()


@contextlib.contextmanager
def latching_robot(endpoint: str, key: str) -> Iterator[None]:
    """A publisher that keeps its last message, as rmw_zenoh does for transient local."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{endpoint}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("timestamping/enabled", "true")
    with zenoh.open(config) as session:
        publisher = zenoh.ext.declare_advanced_publisher(
            session, key, cache=zenoh.ext.CacheConfig(max_samples=1), publisher_detection=True
        )
        publisher.put(cdr.encode(cdr.make(STRING.name, data=URDF), STRING))
        yield


def test_a_description_is_taken_from_a_live_robot(tmp_path: Path) -> None:
    site, out = bench_in_ros2(tmp_path), tmp_path / "arm.urdf"
    endpoint = processes.free_endpoint()
    key = key_of(TOPIC, STRING, "rmw_zenoh", 0, type_hash=True)
    with processes.router(tmp_path, endpoint):
        with pytest.raises(ConnectionFailedError, match=f"nobody publishes {TOPIC}"):
            save_description(str(site), str(out), TOPIC, (endpoint,), 0.2, force=False)
        with latching_robot(endpoint, key):
            save_description(str(site), str(out), TOPIC, (endpoint,), 10.0, force=False)
    assert out.read_text("utf-8") == URDF
    assert threading.active_count() < 20


def test_topics_are_told(tmp_path: Path) -> None:
    said = "\n".join(topic_lines(str(bench_in_ros2(tmp_path))))
    for word in ("/joy", JOINT_STATE.hash, "/diagnostics", "/rampe_guard/markers", "boom_joint"):
        assert word in said
    with pytest.raises(SettingsError, match="write format: ros2"):
        topic_lines(str(BENCH))


def test_a_log_becomes_a_bag_that_is_the_same_log(tmp_path: Path) -> None:
    site = bench_in_ros2(tmp_path)
    log = write_log(tmp_path / "log.csv", 1, 5)
    said = write_bag(str(site), str(log), str(tmp_path / "bag"))
    limits = np.array([[-3.2, 3.2], [0.0, 0.118], [0.0, 0.145], [0.0, 0.11]])
    ours = open_log(load_site(site), log, limits)
    again = open_log(load_site(site), tmp_path / "bag", limits)
    assert f"{len(ours.time_s)} messages each of /joy and /excavator/joint_states" in said
    np.testing.assert_allclose(again.position, ours.position, atol=1e-9)
    np.testing.assert_allclose(again.axes, ours.axes, atol=1e-6)
    np.testing.assert_allclose(np.diff(again.time_s), np.diff(ours.time_s), atol=1e-6)
    with pytest.raises(LogError, match="cannot be written"):
        write_bag(str(site), str(log), str(tmp_path / "bag"))
