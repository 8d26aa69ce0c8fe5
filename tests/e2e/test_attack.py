"""Attacks on a site's network: each is refused, and seen in a log or a count.

Router, access list and certificates are those that deploy/ makes; the guard is the shipped one.
"""

from __future__ import annotations

import contextlib
import json
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import ZenohSettings, load_site
from tests.support.ears import open_session
from tests.support.fort import BASE, MACHINE, Fort, fort, secure_router
from tests.support.pki import HAVE_OPENSSL, Pki
from tests.support.processes import BENCH, ROOT, Process, called, free_endpoint, until
from tests.support.rig import Rig
from tests.support.station import REST

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl: no certificates"),
]
BLOCK = zenoh.CongestionControl.BLOCK
NEVER = b"never to be read"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fort]:
    """A guard that watches a machine at rest, both with their certificates."""
    with (
        fort(tmp_path_factory.mktemp("fort")) as made,
        Rig(made.at("machine"), load_site(BENCH), REST),
    ):
        made.ears.wait("heartbeat", lambda b: b["status"] == "ok", 20.0, 0.0)
        yield made


@contextlib.contextmanager
def session(place: Fort, name: str | None) -> Iterator[zenoh.Session]:
    opened = open_session(place.at(name))
    try:
        yield opened
    finally:
        opened.close()


def beat(place: Fort) -> dict[str, Any]:
    """What the guard says from now on."""
    return place.ears.wait("heartbeat", lambda _: True, 5.0, time.monotonic()).body


def untouched(place: Fort, before: dict[str, Any]) -> None:
    """Since ``before`` the guard has refused nothing, and nobody heard what was forged."""
    after = beat(place)
    assert after["boot_id"] == before["boot_id"]
    assert after["rejected"] == before["rejected"]
    assert after["status"] != "not_monitoring"
    assert all(h.body.get("version") != "forged" for h in place.ears.all())


def answers(opened: zenoh.Session, key: str, payload: dict[str, Any]) -> list[str]:
    replies = opened.get(key, payload=json.dumps(payload), timeout=2.0)
    return [
        bytes(r.ok.payload).decode() if r.ok else r.err.payload.to_string()  # type: ignore[union-attr]
        for r in replies
    ]


def test_each_role_can_do_its_own_work(place: Fort, tmp_path: Path) -> None:
    """The commands as a site uses them, side by side; only then do the refusals below mean much."""
    day = tmp_path / "day.mcap"
    scene = ROOT / "config" / "scenes" / "bench.yaml"
    record: list[str | Path] = [
        "-m",
        "rampe_guard",
        "record",
        place.site("recorder"),
        day,
        "--for",
        "1.5",
    ]
    watch: list[str | Path] = ["-m", "rampe_guard", "watch", place.site("viewer"), "--json"]
    with (
        Process(tmp_path, "record", record) as recorder,
        Process(tmp_path, "watch", watch) as watcher,
    ):
        asked = called("ack", place.site("operator"), "no-such-alert", "--who", "anna")
        shown = called("scene", "show", place.site("viewer"))
        put = called("scene", "put", place.site("engineer"), scene, "--who", "eve")
        place.ears.wait("recorder", lambda b: b["messages"] > 0, 60.0, 0.0)
        watcher.wait_for('"machine"', 60.0)
        assert recorder.popen.wait(60.0) == 0, recorder.err
        assert "unavailable" not in watcher.out
    assert (asked.returncode, "'no-such-alert'" in asked.stderr) == (2, True)
    assert (shown.returncode, put.returncode) == (0, 0), shown.stderr + put.stderr
    assert "objects" in shown.stdout
    assert day.stat().st_size > 10_000


@pytest.mark.parametrize("who", ["nobody", "expired", "of another site"])
def test_who_cannot_prove_a_name_gets_no_session(place: Fort, tmp_path: Path, who: str) -> None:
    if who == "nobody":
        endpoint, told = place.at(None), "peer sent no certificates"
    elif who == "expired":
        endpoint, told = place.at("old"), "certificate expired"
    else:
        other = Pki(tmp_path)
        other.issue("viewer")
        endpoint = other.at(place.endpoint, "viewer", ca=place.pki.folder)
        told = "invalid peer certificate"
    with pytest.raises(zenoh.ZError):
        zenoh.open(_client(endpoint))
    place.logged(told)


def test_plain_messages_to_the_secure_port_get_no_session(place: Fort) -> None:
    plain = ZenohSettings(None, "client", (place.endpoint,))
    with pytest.raises(ConnectionFailedError, match="no Zenoh router"):
        Bus.open(plain)
    place.logged("received corrupt message of type InvalidContentType")


