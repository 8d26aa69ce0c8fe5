"""`rampe-guard init` of what speaks ROS 2: bags, topics and joints; live in tests/e2e."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from rampe_guard.cli import main
from rampe_guard.core.drive import CylinderDrive
from rampe_guard.programs.initing_questions import source_asked
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.inverse import Inverse
from rampe_guard.settings import load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY
from tests.support import small_arm
from tests.support.processes import called
from tests.support.ros2 import joint_state, joy


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the URDF, and a log that is none of ROS 2."""
    folder = tmp_path_factory.mktemp("init")
    small_arm.write_urdf(folder)
    small_arm.write_log(folder / "log.csv", small_arm.ticks(rate_hz=25.0)[:100])
    return folder


def _init(place: Path, out: Path, *more: str) -> tuple[int, str, str]:
    done = called("init", place / "small_arm.urdf", "--out", out, "--yes", *more)
    return done.returncode, done.stdout, done.stderr


Turned = Callable[[float, float, float], dict[str, float]]
"""What the joints of the small arm are said to be, of its positions."""


def _joints(turn: float, lift: float, reach: float) -> dict[str, float]:
    return {"camera": math.nan, "reach": reach, "lift": lift, "turn": turn}


def _bag(
    folder: Path,
    storage: StoragePlugin = StoragePlugin.SQLITE3,
    turned: Turned = _joints,
    beside: Sequence[bytes] = (),
) -> Path:
    """A bag of the small arm; ``beside`` each position come other messages on its topic."""
    bag = folder / "bag"
    with Writer(bag, version=9, storage_plugin=storage) as writer:
        levers = writer.add_connection("/joy", JOY.name, typestore=cdr.store())
        joints = writer.add_connection("/joints", JOINT_STATE.name, typestore=cdr.store())
        for tick in small_arm.ticks(rate_hz=25.0, pushes=1):
            at_s = 1e9 + tick.time_s
            at_ns = round(at_s * 1e9)
            writer.write(levers, at_ns, joy(tick.axes.tolist(), at_s))
            said = joint_state(turned(*tick.position.tolist()), at_s)
            for payload in (said, *beside):
                writer.write(joints, at_ns, payload)
    return bag


def test_a_ros_bag_becomes_a_site(tmp_path: Path, place: Path) -> None:
    """Its joints by their names, in any order and among others."""
    bag = _bag(tmp_path)
    code, out, err = _init(place, tmp_path / "site", "--log", str(bag))
    assert (code, err) == (0, ""), out
    site = load_site(tmp_path / "site" / "site.yaml")
    assert site.format == "ros2"
    assert site.keys.joystick.startswith("0/joy/")
    text = (tmp_path / "site" / "site.yaml").read_text()
    assert "domain: 0 # TODO ROS_DOMAIN_ID: nothing told it" in text
    assert [j.joint for j in site.arm.joints] == ["turn", "lift", "reach"]
    assert [(a.axis, a.sign) for a in site.guard.actuators] == [(2, 1), (0, -1), (1, 1)]
    code, _, err = _init(place, tmp_path / "other", "--log", str(bag), "--joystick", "/stick")
    assert code == 2
    assert "no /stick of sensor_msgs/msg/Joy" in err


def test_ros_messages_that_are_not_of_the_arm(tmp_path: Path, place: Path) -> None:
    """A gripper on the topic of the arm, twice as often, and what is cut short."""
    finger = joint_state({"reach": 0.2, "finger": 0.0}, 1e9)
    told = joint_state({"turn": 0.0, "lift": 0.0, "reach": 0.0}, 1e9)
    bag = _bag(tmp_path, StoragePlugin.MCAP, beside=(finger, finger, told[:-9]))
    (file,) = bag.glob("*.mcap")
    for log in (bag, file):
        code, out, err = _init(place, tmp_path / "site", "--log", str(log), "--force")
        assert (code, err) == (0, ""), out
        count = len(small_arm.ticks(rate_hz=25.0, pushes=1))
        said = " ".join(out.split())
        assert (
            f"(refused: {2 * count} actuators: missing_joint, {count} actuators: bad_cdr)" in said
        )
        site = load_site(tmp_path / "site" / "site.yaml")
        assert [j.joint for j in site.arm.joints] == ["turn", "lift", "reach"]


