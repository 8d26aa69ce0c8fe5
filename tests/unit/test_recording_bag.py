"""ROS bags, written by rosbags, are read as our own recordings of the same work are."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from rampe_guard.core.types import Inputs
from rampe_guard.errors import LogError
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.recording import open_log
from rampe_guard.recording.writer import Head
from rampe_guard.ros2 import cdr
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, STRING, RosType
from tests.support.processes import BENCH
from tests.support.recording_files import START_NS, entry, write
from tests.support.ros2 import LIMITS, angles_of, bench_in_ros2, joint_state, joy

BEGIN_S = START_NS / 1e9
WORK = [
    (0.05 * i, (-0.5 if i < 30 else 0.0, 0.0, 0.0, 0.0), 1.0 - 0.02 * min(i, 11)) for i in range(60)
]


def write_bag(
    path: Path, plugin: StoragePlugin, messages: list[tuple[float, str, RosType, bytes]]
) -> Path:
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        made = {}
        for at_s, topic, kind, payload in messages:
            if topic not in made:
                made[topic] = writer.add_connection(topic, kind.name, typestore=cdr.store())
            writer.write(made[topic], START_NS + round(at_s * 1e9), payload)
    return path


def work(site: Site) -> list[tuple[float, str, RosType, bytes]]:
    words = cdr.encode(cdr.make(STRING.name, data="x" * 300), STRING)
    found = [(0.0, "/rosout", STRING, words)]
    for t, axes, swing in WORK:
        angles = angles_of(site, (swing, 0.065, 0.08, 0.03))
        found.append((t, "/joy", JOY, joy(axes, BEGIN_S + t)))
        found.append((t, "/excavator/joint_states", JOINT_STATE, joint_state(angles, BEGIN_S + t)))
    return [*found, (3.5, "/rosout", STRING, words)]


def json_log(folder: Path) -> Path:
    site = load_site(BENCH)
    entries = [entry(site, 0.0, "enabled", {"enabled": True})] if site.keys.enabled else []
    for t, axes, swing in WORK:
        stamp = BEGIN_S + t
        position = [swing, 0.065, 0.08, 0.03]
        entries.append(entry(site, t, "joystick", {"stamp": stamp, "axes": axes}))
        entries.append(entry(site, t, "actuators", {"stamp": stamp, "position": position}))
    return write(site, folder / "json.mcap", [entries], Head({}, {}))


def told(steps: Iterator[tuple[float, Inputs]]) -> list[object]:
    return [
        (round(at_s, 9), [s.axes.tolist() for s in i.joystick], len(i.actuators), i.rejected)
        for at_s, i in steps
        if i.joystick or i.actuators or i.rejected
    ]


@pytest.mark.parametrize("kind", ["sqlite3", "mcap", "db3 alone", "mcap alone"])
def test_a_bag_is_the_same_log_as_our_own(tmp_path: Path, kind: str) -> None:
    site = load_site(bench_in_ros2(tmp_path))
    plugin = StoragePlugin.MCAP if kind.startswith("mcap") else StoragePlugin.SQLITE3
    path = write_bag(tmp_path / "bag", plugin, work(site))
    if kind.endswith("alone"):
        path = next(p for p in path.iterdir() if p.suffix in {".db3", ".mcap"})
    bag = open_log(site, path, LIMITS)
    ours = open_log(load_site(BENCH), json_log(tmp_path), LIMITS)
    assert bag.warnings == ()
    assert told(bag.steps()) == told(ours.steps())
    np.testing.assert_allclose(bag.position, ours.position, atol=1e-12)
    np.testing.assert_array_equal(bag.time_s, ours.time_s)
    assert bag.epoch_s == BEGIN_S
    assert list(bag.steps())[-1][0] > 3.4  # silence after the inputs' last is replayed


def test_a_bag_gives_the_alerts_of_the_same_work_in_json(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", StoragePlugin.MCAP, work(load_site(bench_in_ros2(tmp_path))))
    said = [
        [json.loads(line) for line in replay_offline(str(site), str(log), StopFlag(), repeats=True)]
        for site, log in ((bench_in_ros2(tmp_path), bag), (BENCH, json_log(tmp_path)))
    ]
    last_s = BEGIN_S + WORK[-1][0]  # the bag goes on a little
    ours, theirs = (
        [(a["published_unix_s"], a["zone"], a["level"], a["state"], a["source"]) for a in alerts]
        for alerts in said
    )
    assert ("crate", "imminent") in {(zone, level) for _, zone, level, *_ in ours}
    assert [a for a in ours if a[0] <= last_s] == theirs


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    site = load_site(bench_in_ros2(tmp_path))
    good = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3, work(site))
    with pytest.raises(LogError, match="does not say which topics count; write format: ros2"):
        open_log(load_site(BENCH), good, LIMITS)

    swapped = [(t, topic, STRING, data) for t, topic, _, data in work(site) if topic == "/joy"]
    bag = write_bag(tmp_path / "swapped", StoragePlugin.SQLITE3, swapped)
    with pytest.raises(LogError, match="/joy is std_msgs/msg/String, not sensor_msgs/msg/Joy"):
        open_log(site, bag, LIMITS)

    others = [item for item in work(site) if item[1] == "/rosout"]
    bag = write_bag(tmp_path / "others", StoragePlugin.SQLITE3, others)
    with pytest.raises(LogError, match=re.escape("none of its topics is an input") + ".*/rosout"):
        open_log(site, bag, LIMITS)

    only = [item for item in work(site) if item[1] == "/joy"]
    bag = write_bag(tmp_path / "only", StoragePlugin.MCAP, only)
    assert open_log(site, bag, LIMITS).warnings == (f"{bag}: there is no message of the actuators",)

    file = next(good.glob("*.db3"))
    content = file.read_bytes()
    file.write_bytes(content[:5000] + bytes(len(content) - 5000))
    with pytest.raises(LogError, match=str(file.parent)):
        list(open_log(site, good, LIMITS).steps())
    (good / "metadata.yaml").write_text("rosbag2_bagfile_information: [", "utf-8")
    with pytest.raises(LogError, match="cannot be read as a ROS bag"):
        open_log(site, good, LIMITS)
