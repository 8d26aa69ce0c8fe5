"""The door before viser's web server: who may come in, how many, and for how long.

viser starts its server (of the websockets package) by itself and takes no options for it, so its
call is caught while it starts: `guarding`. Requests are judged before viser sees them; those who
connect and say nothing, or read nothing, are let go.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any, Final

import websockets.asyncio.server as library
from websockets.datastructures import Headers, MultipleValuesError
from websockets.http11 import Request, Response

from rampe_guard.dashboard.access import Access, Answer, Asked
from rampe_guard.runtime.say import Sayer

OPEN_S: Final = 5.0
"""Time in which a request must have come."""
FETCH_S: Final = 60.0
"""Time in which a file must have been read; the page has some megabytes."""
MAX_WAITING: Final = 64
"""Connections that have asked for nothing yet; beyond, the eldest of the busiest address goes."""
MAX_PAGES: Final = 64
MAX_MESSAGE: Final = 1024 * 1024
"""Of what a page may send [bytes]; presses and camera poses are small."""

_Hook = Callable[[library.ServerConnection, Request], Response | None]


class Gate:
    """Judges requests and bounds connections.

    Args:
        access: the rules.
        say: is told of the refused, each kind once a second.
    """

    def __init__(self, access: Access, say: Sayer) -> None:
        self._access, self._say = access, say
        self._lock = threading.Lock()
        self._waiting: dict[_Connection, str] = {}  # in order of arrival, with the address
        self._pages: set[_Connection] = set()
        self.refused: Counter[str] = Counter()
        """How many were refused or let go, by reason."""

    @contextlib.contextmanager
    def guarding(self) -> Iterator[None]:
        """Stand before the one server that is started inside.

        Raises:
            RuntimeError: none was: nothing may be served without the gate.
        """
        used = []
        original = library.serve

        def serve(handler: Any, *args: Any, process_request: _Hook, **options: Any) -> Any:
            used.append(1)
            mine = {
                "process_request": functools.partial(self._judge, process_request),
                "process_response": self._dress,
                "open_timeout": OPEN_S,
                "max_size": MAX_MESSAGE,
                "create_connection": functools.partial(_Connection, self),
                "server_header": None,
            }
            return original(handler, *args, **(options | mine))

        library.serve = serve  # type: ignore[misc, assignment]
        try:
            yield
        finally:
            library.serve = original  # type: ignore[misc]
        if not used:
            raise RuntimeError("viser has started its server in another way than it used to")

    # in viser's thread

    def came(self, connection: _Connection) -> None:
        """Somebody connected, and has asked for nothing yet."""
        self._waiting[connection] = connection.address
        if len(self._waiting) > MAX_WAITING:
            (busiest, _), *_ = Counter(self._waiting.values()).most_common(1)
            eldest = next(one for one, whose in self._waiting.items() if whose == busiest)
            self._drop(eldest, "too_many_waiting")

    def went(self, connection: _Connection) -> None:
        """It is gone, whatever it was."""
        if self._waiting.pop(connection, None) is not None:
            self._count("said_nothing", "connected and asked for nothing")
        self._pages.discard(connection)

    def _judge(self, viser: _Hook, connection: _Connection, request: Request) -> Response | None:
        self._waiting.pop(connection, None)
        connection.end_after(FETCH_S)
        asked = _asked(request)
        if asked is None:
            answer: Answer | None = Answer(HTTPStatus.BAD_REQUEST, "a header twice", "bad_request")
        else:
            answer = self._access.judge(asked)
        if answer is None and asked is not None and asked.websocket:
            if len(self._pages) >= MAX_PAGES:
                text = f"{MAX_PAGES} pages are open; close one"
                answer = Answer(HTTPStatus.SERVICE_UNAVAILABLE, text, "too_many_pages")
            else:
                self._pages.add(connection)
                connection.end_after(None)
        if answer is None:
            return viser(connection, request)
        if answer.status >= HTTPStatus.BAD_REQUEST:
            self._count(answer.reason, f"{connection.address} refused: {answer.reason}")
        return connection_answer(answer)

    def _dress(
        self, _connection: library.ServerConnection, _request: Request, response: Response
    ) -> None:
        for name, value in self._access.headers().items():
            response.headers[name] = value

    def _drop(self, connection: _Connection, reason: str) -> None:
        self._waiting.pop(connection, None)
        self._count(reason, f"more than {MAX_WAITING} connections that ask for nothing")
        connection.transport.abort()

    def _count(self, reason: str, text: str) -> None:
        with self._lock:
            self.refused[reason] += 1
            count = self.refused[reason]
        self._say.warn(reason, text, reason=reason, count=count)


class _Connection(library.ServerConnection):
    """A connection that the gate knows of from its first moment."""

    def __init__(self, gate: Gate, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._gate = gate
        self.address = "?"
        self._end: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        peer = transport.get_extra_info("peername")
        self.address = str(peer[0]) if peer else "?"
        super().connection_made(transport)
        self._gate.came(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self.end_after(None)
        self._gate.went(self)
        super().connection_lost(exc)

    def end_after(self, seconds: float | None) -> None:
        """Be let go then, whatever it does; None: never."""
        if self._end is not None:
            self._end.cancel()
        self._end = None
        if seconds is not None:
            self._end = asyncio.get_running_loop().call_later(seconds, self.transport.abort)


def connection_answer(answer: Answer) -> Response:
    """As the library sends it; the connection is closed then."""
    body = f"{answer.text}\n".encode()
    headers = Headers([*answer.headers, ("Content-Type", "text/plain; charset=utf-8")])
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(answer.status, answer.status.phrase, headers, body)


def _asked(request: Request) -> Asked | None:
    """None if a header that matters was sent twice."""
    named = ("Host", "Origin", "Authorization", "Upgrade")
    try:
        host, origin, authorization, upgrade = (request.headers.get(name) for name in named)
    except MultipleValuesError:
        return None
    return Asked(
        path=request.path,
        host=host,
        origin=origin,
        cookie="; ".join(request.headers.get_all("Cookie")),
        authorization=authorization,
        protocol=", ".join(request.headers.get_all("Sec-WebSocket-Protocol")),
        websocket=upgrade == "websocket",  # the very comparison that viser makes
    )
