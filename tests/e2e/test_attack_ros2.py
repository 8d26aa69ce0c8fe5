"""A machine that speaks ROS 2 behind a router that denies: it works, and nobody speaks for it.

Router, access list and certificates are those that deploy/ makes, guard and messages the real ones.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from rampe_guard.recording import McapReading
from rampe_guard.ros2.graph import Voice, driver_tokens
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, NO_HASH, Ros2Settings
from tests.support.ears import open_session
from tests.support.fort import BASE, Fort, fort
from tests.support.pki import HAVE_OPENSSL
from tests.support.processes import Process, called, until
from tests.support.ros2 import RosEars, angles_of, joint_state, joy
from tests.support.ros_fort import DRIVER, ros_plan
from tests.support.station import REST

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl: no certificates"),
]
BLOCK = zenoh.CongestionControl.BLOCK
FALSE = b"never to be read"
EVERYBODY = "@ros2_lv/0/**"


class Yard:
    """The place, and what a viewer sees of it with tools of ROS 2: exact keys only."""

    def __init__(self, place: Fort, driver: Process) -> None:
        self.place, self.driver = place, driver
        self.site: Site = load_site(place.site("viewer"))
        assert self.site.ros2 is not None
        self.ros: Ros2Settings = self.site.ros2
        self.inputs = (self.site.keys.joystick, self.site.keys.actuators)
        self.published = tuple(self.ros.key(topic, kind) for topic, kind in self.ros.published)
        self.diagnostics, self.markers = RosEars(), RosEars()
        self.taken: list[tuple[str, bytes]] = []
        session = place.ears.session
        self._keep = [
            session.declare_subscriber(key, ears.hear)
            for key, ears in zip(self.published, (self.diagnostics, self.markers), strict=True)
        ]
        self._keep += [session.declare_subscriber(key, self._take) for key in self.inputs]

    @property
    def rmw(self) -> bool:
        return self.ros.transport == "rmw_zenoh"

    def _take(self, sample: zenoh.Sample) -> None:
        self.taken.append((str(sample.key_expr), sample.payload.to_bytes()))

    def beat(self) -> dict[str, Any]:
        """What the guard says from now on."""
        return self.place.ears.wait("heartbeat", lambda _: True, 5.0, time.monotonic()).body

    def untouched(self) -> None:
        """The guard has refused nothing so far, and nobody was shown what is false."""
        after = self.beat()
        assert after["rejected"] == {}
        assert after["status"] != "not_monitoring"
        assert self.taken
        assert all(payload != FALSE for _, payload in self.taken)

    def tokens(self) -> set[str]:
        return set(self.place.ears.tokens(EVERYBODY))


@pytest.fixture(scope="module", params=["rmw_zenoh", "ros2dds"])
def yard(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Yard]:
    """Guard and driver, each a process with its certificate; the machine has met the crate."""
    folder = tmp_path_factory.mktemp(str(request.param))
    with fort(folder, ros_plan(request.param)) as place:
        arguments: list[str | Path] = ["-m", "tests.support.ros2_sender"]
        arguments += [place.at("machine"), place.site("machine")]
        with Process(folder, "driver", arguments, talk=True) as driver:
            made = Yard(place, driver)
            driver.wait_for("done", 60.0)
            yield made


@contextlib.contextmanager
def session(yard: Yard, name: str) -> Iterator[zenoh.Session]:
    opened = open_session(yard.place.at(name))
    try:
        yield opened
    finally:
        opened.close()


def test_a_machine_of_ros_2_works_through_it(yard: Yard) -> None:
    """Driver, guard, viewer; only then do the refusals below mean much."""
    alerts = [h.body for h in yard.place.ears.all() if h.topic == "alert"]
    assert {"crate"} <= {b["zone"] for b in alerts if b["level"] == "imminent"}
    loud = [said.status[1] for _, _, said in yard.diagnostics.all()]
    assert any("crate (imminent)" in {v.key for v in status.values} for status in loud)
    until(lambda: yard.diagnostics.all()[-1][2].status[0].level == 0, 10.0, "protection is OK")
    spaces = {m.ns for _, _, said in yard.markers.all() for m in said.markers}
    assert {"zones", "contacts", "alerts"} <= spaces
    assert {key for key, _ in yard.taken} == set(yard.inputs)
    yard.untouched()


def test_commands_hear_topics_with_a_certificate_that_reads(yard: Yard, tmp_path: Path) -> None:
    day = tmp_path / "day.mcap"
    arguments: list[str | Path] = ["-m", "rampe_guard", "record", yard.place.site("recorder"), day]
    with Process(tmp_path, "record", [*arguments, "--for", "1.5"]) as recorder:
        assert recorder.popen.wait(60.0) == 0, recorder.err
    reading = McapReading(str(day))
    topics = {message.channel.topic for message in reading.messages()}
    assert topics >= {*yard.inputs, f"{BASE}/heartbeat"}
    shown = called("scene", "show", yard.place.site("viewer"))
    assert shown.returncode == 0, shown.stderr


def test_tools_see_the_guard_and_the_named_driver_and_nobody_else(yard: Yard) -> None:
    if not yard.rmw:
        assert yard.tokens() == set()  # the bridge has tokens of its own, which nobody needs here
        return
    until(lambda: len(yard.tokens()) == 3, 5.0, lambda: f"three tokens, not {yard.tokens()}")
    (zid,) = {token.split("/")[2] for token in yard.tokens()}
    assert yard.tokens() == set(Voice(yard.ros, zid).tokens)
    with session(yard, "machine") as machine, session(yard, "viewer") as viewer:
        own = str(machine.info.zid())
        mine = [
            key.replace("/*", f"/{own}", 1).replace("/*", "/7")
            for key in driver_tokens(DRIVER, yard.inputs)
        ]
        assert len(mine) == 3
        false = [
            *Voice(yard.ros, own).tokens,  # the guard's
            mine[0].replace("joy_driver", "another"),
            mine[1].replace("%joy", "%diagnostics"),
            mine[1].replace("@ros2_lv/0", "@ros2_lv/1"),
        ]
        keep = [machine.liveliness().declare_token(key) for key in (*mine, *false)]
        theirs = Voice(yard.ros, str(viewer.info.zid())).tokens
        keep += [viewer.liveliness().declare_token(key) for key in theirs]
        until(lambda: set(mine) <= yard.tokens(), 5.0, "the driver's tokens")
        assert yard.tokens() == {*mine, *Voice(yard.ros, zid).tokens}
        assert keep
    until(lambda: not set(mine) & yard.tokens(), 5.0, "the driver's tokens are gone")


@pytest.mark.parametrize(
    "name", ["viewer", "operator", "engineer", "recorder", "guard", "other", "far", "farguard"]
)
def test_nobody_else_moves_the_machine(yard: Yard, name: str) -> None:
    good = (joy((1.0,) * 4), joint_state(angles_of(yard.site, REST)))
    before = len(yard.taken)
    with session(yard, name) as attacker:
        for key, payload in zip(yard.inputs, good, strict=True):
            attacker.put(key, FALSE, congestion_control=BLOCK)
            attacker.put(key, payload, congestion_control=BLOCK)
            attacker.delete(key, congestion_control=BLOCK)
        yard.untouched()
    for key in yard.inputs:
        yard.place.denied(name, "Put", key)
        yard.place.denied(name, "Delete", key)
    assert not {(k, p) for k, p in yard.taken[before:] if p in good}


@pytest.mark.parametrize(
    "name", ["viewer", "operator", "engineer", "recorder", "machine", "other", "far"]
)
def test_nobody_says_in_ros_2_that_all_is_well_but_the_guard(yard: Yard, name: str) -> None:
    ends = len(yard.diagnostics.all()), len(yard.markers.all())
    # what the guard itself has said would be believed most
    first = yard.place.ears.session.declare_subscriber(
        yard.published[0], zenoh.handlers.RingChannel(1)
    )
    said = first.recv().payload.to_bytes()
    with session(yard, name) as attacker:
        for key in (*yard.published, f"{BASE}/alert"):
            for _ in range(20):
                attacker.put(key, said, congestion_control=BLOCK)
        yard.untouched()
    for key in yard.published:
        yard.place.denied(name, "Put", key)
    # its own come on: one a second and as often as something changes
    told = yard.diagnostics.all()[ends[0] :]
    assert 1 <= len(told) < 20
    assert len(yard.markers.all()) - ends[1] < 20 + len(told)


def test_a_right_to_topics_is_none_to_patterns_or_other_types(yard: Yard) -> None:
    first, second = yard.inputs
    patterns = ["**", "*/**", f"{first}/**", f"{second.rpartition('/')[0]}/*"]
    if yard.rmw:
        patterns += [
            "0/**",
            "0/joy/*/*",
            f"0/*/{JOY.dds}/{JOY.hash}",
            f"*/joy/{JOY.dds}/{JOY.hash}",
            f"0/joy/{JOINT_STATE.dds}/{JOINT_STATE.hash}",
            f"0/joy/{JOY.dds}/{NO_HASH}",
            f"1/joy/{JOY.dds}/{JOY.hash}",
        ]
    with session(yard, "machine") as machine:
        for pattern in patterns:
            machine.put(pattern, FALSE, congestion_control=BLOCK)
            time.sleep(0.005)
        yard.untouched()
    for pattern in patterns:
        yard.place.denied("machine", "Put", pattern)
    wide = ["**", yard.published[0].rpartition("/")[0] + "/*" if yard.rmw else "*"]
    with session(yard, "guard") as guard:
        for pattern in wide:
            guard.put(pattern, FALSE, congestion_control=BLOCK)
        yard.untouched()
    for pattern in wide:
        yard.place.denied("guard", "Put", pattern)


def test_who_looks_on_sees_these_topics_and_not_all_of_ros_2(yard: Yard) -> None:
    heard: list[zenoh.Sample] = []
    wide = "0/**" if yard.rmw else "*"
    with session(yard, "viewer") as viewer, session(yard, "other") as other:
        keep = [viewer.declare_subscriber(wide, heard.append)]
        keep += [other.declare_subscriber(key, heard.append) for key in yard.inputs]
        yard.untouched()  # for as long as a heartbeat takes, all topics are spoken on
        yard.place.denied("viewer", "Declare Subscriber", wide)
        assert list(other.liveliness().get(EVERYBODY, timeout=2.0)) == []
        assert keep
    assert heard == []
