"""The dashboard's door on real sockets: token, names, headers, and those who hold it open."""

from __future__ import annotations

import contextlib
import http.client
import re
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.support import processes
from tests.support.dashboards import free_port
from tests.support.processes import BENCH, Process, until

viser = pytest.importorskip("viser", reason="the dashboard extra is not installed")
pytestmark = pytest.mark.e2e

PAGE = Subprotocol(f"viser-v{viser.__version__}")
HALF_OPEN = 200


@dataclass
class Far:
    """A dashboard on all addresses, which the test reaches over loopback."""

    port: int
    process: Process
    token: str
    cookie: str


@pytest.fixture(scope="module")
def far(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Far]:
    """Its machine has no router: its pages are there all the same."""
    port, folder = free_port(), tmp_path_factory.mktemp("far")
    args = ("-m", "rampe_guard", "dashboard", BENCH, "--connect", processes.free_endpoint())
    where = ("--port", str(port), "--host", "0.0.0.0")  # noqa: S104
    process = Process(folder, "dashboard", [*args, *where])
    try:
        process.wait_for("dashboard on", 60.0)
        found = re.search(rf"dashboard on http://0\.0\.0\.0:{port}/\?token=(\S+)", process.out)
        assert found is not None
        _, headers, _ = get(port, f"/?token={found[1]}")
        yield Far(port, process, found[1], headers["set-cookie"].partition(";")[0])
        assert "Traceback" not in process.err, process.err
        assert found[1] not in process.err
    finally:
        process.close()


def get(port: int, path: str = "/", **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20.0)
    with contextlib.closing(connection):
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()


def opened(port: int, **headers: str) -> int:
    """The answer to a page's websocket: 101 if it was opened."""
    origin = headers.pop("Origin", None)
    try:
        with connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[PAGE],
            origin=origin,  # type: ignore[arg-type]
            additional_headers=headers,
            max_size=None,
        ):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def test_nothing_is_had_without_the_token(far: Far) -> None:
    assert get(far.port)[0] == 401
    assert get(far.port, "/?token=wrong")[0] == 401
    assert opened(far.port) == 401  # so no button can be pressed
    until(lambda: "refused: no_token" in far.process.err, 5.0, "a word in the log")
    assert far.process.out.count(far.token) == 1


def test_the_printed_address_opens_the_page(far: Far) -> None:
    status, headers, _ = get(far.port, f"/?token={far.token}")
    assert (status, headers["location"]) == (303, "/")
    assert headers["set-cookie"].partition(";")[0] == far.cookie
    assert far.token not in far.cookie
    status, headers, body = get(far.port, Cookie=far.cookie)
    assert status == 200
    assert b"<html" in body[:500].lower()
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert not {"set-cookie", "server"} & headers.keys()


def test_other_sites_open_no_websocket_even_with_the_cookie(far: Far) -> None:
    assert opened(far.port, Cookie=far.cookie) == 101
    assert opened(far.port, Cookie=far.cookie, Origin=f"http://127.0.0.1:{far.port}") == 101
    assert opened(far.port, Cookie=far.cookie, Origin="http://evil.example") == 403
    until(lambda: "refused: wrong_origin" in far.process.err, 5.0, "a word in the log")


def test_by_a_foreign_name_the_token_opens_nothing(far: Far) -> None:
    status, headers, body = get(far.port, f"/?token={far.token}", Host="evil.example")
    assert (status, "set-cookie" in headers) == (403, False)
    assert b"--name" in body
    assert get(far.port, Host=f"evil.example:{far.port}", Cookie=far.cookie)[0] == 403
    until(lambda: "refused: wrong_host" in far.process.err, 5.0, "a word in the log")


def test_files_outside_of_the_page_are_not_there(far: Far) -> None:
    for path in (
        "/../../../../etc/passwd",
        "/%2e%2e/%2e%2e/_viser.py",
        "/..\\..\\x",
        "//etc/passwd",
    ):
        assert get(far.port, path, Cookie=far.cookie)[0] == 404


def test_who_connects_and_asks_for_nothing_keeps_nobody_out(far: Far) -> None:
    """Slow loris: half a request on each of many connections, a byte now and then."""
    with contextlib.ExitStack() as stack:
        held = [stack.enter_context(reach(far.port)) for _ in range(HALF_OPEN)]
        for number, one in enumerate(held):
            with contextlib.suppress(OSError):
                one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0" if number % 2 else b"G")
        assert get(far.port, Cookie=far.cookie)[0] == 200
        assert opened(far.port, Cookie=far.cookie) == 101
        end_s = time.monotonic() + 20.0
        left = held
        while left and time.monotonic() < end_s:
            assert get(far.port, Cookie=far.cookie)[0] == 200
            time.sleep(0.5)
            for one in left:
                with contextlib.suppress(OSError):
                    one.sendall(b"1")
            left = [one for one in left if alive(one)]
        assert not left, f"{len(left)} are still held open"
    until(lambda: "ask for nothing" in far.process.err, 5.0, "a word in the log")


def reach(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), 5.0)


def alive(one: socket.socket) -> bool:
    one.setblocking(False)  # noqa: FBT003 - its name
    try:
        return bool(one.recv(65536))
    except BlockingIOError:
        return True
    except OSError:
        return False
