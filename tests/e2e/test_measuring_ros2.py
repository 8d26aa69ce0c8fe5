"""`init` and `check --live` on machines that speak ROS 2, each in a process of its own.

One by rmw_zenoh in a domain of its own, one by the bridge; both on one router.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess
from typing import NamedTuple

import pytest

from rampe_guard.settings import load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, Transport, key_of
from tests.support import processes, small_arm
from tests.support.processes import Process, called

pytestmark = pytest.mark.e2e

DOMAIN = 3
STATES = "/arm/joint_states"


class Place(NamedTuple):
    """The router, the URDF, and the machines that work."""

    folder: Path
    endpoint: str
    machines: dict[str, Process]

    def init(self, out: Path, *more: str) -> CompletedProcess[str]:
        """`init`, live."""
        live = ("--connect", self.endpoint, "--format", "ros2", "--yes")
        return called("init", self.folder / "small_arm.urdf", "--out", out, *live, *more)

    def check(self, site: Path, seconds: float) -> CompletedProcess[str]:
        """`check --live`."""
        return called("check", site, "--live", "--seconds", str(seconds))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    folder = tmp_path_factory.mktemp("ros2")
    small_arm.write_urdf(folder)
    endpoint = processes.free_endpoint()
    ways: tuple[tuple[Transport, str], ...] = (("rmw_zenoh", "/joy"), ("ros2dds", "/pad/joy"))
    with contextlib.ExitStack() as stack:
        stack.enter_context(processes.router(folder, endpoint))
        machines: dict[str, Process] = {}
        for way, levers in ways:
            topics = ((levers, JOY), (f"{levers.removesuffix('/joy')}{STATES}", JOINT_STATE))
            keys = [key_of(topic, kind, way, DOMAIN, type_hash=True) for topic, kind in topics]
            args = ("-m", "tests.support.exerciser", endpoint, *keys, "ros2")
            machines[way] = stack.enter_context(Process(folder, way, args, talk=True))
        for machine in machines.values():
            machine.wait_for("ready")
        yield Place(folder, endpoint, machines)


@pytest.fixture(scope="module")
def made(place: Place) -> tuple[Path, CompletedProcess[str]]:
    """What `init` made of the machine that speaks by rmw_zenoh, and what it said."""
    topics = ("--actuators", STATES, "--domain", str(DOMAIN), "--seconds", "8")
    return place.folder / "site" / "site.yaml", place.init(place.folder / "site", *topics)


def test_a_live_machine_becomes_a_site(
    place: Place, made: tuple[Path, CompletedProcess[str]]
) -> None:
    path, done = made
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"listening for 8 s on /joy and {STATES}" in done.stdout
    site = load_site(path)
    assert site.format == "ros2"
    assert site.ros2 is not None
    assert (site.ros2.transport, site.ros2.domain) == ("rmw_zenoh", DOMAIN)
    assert (site.ros2.joystick_topic, site.ros2.actuators_topic) == ("/joy", STATES)
    assert site.keys.joystick == f"{DOMAIN}/joy/{JOY.dds}/{JOY.hash}"
    assert site.zenoh.connect == (place.endpoint,)
    assert [j.joint for j in site.arm.joints] == ["turn", "lift", "reach"]
    told = small_arm.told_levers(path)  # in so short a time perhaps not of all
    assert len(told) >= 2
    assert told.items() <= small_arm.LEVERS.items()
    for true, one in zip(small_arm.ACTUATORS, site.guard.actuators, strict=True):
        if true.name in told:
            assert 0.5 * true.max_velocity < one.max_velocity < 2.0 * true.max_velocity
    replayed = called("replay", path, path.with_name("measured.csv"))
    assert replayed.returncode == 0, replayed.stderr


def test_it_is_as_its_site_file_says(
    place: Place, made: tuple[Path, CompletedProcess[str]]
) -> None:
    done = place.check(made[0], 1.5)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {line.split()[0]: line.split() for line in done.stdout.splitlines() if line.strip()}
    for name in ("joystick", "actuators"):
        assert rows[name][-1] == "none"  # is refused
        assert 30.0 < float(rows[name][2].removesuffix("/s")) < 60.0
    assert "should be" not in done.stdout
    assert "ok: this site can be guarded" in done.stdout


def test_its_recording_becomes_a_site_too(
    place: Place, made: tuple[Path, CompletedProcess[str]], tmp_path: Path
) -> None:
    """`record` keeps what ROS 2 says byte for byte; `init` and `replay` find it."""
    log = tmp_path / "work.mcap"
    done = called("record", made[0], log, "--for", "8")
    assert done.returncode == 0, done.stderr
    urdf = place.folder / "small_arm.urdf"
    done = called("init", urdf, "--out", tmp_path / "site", "--log", log, "--yes")
    assert done.returncode == 0, done.stderr
    site, live = load_site(tmp_path / "site" / "site.yaml"), load_site(made[0])
    assert (site.format, site.keys.joystick) == ("ros2", live.keys.joystick)
    told = small_arm.told_levers(tmp_path / "site" / "site.yaml")
    assert len(told) >= 1
    assert told.items() <= small_arm.LEVERS.items()
    assert called("replay", log).returncode == 0


def test_what_is_wrong_with_it_is_told(
    place: Place, made: tuple[Path, CompletedProcess[str]], tmp_path: Path
) -> None:
    """Messages that are cut short, levers the other way round, and another version of a type."""
    machine = place.machines["rmw_zenoh"]
    machine.tell(json.dumps({"flip": True, "rubbish": True}))
    try:
        done = place.check(made[0], 8.0)
    finally:
        machine.tell(json.dumps({"flip": False, "rubbish": False}))
    text = " ".join(done.stdout.split())
    assert "bad_cdr" in text
    assert "the site file's sign 1 should be -1" in text
    other = made[0].with_name("other.yaml")
    said = made[0].read_text("utf-8")
    assert f"domain: {DOMAIN} " in said
    other.write_text(said.replace(f"domain: {DOMAIN} ", f"domain: {DOMAIN}\n  type_hash: false "))
    done = place.check(other, 0.6)
    assert done.returncode == 2
    assert "wrong_hash" in done.stdout
    assert f"has the hash {JOY.hash}, not TypeHashNotSupported" in " ".join(done.stdout.split())
    done = place.init(tmp_path, "--domain", str(DOMAIN), "--no-type-hash", "--seconds", "0.4")
    assert done.returncode == 2
    assert "nothing came on 3/joy/" in done.stderr
    assert f"has the hash {JOY.hash}, not TypeHashNotSupported" in done.stderr
    assert not (tmp_path / "site.yaml").exists()


def test_a_machine_behind_the_bridge(place: Place, tmp_path: Path) -> None:
    """By its topics, and by its whole keys; messages that are cut short are told of."""
    topics = ("--joystick", "/pad/joy", "--actuators", f"/pad{STATES}")
    place.machines["ros2dds"].tell(json.dumps({"rubbish": True}))
    try:
        done = place.init(tmp_path, *topics, "--transport", "ros2dds", "--seconds", "8")
    finally:
        place.machines["ros2dds"].tell(json.dumps({"rubbish": False}))
    assert done.returncode == 0, done.stderr
    assert "actuators: bad_cdr" in " ".join(done.stdout.split())
    site = load_site(tmp_path / "site.yaml")
    assert (site.keys.joystick, site.keys.actuators) == ("pad/joy", f"pad{STATES}")
    told = small_arm.told_levers(tmp_path / "site.yaml")
    assert len(told) >= 2
    assert told.items() <= small_arm.LEVERS.items()
    assert place.check(tmp_path / "site.yaml", 0.6).returncode == 0
    whole = ("--joystick", "pad/joy", "--actuators", f"pad{STATES}", "--transport", "ros2dds")
    done = place.init(tmp_path / "whole", *whole, "--seconds", "2.5")
    assert done.returncode == 0, done.stderr
    assert load_site(tmp_path / "whole" / "site.yaml").keys.joystick == "pad/joy"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        # another domain than the machine's: where the topics are comes first
        (("--domain", "0"), f", /joy of {JOY.dds} (rmw_zenoh, domain 3), pad/arm/joint_states, "),
        (("--transport", "ros2dds"), "on joy and arm/joint_states within 0.4 s; there are"),
        (("--domain", "3", "--joystick", "/pad/joy"), "there are messages on pad/joy, "),
        (("--domain", "3", "--joints", "turn,grip"), "never names grip; it names camera, lift"),
        (
            ("--domain", "3", "--joystick", f"3/joy/{JOINT_STATE.dds}/{JOINT_STATE.hash}"),
            f"is of type {JOINT_STATE.dds}, not {JOY.dds}; give the topic instead",
        ),
        (("--joystick", "/joy/"), "--joystick: '/joy/' is no ROS 2 topic; give its full name"),
    ],
)
def test_what_cannot_be_heard_is_said(
    place: Place, tmp_path: Path, more: tuple[str, ...], said: str
) -> None:
    done = place.init(tmp_path, "--actuators", STATES, "--seconds", "0.4", *more)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "site.yaml").exists()
