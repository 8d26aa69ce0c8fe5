"""Metrics say what the heartbeat said; a client that is slow or hasty gets nowhere."""

from __future__ import annotations

import contextlib
import http.client
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from prometheus_client.parser import text_string_to_metric_families

from rampe_guard import wire
from rampe_guard.core.config import InputConfig
from rampe_guard.core.monitor import InputMonitor
from rampe_guard.errors import SettingsError
from rampe_guard.options import address
from rampe_guard.runtime import metrics_server
from rampe_guard.runtime.health import Pulse
from rampe_guard.runtime.metrics import OLD_S, Metrics
from rampe_guard.runtime.metrics_server import MetricsServer
from rampe_guard.runtime.metrics_start import served
from rampe_guard.runtime.say import Sayer
from rampe_guard.settings import MetricsSettings, load_site
from rampe_guard.settings.network import is_loopback
from tests.support.processes import BENCH, until

SAY = Sayer("rampe_guard.test")


def scraped(text: str) -> dict[str, float]:
    """Samples by name and labels."""
    return {
        s.name + "".join(f"|{k}={v}" for k, v in sorted(s.labels.items())): s.value
        for family in text_string_to_metric_families(text)
        for s in family.samples
    }


@pytest.fixture(scope="module")
def pulse() -> Pulse:
    return Pulse(load_site(BENCH), "boot", 0.0, lambda now_s: now_s, "hash")


def beat(pulse: Pulse, **changes: Any) -> wire.Heartbeat:
    monitor = InputMonitor(InputConfig(), 0.0)
    monitor.accept("joystick", 3.0)
    monitor.accept("actuators", 3.0)
    return msgspec.structs.replace(pulse.beat(monitor.health(3.0), 3.0, 0, {}), **changes)


def test_before_the_first_heartbeat_nothing_is_said_of_the_guard() -> None:
    found = scraped(Metrics().text().decode())
    assert not [name for name in found if name.startswith("rampe")]
    assert found["process_resident_memory_bytes"] > 0


def test_a_heartbeat_is_told_whole(pulse: Pulse) -> None:
    for ms in (0.4, 3.0, 2000.0):
        pulse.step(3.0, ms)
    told = beat(
        pulse,
        status="degraded",
        reasons=(wire.Reason(code="overload", text="", key=None),),
        rejected={"joystick": {"overload": 7, "bad_json": 1}},
        alerts={"imminent": 2},
        learned=wire.Learned(categories=3, occurrences=40),
        memory=wire.Remembered(situations=5, work_s=60.0),
        primitives={"learned": 4},
        canary=wire.CanaryTrial(result="failed", age_s=1.0),
        save_failures=2,
        router=False,
        objects=(
            wire.ObjectInput(
                name="truck", key="k", placed=False, age_s=None, grown_m=None, rate_hz=None,
                accepted=1, rejected={"bad_json": 2},
            ),
        ),
    )  # fmt: skip
    metrics = Metrics(lambda: 10.5)
    metrics.show(told, pulse, 10.0)
    found = scraped(metrics.text().decode())
    expected = {
        "rampe_guard_status|status=ok": 0,
        "rampe_guard_status|status=degraded": 1,
        "rampe_guard_status|status=not_monitoring": 0,
        "rampe_guard_reason|code=overload": 1,
        "rampe_guard_heartbeat_age_seconds": 0.5,
        "rampe_guard_input_rejected_total|input=joystick|reason=overload": 7,
        "rampe_guard_input_accepted_total|input=joystick": 1,
        "rampe_guard_input_age_seconds|input=actuators": 0.5,
        "rampe_guard_alerts|level=imminent": 2,
        "rampe_guard_alerts|level=warning": 0,
        "rampe_guard_categories": 3,
        "rampe_guard_occurrences": 40,
        "rampe_guard_situations": 5,
        "rampe_guard_primitives_total|outcome=learned": 4,
        "rampe_guard_canary_ok": 0,
        "rampe_guard_canary_age_seconds": 1.5,
        "rampe_guard_save_failures_total": 2,
        "rampe_guard_router_connected": 0,
        "rampe_guard_object_placed|object=truck": 0,
        "rampe_guard_object_rejected_total|object=truck|reason=bad_json": 2,
        "rampe_guard_loop_seconds_bucket|le=0.0005": 1,
        "rampe_guard_loop_seconds_bucket|le=0.005": 2,
        "rampe_guard_loop_seconds_bucket|le=+Inf": 3,
        "rampe_guard_loop_seconds_count": 3,
        "rampe_guard_loop_seconds_sum": pytest.approx(2.0034),
    }
    assert {name: found.get(name) for name in expected} == expected
    assert "rampe_guard_object_age_seconds|object=truck" not in found  # unknown is not 0


def test_a_heartbeat_that_is_old_is_never_ok(pulse: Pulse) -> None:
    metrics = Metrics(lambda: 10.0 + OLD_S + 0.1)
    metrics.show(beat(pulse), pulse, 10.0)
    found = scraped(metrics.text().decode())
    assert found["rampe_guard_status|status=ok"] == 0
    assert found["rampe_guard_status|status=not_monitoring"] == 1
    assert found["rampe_guard_reason|code=no_heartbeat"] == 1


