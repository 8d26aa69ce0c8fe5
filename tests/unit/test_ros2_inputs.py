"""sensor_msgs as a guard takes them, and whatever is none of them refused by name."""

from __future__ import annotations

import math
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from rampe_guard.core.drive import joint_scalar
from rampe_guard.errors import MessageError
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.attachment import Attachment, Losses, unpacked
from rampe_guard.ros2.graph import Voice
from rampe_guard.ros2.inputs import JointReader, decode_joy
from rampe_guard.runtime.decoding import decoders_of, limits_said
from rampe_guard.settings import Site, load_site, ros2_keys
from rampe_guard.settings.ros2_keys import RosType
from tests.support.processes import BENCH
from tests.support.ros2 import LIMITS, angles_of, bench_in_ros2, joint_state, joy

SITE = load_site(BENCH)
Q = (1.0, 0.065, 0.08, 0.03)
ANGLES = angles_of(SITE, Q)
JOINTS = tuple(entry.joint for entry in SITE.arm.joints[:4])
GOOD_JOY, GOOD_JOINTS = joy((0.5, -0.25, 0.0, 1.0), 12.5), joint_state(ANGLES, 12.5)


@pytest.fixture(scope="module")
def reader() -> JointReader:
    return JointReader(SITE.arm.joints[:4], LIMITS)


def test_hashes_of_types_are_those_of_every_distribution() -> None:
    typesys = pytest.importorskip("rosbags.typesys")
    kinds = [v for v in vars(ros2_keys).values() if isinstance(v, RosType)]
    assert len(kinds) == 5
    for distribution in ("HUMBLE", "JAZZY", "KILTED", "LYRICAL"):
        store = typesys.get_typestore(typesys.Stores[f"ROS2_{distribution}"])
        for kind in kinds:
            assert store.hash_rihs01(kind.name) == kind.hash, (distribution, kind.name)


def test_a_joy_is_its_axes_and_its_time() -> None:
    said = decode_joy(GOOD_JOY, 3)
    assert said.axes == (0.5, -0.25, 0.0)
    assert said.stamp == 12.5
    assert decode_joy(joy((0.0,) * 8), 4).stamp is None
    beyond = joy((0.0, 0.0, 0.0, 0.0, 7.0, math.nan))
    assert decode_joy(beyond, 4).axes == (0.0,) * 4


def test_joints_become_actuators_by_name(reader: JointReader) -> None:
    said = reader(GOOD_JOINTS)
    assert said.position == pytest.approx(Q, abs=1e-12)
    assert (said.velocity, said.stamp, said.name) == (None, 12.5, None)


def test_speeds_of_joints_become_those_of_actuators(reader: JointReader) -> None:
    speed = (0.3, 0.01, -0.02, 0.015)
    h = 1e-5
    behind, ahead = (
        angles_of(SITE, [q + s * v for q, v in zip(Q, speed, strict=True)]) for s in (-h, h)
    )
    speeds = {name: (ahead[name] - behind[name]) / (2.0 * h) for name in JOINTS}
    said = reader(joint_state(ANGLES, 1.0, speeds))
    assert said.velocity == pytest.approx(speed, rel=1e-6)
    # what a driver does not know it says as NaN: then none is told
    assert reader(joint_state(ANGLES, 1.0, {**speeds, JOINTS[1]: math.nan})).velocity is None