def test_connections_without_a_word_end_no_session(place: Fort) -> None:
    """They do keep new ones waiting, a tenth of a second each: see the threat model."""
    before = beat(place)
    host, port = place.endpoint.removeprefix("tcp/").split(":")
    lines = [socket.create_connection((host, int(port))) for _ in range(20)]
    for line in lines:
        line.close()
    untouched(place, before)
    place.logged("tls handshake eof")
    with session(place, "viewer") as viewer:
        (state,) = viewer.get(f"{BASE}/state", timeout=5.0)
        assert state.ok is not None


def test_a_name_that_is_not_on_the_list_can_nothing(place: Fort) -> None:
    before = beat(place)
    with session(place, "stranger") as stranger:
        heard: list[zenoh.Sample] = []
        stranger.declare_subscriber("rampe/**", heard.append)
        tokens = stranger.liveliness().get(f"{BASE}/alive", timeout=1.0)
        assert [t for t in tokens if t.ok] == []
        assert list(stranger.get(f"{BASE}/state", timeout=1.0)) == []
        time.sleep(0.5)  # heartbeats come five times a second
        assert heard == []
        stranger.put(f"{MACHINE}/joystick", NEVER, congestion_control=BLOCK)
        untouched(place, before)
    place.logged("did not match any configured ACL subject", "Deny")


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("viewer", ("joystick", "actuators", "truck", "guard/alert", "guard/heartbeat")),
        ("engineer", ("joystick", "guard/alert", "guard/recorder")),
        ("machine", ("guard/alert", "guard/heartbeat", "truck")),
        ("truck", ("joystick", "actuators", "guard/alert")),
        ("recorder", ("joystick", "guard/heartbeat")),
        ("guard", ("joystick", "actuators", "guard/recorder")),
    ],
)
def test_nobody_puts_what_is_not_his(place: Fort, name: str, parts: tuple[str, ...]) -> None:
    before = beat(place)
    forged = json.dumps({"schema": "rampe.heartbeat.v1", "version": "forged"}).encode()
    with session(place, name) as attacker:
        for part in parts:
            payload = forged if part.startswith("guard/") else NEVER
            attacker.put(f"{MACHINE}/{part}", payload, congestion_control=BLOCK)
            attacker.delete(f"{MACHINE}/{part}", congestion_control=BLOCK)
        untouched(place, before)
    for part in parts:
        place.denied(name, "Put", f"{MACHINE}/{part}")
        place.denied(name, "Delete", f"{MACHINE}/{part}")


@pytest.mark.parametrize(
    ("name", "commands"),
    [
        ("viewer", ("ack", "shelve", "scene/put", "forget")),
        ("operator", ("scene/put", "forget")),
        ("machine", ("state", "ack", "shelve", "scene/put", "forget")),
        ("recorder", ("ack", "forget")),
    ],
)
def test_commands_are_for_those_who_may(place: Fort, name: str, commands: tuple[str, ...]) -> None:
    with session(place, name) as attacker:
        for command in commands:
            wish = {"alert_id": "x", "who": f"false {name}", "duration_s": 20}
            assert answers(attacker, f"{BASE}/{command}", wish) == []
            place.denied(name, "Query", f"{BASE}/{command}")
    assert f"false {name}" not in place.guard.err


def test_a_command_of_somebody_who_may_is_logged_with_his_name(place: Fort) -> None:
    with session(place, "operator") as operator:
        wish = {"alert_id": "no-such-alert", "who": "anna of the yard"}
        (answer,) = answers(operator, f"{BASE}/ack", wish)
        assert "no-such-alert" in answer
    until(lambda: "ack by anna of the yard: refused" in place.guard.err, 5.0, "the guard's log")
    with session(place, "engineer") as engineer:
        (answer,) = answers(engineer, f"{BASE}/scene/put", {"who": "eve", "scene": "no: scene"})
        assert answer
    until(lambda: "by eve: refused" in place.guard.err, 5.0, "the guard's log")


def test_a_right_to_keys_is_none_to_patterns_that_hold_them(place: Fort) -> None:
    before = beat(place)
    patterns = (f"{MACHINE}/*", f"{MACHINE}/joystick$*", "rampe/**", "**")
    with session(place, "machine") as machine:
        for pattern in patterns:
            machine.put(pattern, NEVER, congestion_control=BLOCK)
            time.sleep(0.005)  # what comes sooner is dropped for that, and not told of
        untouched(place, before)
    for pattern in patterns:
        place.denied("machine", "Put", pattern)
    wish = {"alert_id": "x", "who": "everyone"}
    with session(place, "engineer") as engineer:
        for pattern in (f"{BASE}/*", f"{BASE}/**", "rampe/*/*/guard/ack", "rampe/**"):
            assert answers(engineer, pattern, wish) == []
            place.denied("engineer", "Query", pattern)
    with session(place, "viewer") as viewer:  # a whole site's guards may be asked how they are
        (state,) = viewer.get("rampe/*/*/guard/state", timeout=2.0)
        assert state.ok is not None