def test_two_guards_in_one_process_do_not_share_anything(pulse: Pulse) -> None:
    first, second = Metrics(), Metrics()
    first.show(beat(pulse), pulse, time.monotonic())
    assert "rampe_guard_status" in first.text().decode()
    assert "rampe_guard_status" not in second.text().decode()


@pytest.fixture
def server(pulse: Pulse, monkeypatch: pytest.MonkeyPatch) -> Iterator[MetricsServer]:
    monkeypatch.setattr(metrics_server._Handler, "timeout", 0.3)
    monkeypatch.setattr(metrics_server, "PATIENCE_S", 0.3)
    metrics = Metrics()
    metrics.show(beat(pulse), pulse, time.monotonic())
    with MetricsServer(metrics, "127.0.0.1", 0) as served_there:
        yield served_there


def get(server: MetricsServer, path: str = "/metrics") -> tuple[str, str]:
    with urllib.request.urlopen(f"http://127.0.0.1:{server.port}{path}", timeout=5.0) as answer:
        return answer.headers["Content-Type"], answer.read().decode()


def test_it_is_served_as_prometheus_asks(server: MetricsServer) -> None:
    kind, text = get(server)
    assert kind.startswith("text/plain; version=")
    assert "rampe_guard_status" in scraped(text).keys().__str__()
    with pytest.raises(urllib.error.HTTPError, match="404"):
        get(server, "/etc/passwd")


@pytest.mark.parametrize(
    ("host", "code"),
    [
        *(("127.0.0.1:1", 200), ("localhost", 200), ("[::1]:9464", 200), (None, 200)),
        *(
            ("evil.example", 403),
            ("127.0.0.1.evil.example:9464", 403),
            ("10.0.0.1", 403),
            ("", 403),
        ),
    ],
)
def test_on_loopback_no_other_name_leads_there(
    server: MetricsServer, host: str | None, code: int
) -> None:
    """DNS rebinding: a browser believes that it talks to evil.example."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5.0)
    with contextlib.closing(connection):
        connection.putrequest("GET", "/metrics", skip_host=True)
        if host is not None:
            connection.putheader("Host", host)
        connection.endheaders()
        answer = connection.getresponse()
        assert answer.status == code
        assert (b"rampe_guard_status" in answer.read()) is (code == 200)


def test_beyond_loopback_it_is_found_by_any_name() -> None:
    with MetricsServer(Metrics(), "0.0.0.0", 0) as far:  # noqa: S104
        address = f"http://127.0.0.1:{far.port}/metrics"
        asked = urllib.request.Request(address, headers={"Host": "guard.example:9464"})
        with urllib.request.urlopen(asked, timeout=5.0) as answer:  # noqa: S310
            assert answer.status == 200


def test_clients_that_never_ask_are_cut_off(server: MetricsServer) -> None:
    half_open = [
        socket.create_connection(("127.0.0.1", server.port), 5.0)
        for _ in range(2 * metrics_server.AT_ONCE)
    ]
    for k, one in enumerate(half_open):
        if k % 2:
            one.sendall(b"GET /metr")

    def answered() -> bool:
        try:
            return "rampe_guard_status" in get(server)[1]
        except OSError:  # all seats are taken
            return False

    until(answered, 10.0, "an answer to a good client")
    for one in half_open:
        one.settimeout(5.0)
        with contextlib.suppress(ConnectionResetError):
            assert one.recv(1 << 16) == b""  # closed, without a word
        one.close()


def test_a_byte_at_a_time_is_cut_off_too(server: MetricsServer) -> None:
    with socket.create_connection(("127.0.0.1", server.port), 5.0) as slow:
        slow.sendall(b"GET /metrics HTTP/1.0\r\nX: ")

        def closed() -> bool:
            try:
                slow.sendall(b"x")
                time.sleep(0.1)
            except OSError:
                return True
            return False

        until(closed, 10.0, "cut off")


def test_hasty_clients_get_the_text_of_a_moment_ago(server: MetricsServer) -> None:
    made: list[bytes] = []
    text = server._metrics.text

    def counted() -> bytes:
        made.append(text())
        return made[-1]

    server._metrics.text = counted  # type: ignore[method-assign]
    began_s = time.monotonic()
    for _ in range(30):
        get(server)
    assert len(made) <= 2 + (time.monotonic() - began_s) / metrics_server.FRESH_S


def test_a_port_that_is_taken_ends_a_start_but_never_a_guard_that_came_back(
    server: MetricsServer,
) -> None:
    where = MetricsSettings("127.0.0.1", server.port)
    with (
        pytest.raises(SettingsError, match=rf"cannot listen on 127.0.0.1:{server.port}"),
        served(where, SAY, again=False),
    ):
        pass
    with served(where, SAY, again=True) as show:
        assert show is None


def test_addresses() -> None:
    assert address("9464") == ("127.0.0.1", 9464)
    assert address("0.0.0.0:9464") == ("0.0.0.0", 9464)  # noqa: S104 - only if somebody says so
    assert address("[::1]:80") == ("::1", 80)
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert not is_loopback("10.0.0.1")
    assert not is_loopback("plant.example")