CASES: list[tuple[str, str, bytes]] = [
    ("joystick", "bad_cdr", b""),
    ("joystick", "bad_cdr", GOOD_JOY[:-3]),
    ("joystick", "bad_cdr", b'{"axes": [0, 0, 0, 0]}'),
    ("joystick", "bad_cdr", b"\x00\x07" + GOOD_JOY[2:]),
    ("joystick", "bad_cdr", b"\x00\x00" + GOOD_JOY[2:]),  # says big-endian, and is not
    ("joystick", "bad_cdr", GOOD_JOY + b"rubbish"),
    ("joystick", "bad_cdr", GOOD_JOY.replace(struct.pack("<I", 4), b"\xff\xff\xff\xff", 1)),
    ("joystick", "bad_cdr", GOOD_JOY.replace(b"joy", b"\xff\xfe\xfd")),
    ("joystick", "bad_cdr", GOOD_JOINTS),
    ("joystick", "too_large", GOOD_JOY + b"\0" * 70_000),
    ("joystick", "wrong_length", joy((0.0, 0.0, 0.0))),
    ("joystick", "not_finite", joy((math.nan, 0.0, 0.0, 0.0))),
    ("joystick", "not_finite", joy((0.0, -math.inf, 0.0, 0.0))),
    ("joystick", "axis_out_of_range", joy((0.0, 1.5, 0.0, 0.0))),
    ("actuators", "bad_cdr", GOOD_JOINTS[: len(GOOD_JOINTS) // 2]),
    ("actuators", "bad_cdr", GOOD_JOINTS.replace(b"boom_joint", b"b\xffom_joint")),
    ("actuators", "missing_joint", joint_state(dict.fromkeys(JOINTS[:3], 0.0))),
    ("actuators", "missing_joint", joint_state({})),
    ("actuators", "duplicate_joint", joint_state(ANGLES, names=(*JOINTS, JOINTS[0]))),
    ("actuators", "not_finite", joint_state({**ANGLES, JOINTS[2]: math.nan})),
    ("actuators", "not_finite", joint_state(ANGLES, 1.0, dict.fromkeys(JOINTS, math.inf))),
    ("actuators", "joint_out_of_reach", joint_state({**ANGLES, JOINTS[1]: 2.9})),
]


@pytest.mark.parametrize(("name", "reason", "payload"), CASES)
def test_what_is_no_such_message_is_refused(
    reader: JointReader, name: str, reason: str, payload: bytes
) -> None:
    read: Callable[[bytes], object] = reader
    if name == "joystick":
        read = lambda data: decode_joy(data, 4)  # noqa: E731 - as short as it is
    tracemalloc.start()
    with pytest.raises(MessageError) as caught:
        read(payload)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert caught.value.reason == reason
    assert str(caught.value).isascii()
    assert most < 1_000_000


def test_wrong_lengths_and_times_are_refused(reader: JointReader) -> None:
    short = cdr.decode(GOOD_JOINTS, ros2_keys.JOINT_STATE)
    short.position = short.position[:-1]
    with pytest.raises(MessageError, match="wrong_length"):
        reader(cdr.encode(short, ros2_keys.JOINT_STATE))
    late = cdr.decode(GOOD_JOY, ros2_keys.JOY)
    late.header.stamp.nanosec = 2_000_000_000
    with pytest.raises(MessageError, match="bad_cdr"):
        decode_joy(cdr.encode(late, ros2_keys.JOY), 4)


def test_big_endian_is_read_where_it_is_meant(reader: JointReader) -> None:
    message = cdr.decode(GOOD_JOINTS, ros2_keys.JOINT_STATE)
    swapped = cdr.store().serialize_cdr(message, ros2_keys.JOINT_STATE.name, little_endian=False)
    assert reader(bytes(swapped)) == reader(GOOD_JOINTS)


def test_ends_of_the_travel_and_a_little_beyond_can_be_told(reader: JointReader) -> None:
    for row, entry in zip(LIMITS, SITE.arm.joints[:4], strict=True):
        margin = 0.02 * (row[1] - row[0])
        for value in (row[0], row[1], row[0] - margin, row[1] + margin):
            angle = joint_scalar(entry.drive, float(value))
            index = JOINTS.index(entry.joint)
            said = reader(joint_state({**ANGLES, entry.joint: angle}))
            assert said.position[index] == pytest.approx(value, abs=1e-9)


def test_attachments_of_both_forms_are_read_and_the_rest_is_none() -> None:
    made = Attachment(7, 1_700_000_000_000_000_000, bytes(range(16)))
    assert len(made.packed()) == 33
    assert unpacked(made.packed()) == made
    old = b"\x0fsequence_number" + struct.pack("<q", 7)
    old += b"\x10source_timestamp" + struct.pack("<q", made.source_ns)
    old += b"\x0asource_gid\x10" + made.gid
    assert len(old) == 77
    assert unpacked(old) == made
    for bad in (None, b"", made.packed()[:-1], made.packed() + b"x", bytes(33), bytes(77)):
        assert unpacked(bad) is None


def test_losses_are_gaps_of_one_sender() -> None:
    losses = Losses()

    def note(sequence: int, sender: int = 0) -> int:
        return losses.note(Attachment(sequence, 0, bytes([sender]) * 16).packed())

    assert [note(5), note(6), note(9), note(9), note(1), note(2)] == [0, 0, 2, 0, 0, 0]
    assert [note(50, 1), note(3), note(51, 1), losses.note(b"?"), note(4)] == [0] * 5
    assert losses.count == 2
    for sender in range(200):
        note(1, sender)
    assert len(losses._last) <= 16


def test_keys_and_tokens_are_those_of_rmw_zenoh(tmp_path: Path) -> None:
    ros = load_site(bench_in_ros2(tmp_path, more=", domain: 2, node: talker")).ros2
    assert ros is not None
    string = ros2_keys.STRING
    assert ros.key("/chatter", string) == f"2/chatter/std_msgs::msg::dds_::String_/{string.hash}"
    voice = Voice(ros, "aac3178e146ba6f1fc6e6a4085e77f21")
    # as the design document of rmw_zenoh has them, but for numbers and depth
    assert voice.node == "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/talker"
    assert voice.publisher(0, "/chatter", string) == (
        "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MP/%/%/talker/%chatter/"
        f"std_msgs::msg::dds_::String_/{string.hash}/::,10:,:,:,,"
    )


def test_a_site_of_topics_has_the_keys_of_its_transport(tmp_path: Path) -> None:
    def keys(transport: str, more: str = "") -> tuple[str, str]:
        site: Site = load_site(bench_in_ros2(tmp_path, transport, more))
        assert site.ros2 is not None
        assert site.ros2.joystick_topic == "/joy"
        assert site.ros2.actuators_topic == "/excavator/joint_states"
        decoders_of(site, LIMITS).joystick(GOOD_JOY)
        return site.keys.joystick, site.keys.actuators

    assert keys("rmw_zenoh", ", domain: 7") == (
        f"7/joy/sensor_msgs::msg::dds_::Joy_/{ros2_keys.JOY.hash}",
        f"7/excavator/joint_states/sensor_msgs::msg::dds_::JointState_/{ros2_keys.JOINT_STATE.hash}",
    )
    assert keys("rmw_zenoh", ", type_hash: false")[0].endswith("Joy_/TypeHashNotSupported")
    assert keys("ros2dds") == ("joy", "excavator/joint_states")


def test_viewers_read_a_site_by_its_own_limits_and_make_nothing_up(tmp_path: Path) -> None:
    path = bench_in_ros2(tmp_path)
    site = load_site(path)
    said = decoders_of(site, limits_said(site)).actuators(GOOD_JOINTS)
    assert said.position == pytest.approx(Q, abs=1e-9)
    # a linkage that nothing holds to one of its branches has no inverse
    path.write_text(
        path.read_text("utf-8").replace("limits: {lower: 0.0, upper: 0.11}", ""), "utf-8"
    )
    loose = load_site(path)
    with pytest.raises(MessageError, match="joint_out_of_reach"):
        decoders_of(loose, limits_said(loose)).actuators(GOOD_JOINTS)
