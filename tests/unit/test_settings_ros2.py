"""The ros2 block of a site file: what it makes, and what is told of a wrong one."""

from __future__ import annotations

from pathlib import Path

import pytest

from rampe_guard.errors import SettingsError
from rampe_guard.settings import load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY
from tests.support.ros2 import bench_in_ros2

WHOLE = f"7/arm/joy/{JOY.dds}/{JOY.hash}"


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    path = bench_in_ros2(folder)
    text = path.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, "utf-8")
    return path


def test_a_whole_key_is_taken_as_it_is(tmp_path: Path) -> None:
    site = load_site(changed(tmp_path, ("joystick: /joy", f"joystick: {WHOLE}")))
    assert site.keys.joystick == WHOLE
    assert site.ros2 is not None
    assert site.ros2.joystick_topic == "/arm/joy"
    bridged = changed(tmp_path, ("joystick: /joy", "joystick: robot1/joy"))
    site = load_site(bridged)
    assert site.keys.joystick == "robot1/joy"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("joystick: /joy", "joystick: /9joy"), "keys.joystick: '/9joy' is no ROS 2 topic"),
        (("joystick: /joy", "joystick: /joy/"), "is no ROS 2 topic; give its full name"),
        (
            ("joystick: /joy", f"joystick: 0/joy/{JOINT_STATE.dds}/{JOINT_STATE.hash}"),
            "is of type sensor_msgs::msg::dds_::JointState_, not sensor_msgs::msg::dds_::Joy_",
        ),
        (("joystick: /joy", f"joystick: {WHOLE[:-1]}0"), "has not the hash of sensor_msgs/msg/Joy"),
        (("joystick: /joy", "joystick: /excavator/joint_states"), "axes"),
        (("format: ros2", "format: json"), "ros2: is given, and format is json"),
        (("rmw_zenoh}", "dds}"), "'rmw_zenoh' or 'ros2dds'"),
        (("rmw_zenoh}", "rmw_zenoh, domain: 233}"), "domain"),
        (("rmw_zenoh}", "rmw_zenoh, node: a/b}"), "node"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    path = changed(tmp_path, change)
    if (
        says == "axes"
    ):  # one topic of two types has two keys with rmw_zenoh, and one with the bridge
        load_site(path)
        path.write_text(path.read_text("utf-8").replace("rmw_zenoh}", "ros2dds}"), "utf-8")
        says = "'excavator/joint_states' is also keys.joystick"
    with pytest.raises(SettingsError) as caught:
        load_site(path)
    assert says in str(caught.value)
    assert path.name in str(caught.value)