@pytest.mark.parametrize(
    ("joints", "more", "said"),
    [
        ({"a": 1.0, "b": 2.0}, (), "/joints names no joint of the URDF; it names a, b, and"),
        ({"turn": 1.0}, ("--joints", "turn,lift"), "/joints never names lift; it names turn, and"),
        ({}, (), "/joints names no joint of the URDF; it names none, and the URDF moves turn,"),
    ],
)
def test_joints_that_no_message_names(
    tmp_path: Path, place: Path, joints: dict[str, float], more: tuple[str, ...], said: str
) -> None:
    bag = _bag(tmp_path, turned=lambda *_: joints)
    code, _, err = _init(place, tmp_path / "site", "--log", str(bag), *more)
    assert code == 2
    assert said in err
    assert not (tmp_path / "site" / "site.yaml").exists()


def test_joints_that_a_cylinder_turns_are_measured_as_strokes(tmp_path: Path, place: Path) -> None:
    """ROS 2 tells angles, and a site file's speeds are of the cylinder."""
    drive = CylinderDrive(0.4, 0.3, 0.3, -1.2, 1)
    stroke_of = Inverse(drive, -math.inf, math.inf).actuator
    bag = _bag(tmp_path)
    out = tmp_path / "site"
    given = ("--log", str(bag), "--cylinder", "lift=0.4,0.3,0.3,-1.2,1")
    assert _init(place, out, *given)[0] == 0
    site = load_site(out / "site.yaml")
    lift = site.guard.actuators[1]
    assert lift.unit == "m"
    low, high = site.arm.limits[1]
    assert low is not None
    assert high is not None
    angles = [tick.position[1] for tick in small_arm.ticks(rate_hz=25.0, pushes=1)]
    ends = sorted(map(stroke_of, (min(angles), max(angles))))
    assert low <= ends[0] < ends[1] <= high
    # 0.5 rad/s, by the slope of the drive where the arm moves
    slope = abs(ends[1] - ends[0]) / (max(angles) - min(angles))
    assert lift.max_velocity == pytest.approx(0.5 * slope, rel=0.3)
    wrong = ("--log", str(bag), "--cylinder", "lift=0.4,0.3,0.3,2.5,1", "--force")
    code, _, err = _init(place, out, *wrong)
    assert code == 2
    assert "--cylinder: lift was at" in err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--domain", "3"), "--domain is of ROS 2; give --format ros2"),
        (("--no-type-hash",), "--no-type-hash is of ROS 2"),
        (("--connect", "tcp/127.0.0.1:1", "--joystick", "/joy"), "/joy is a topic of ROS 2; give"),
        (("--log", "{place}/log.csv", "--format", "ros2"), "holds no messages of ROS 2"),
        (("--log", "{bag}", "--format", "json"), "holds messages of ROS 2; leave out"),
        (("--format", "ros2", "--joystick", "/9"), "--joystick: '/9' is no ROS 2 topic"),
    ],
)
def test_formats_that_do_not_fit(
    place: Path, tmp_path: Path, more: tuple[str, ...], said: str
) -> None:
    bag = _bag(tmp_path)
    code, _, err = _init(
        place, tmp_path / "site", *(one.format(place=place, bag=bag) for one in more)
    )
    assert code == 2
    assert said in err


@pytest.mark.parametrize("domain", ["-1", "233", "x", "٣"])
def test_a_domain_that_is_none(
    place: Path, tmp_path: Path, domain: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["init", str(place), "--out", str(tmp_path), f"--domain={domain}"])
    assert ended.value.code == 2
    assert "is none of 0 to 232" in capsys.readouterr().err


def test_ros_2_without_a_machine(place: Path, tmp_path: Path) -> None:
    """Topics as they usually are, and what travels is to do."""
    assert _init(place, tmp_path, "--format", "ros2", "--transport", "ros2dds")[0] == 0
    site = load_site(tmp_path / "site.yaml")
    assert (site.keys.joystick, site.keys.actuators) == ("joy", "joint_states")
    assert "transport: ros2dds # rmw_zenoh or ros2dds; given" in (
        (tmp_path / "site.yaml").read_text().replace("  #", " #")
    )


def test_ros_2_is_asked_for() -> None:
    answers = iter(["", "", "", "tcp/127.0.0.1:1", "ros", "ros2", "", "900", "7", "/pad", "", "5"])
    asked: list[str] = []

    def ask(prompt: str) -> str:
        asked.append(prompt)
        return next(answers)

    wishes = source_asked(Wishes("arm.urdf", "out"), ask)
    assert (wishes.format, wishes.transport, wishes.domain) == ("ros2", "rmw_zenoh", 7)
    assert (wishes.joystick, wishes.actuators) == ("/pad", "/joint_states")
    assert "Topic of the actuators [/joint_states]: " in asked
