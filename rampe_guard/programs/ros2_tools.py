"""``rampe-guard ros2``: topics of a site, a robot's description, recordings as ROS bags."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rampe_guard.collision import load_arm
from rampe_guard.errors import ConnectionFailedError, LogError, MessageError, SettingsError
from rampe_guard.recording import McapReading, is_mcap, open_log
from rampe_guard.recording.bag import is_bag, opened
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.outputs import encode_joint_state, encode_joy
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, STRING, Ros2Settings

MOST_URDF: Final = 16 * 2**20
"""A description may be so large [bytes]."""


def topics(site: Site) -> list[tuple[str, str, str, str]]:
    """What a site hears and says in ROS 2, for `check` too: direction, topic, type, Zenoh key.

    Raises:
        SettingsError: it does not speak ROS 2.
    """
    ros = _spoken(site)
    found = [
        ("hears", ros.joystick_topic, JOY.name, site.keys.joystick),
        ("hears", ros.actuators_topic, JOINT_STATE.name, site.keys.actuators),
    ]
    said = [("says", topic, kind.name, ros.key(topic, kind)) for topic, kind in ros.published]
    return [*found, *said]


def joints(site: Site) -> tuple[str, ...]:
    """The joints that every sensor_msgs/JointState must name."""
    return tuple(drive.joint for drive in site.arm.joints[: len(site.actuator_names)])


def topic_lines(site_path: str) -> list[str]:
    """`topics` and `joints` of a site file, a line each."""
    site = load_site(site_path)
    rows = topics(site)
    wide = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = [
        "  ".join([*(word.ljust(w) for word, w in zip(row, wide, strict=False)), row[3]])
        for row in rows
    ]
    return [*lines, f"joints that must be named: {', '.join(joints(site))}"]


def save_description(
    source: str, out: str, topic: str, endpoints: Sequence[str], wait_s: float, *, force: bool
) -> str:
    """Write the URDF that a robot publishes; says what it is.

    A guard never takes its geometry from the network: this file is looked at, kept beside the site
    file, and named there.

    Args:
        source: a ROS bag, or the site file of a live robot.
        out: the file to write.
        topic: of the description.
        endpoints: Zenoh endpoints instead of the site file's.
        wait_s: for a live robot [s].
        force: replace ``out``.

    Raises:
        LogError: the bag has no such message.
        ConnectionFailedError: nobody publishes it.
        SettingsError: the site does not speak ROS 2, or ``out`` exists already.
        MessageError: it is no URDF.
    """
    if Path(out).exists() and not force:
        raise SettingsError(f"{out}: exists already; give another name, or --force")
    if is_bag(source) or (Path(source).is_file() and is_mcap(source)):
        payload = _from_bag(source, topic)
    else:
        payload = _live(source, topic, endpoints, wait_s)
    text = str(cdr.decode(payload, STRING, MOST_URDF).data)
    if "<robot" not in text:
        raise MessageError("bad_urdf", f"{topic} has no <robot> in it: {text[:60]!a}")
    content = text.encode()
    part = Path(f"{out}.part")
    part.write_bytes(content)
    os.replace(part, out)  # noqa: PTH105 - whole, or not at all
    meshes = len(re.findall(r"<mesh\b", text))
    packages = sorted(set(re.findall(r"package://([^/\"']+)", text)))
    said = f"{out}: {len(content)} bytes, SHA-256 {hashlib.sha256(content).hexdigest()[:16]}…"
    said += f", {meshes} meshes"
    return f"{said} of {', '.join(packages)} (see arm.package_dirs)" if packages else said


def write_bag(site_path: str, log_path: str, out: str) -> str:
    """Write a log as a ROS bag, joints and axes as a driver would publish them; says what it is.

    Raises:
        LogError: the log cannot be what the site file says, or ``out`` cannot be written.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer, WriterError  # noqa: PLC0415 - an extra

    site = load_site(site_path)
    log = open_log(site, log_path, load_arm(site.arm).limits)
    ros = site.ros2
    names = ("/joy", "/joint_states") if ros is None else (ros.joystick_topic, ros.actuators_topic)
    store, rows = cdr.store(), 0
    drives = site.arm.joints[: len(site.actuator_names)]
    try:
        with Writer(out, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            joy = writer.add_connection(names[0], JOY.name, typestore=store)
            joints = writer.add_connection(names[1], JOINT_STATE.name, typestore=store)
            for lever, moved in log.samples():
                at_s = log.epoch_s + moved.stamp_s
                at_ns = round(at_s * 1e9)
                writer.write(joy, at_ns, encode_joy(lever.axes.tolist(), at_s))
                writer.write(
                    joints, at_ns, encode_joint_state(drives, moved.position.tolist(), at_s)
                )
                rows += 1
    except (WriterError, OSError) as error:
        raise LogError(f"{out}: cannot be written: {error}") from None
    return f"{out}: {rows} messages each of {names[0]} and {names[1]}"


def _spoken(site: Site) -> Ros2Settings:
    if site.ros2 is None:
        raise SettingsError(f"{site.path}: format: {site.format}; write format: ros2 to speak it")
    return site.ros2


def _from_bag(path: str, topic: str) -> bytes:
    newest: bytes | None = None
    if is_bag(path):
        with opened(path) as reader:
            found = [c for c in reader.connections if c.topic == topic and c.msgtype == STRING.name]
            if found:
                for _, _, payload in reader.messages(found):
                    newest = bytes(payload)
            known = ", ".join(sorted(c.topic for c in reader.connections))
    else:
        reading = McapReading(path)
        for message in reading.messages():
            if message.channel.topic == topic:
                newest = message.payload
        known = ", ".join(sorted(reading.counts))
    if newest is None:
        raise LogError(f"{path}: has no {STRING.name} on {topic}; it has {known[:400]}")
    return newest


def _live(site_path: str, topic: str, endpoints: Sequence[str], wait_s: float) -> bytes:
    site = connect_to(load_site(site_path), endpoints)
    key = _spoken(site).key(topic, STRING)
    with Bus.open(site.zenoh) as bus:
        payload = bus.latched(key, wait_s)
    if payload is None:
        raise ConnectionFailedError(
            f"nobody publishes {topic} (key {key}) within {wait_s:g} s; see --topic and --wait, or"
            " take it from a ROS bag"
        )
    return payload
