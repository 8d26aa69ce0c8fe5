"""``/metrics`` over HTTP, from threads that the worker never waits for.

Scrapes come every few seconds; what comes oftener gets the text of a moment ago, and what holds
a connection without asking is cut off. So neither a slow nor a hasty client costs the worker
more than a few milliseconds a second.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from socket import AF_INET6, SHUT_RDWR, socket
from types import TracebackType
from typing import Any, Final, Self

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.metrics import CONTENT_TYPE, Metrics
from rampe_guard.settings.network import host_of, is_loopback

FRESH_S: Final = 0.2
"""A text is served again for so long: a heartbeat's time."""
PATIENCE_S: Final = 5.0
"""A client that takes longer for a request or its answer is cut off."""
AT_ONCE: Final = 8
"""Connections that are served at once; others are closed."""
_BREATH_S: Final = 0.01
"""Between two connections: at most a hundred a second."""


class _Handler(BaseHTTPRequestHandler):
    """One request a connection (HTTP/1.0): what is slow ends with it."""

    server: _Server
    timeout = PATIENCE_S
    server_version = "rampe-guard"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer ``/metrics``, and where it is."""
        if not self._named():
            text = b"called by a name that is not this computer's own; see 127.0.0.1\n"
            self._answer(HTTPStatus.FORBIDDEN, "text/plain", text)
        elif self.path.partition("?")[0] == "/metrics":
            self._answer(HTTPStatus.OK, CONTENT_TYPE, self.server.text())
        else:
            self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"see /metrics\n")

    def _named(self) -> bool:
        """On loopback by no other name: a page of another site would read it (DNS rebinding)."""
        hosts = self.headers.get_all("Host", [])
        return not self.server.here or all(is_loopback(host_of(host) or "") for host in hosts)

    def _answer(self, code: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Scrapes are no news."""


class _Server(HTTPServer):
    request_queue_size = 16
    text: Callable[[], bytes]

    def __init__(self, address: tuple[str, int]) -> None:
        self._seats = threading.Semaphore(AT_ONCE)
        self.here = is_loopback(address[0])
        if ":" in address[0]:
            self.address_family = AF_INET6
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Without the look-up of our name, which may take long."""
        self.socket.bind(self.server_address)
        host, port = self.socket.getsockname()[:2]
        self.server_name, self.server_port = str(host), int(port)

    def process_request(self, request: socket | tuple[bytes, socket], client_address: Any) -> None:
        """Serve it in a thread, if one is free."""
        time.sleep(_BREATH_S)
        if isinstance(request, tuple) or not self._seats.acquire(blocking=False):
            self.shutdown_request(request)
            return
        threading.Thread(
            target=self._serve, args=(request, client_address), name="metrics", daemon=True
        ).start()

    def _serve(self, request: socket, client_address: Any) -> None:
        # a time-out of its own for the whole: a byte every second is slow, too
        end = threading.Timer(2.0 * PATIENCE_S, _cut, [request])
        end.daemon = True
        end.start()
        try:
            with contextlib.suppress(OSError, ValueError):  # it went away, or was cut off
                self.finish_request(request, client_address)
        finally:
            end.cancel()
            self.shutdown_request(request)
            self._seats.release()


def _cut(request: socket) -> None:
    """Closing does not end a read that another thread is in; this does."""
    with contextlib.suppress(OSError):
        request.shutdown(SHUT_RDWR)


class MetricsServer:
    """Serves metrics; a context manager.

    Args:
        metrics: what is served.
        host: address to listen on.
        port: TCP port; 0 is any free one.

    Raises:
        SettingsError: it cannot listen there.
    """

    def __init__(self, metrics: Metrics, host: str, port: int) -> None:
        self._metrics = metrics
        self._lock = threading.Lock()
        self._text = b""
        self._made_s = float("-inf")
        try:
            self._server = _Server((host, port))
        except OSError as error:
            why = error.strerror or error
            raise SettingsError(f"metrics: cannot listen on {host}:{port}: {why}") from None
        self._server.text = self._fresh
        self.port = int(self._server.server_port)
        self._thread = threading.Thread(
            target=self._server.serve_forever, name="metrics", args=(0.2,), daemon=True
        )

    def _fresh(self) -> bytes:
        with self._lock:
            now_s = time.monotonic()
            if now_s - self._made_s >= FRESH_S:
                self._text, self._made_s = self._metrics.text(), now_s
            return self._text

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