def test_what_is_too_large_is_counted_or_never_arrives(place: Fort) -> None:
    before = beat(place)
    with session(place, "machine") as machine:
        for size in (129 * 1024, 1 << 20, 20 << 20):  # the router drops it without a word
            machine.put(f"{MACHINE}/joystick", b"x" * size, congestion_control=BLOCK)
        time.sleep(0.5)
        untouched(place, before)
        machine.put(f"{MACHINE}/joystick", b"x" * (65 * 1024), congestion_control=BLOCK)
        count = before["rejected"].get("joystick", {}).get("too_large", 0)
        place.ears.wait(
            "heartbeat",
            lambda b: b["rejected"].get("joystick", {}).get("too_large") == count + 1,
            5.0,
            time.monotonic(),
        )


def test_old_messages_again_are_refused_and_counted(place: Fort) -> None:
    """Whoever has the machine's certificate may put; what was true once is not taken again."""
    heard: list[bytes] = []
    with session(place, "viewer") as viewer, session(place, "machine") as machine:
        ears = viewer.declare_subscriber(
            f"{MACHINE}/actuators", lambda s: heard.append(s.payload.to_bytes())
        )
        until(lambda: len(heard) >= 20, 5.0, "twenty messages")
        ears.undeclare()
        time.sleep(0.5)
        before = beat(place)
        replayed_s = time.monotonic()
        for payload in heard[:20]:
            machine.put(f"{MACHINE}/actuators", payload, congestion_control=BLOCK)
            time.sleep(0.002)
        after = place.ears.wait(
            "heartbeat",
            lambda b: (
                sum(b["rejected"].get("actuators", {}).values())
                >= sum(before["rejected"].get("actuators", {}).values()) + 10
            ),
            5.0,
            replayed_s,
        ).body
    assert set(after["rejected"]["actuators"]) <= {"stamp_back", "stamp_jump", "too_large"}


def test_a_flood_is_thinned_out_at_the_router(place: Fort) -> None:
    before = beat(place)
    with session(place, "machine") as machine:
        flood = machine.declare_publisher(f"{MACHINE}/joystick", congestion_control=BLOCK)
        began_s = time.monotonic()
        for _ in range(20_000):
            flood.put(NEVER)
        took_s = time.monotonic() - began_s
        after = beat(place)
    taken = sum(after["rejected"].get("joystick", {}).values()) - sum(
        before["rejected"].get("joystick", {}).values()
    )
    assert 0 < taken <= 2000.0 * (took_s + 1.0)
    assert taken < 20_000
    place.logged("dropped by the downsampling interceptor")


def test_a_client_s_certificate_does_not_make_a_router(place: Fort, tmp_path: Path) -> None:
    """Who has stolen a machine's certificate cannot pose as the router that it looks for."""
    endpoint = free_endpoint()
    text = (place.folder / "router.json5").read_text()
    text = text.replace(place.endpoint.partition("/")[2], endpoint.partition("/")[2])
    false = tmp_path / "router.json5"
    false.write_text(text.replace("/router/tls", "/machine/tls"))
    with secure_router(tmp_path, false), pytest.raises(zenoh.ZError):
        zenoh.open(_client(place.pki.at(endpoint, "viewer")))


def test_who_s_certificate_ends_is_cut_off(place: Fort) -> None:
    place.pki.issue_for("soon", 3.0)
    with session(place, "soon") as viewer:
        (state,) = viewer.get(f"{BASE}/state", timeout=2.0)
        assert state.ok is not None
        until(lambda: not viewer.info.routers_zid(), 10.0, "the end of the session")
    assert beat(place)["status"] != "not_monitoring"


def _client(endpoint: str) -> zenoh.Config:
    config = zenoh.Config()
    for path, value in (
        ("mode", '"client"'),
        ("connect/endpoints", json.dumps([endpoint])),
        ("connect/timeout_ms", "1000"),
        ("connect/exit_on_failure", "true"),
        ("listen/endpoints", "[]"),
        ("scouting/multicast/enabled", "false"),
    ):
        config.insert_json5(path, value)
    return config
