"""Queries over Zenoh, asked and answered: nothing is computed in a callback here either."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

import zenoh

from rampe_guard.errors import MessageError


@dataclass(frozen=True, slots=True)
class Message:
    """A payload as it came, with the exact key that it was put on, and what was attached to it."""

    key: str
    payload: bytes
    attachment: bytes | None = None


class Inquiry:
    """A question to everyone whose queryable matches a key expression, answered bit by bit."""

    def __init__(self, session: zenoh.Session, key: str, timeout_s: float) -> None:
        # no ring: that forgets what waits in it as soon as the last answer has come
        self._replies = session.get(
            key,
            zenoh.handlers.FifoChannel(4096),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        self.done = False
        """All have answered, or the time is over."""

    def drain(self) -> list[Message]:
        """Answers that arrived since the last look; errors are left out; never blocks."""
        answers = []
        try:
            while (reply := self._replies.try_recv()) is not None:
                if reply.ok is not None:
                    key = str(reply.ok.key_expr)
                    answers.append(Message(key, reply.ok.payload.to_bytes()))
        except zenoh.ZError:  # the channel is empty, and closed
            self.done = True
        return answers


@dataclass(frozen=True, slots=True)
class Request:
    """A query that waits for an answer."""

    key: str
    payload: bytes | None
    _query: Any

    def check_exact(self) -> None:
        """See whether it was asked of this key alone, and not of all that a pattern matches.

        Raises:
            MessageError: ``wildcard_key``.
        """
        if (asked := str(self._query.key_expr)) != self.key:
            raise MessageError("wildcard_key", f"asked on {asked!r}, expected {self.key!r}")

    def reply(self, payload: bytes) -> None:
        """Answer it."""
        with contextlib.suppress(zenoh.ZError):  # whoever asked may be gone
            self._query.reply(self.key, payload, encoding=zenoh.Encoding.APPLICATION_JSON)
        self._query.drop()

    def refuse(self, text: str) -> None:
        """Answer with an error."""
        with contextlib.suppress(zenoh.ZError):
            self._query.reply_err(text.encode(), encoding=zenoh.Encoding.TEXT_PLAIN)
        self._query.drop()


class Desk:
    """A queryable on one key, drained by its owner."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._key = key
        self._queryable = session.declare_queryable(key, zenoh.handlers.RingChannel(256))

    def drain(self, most: int = 4) -> list[Request]:
        """The oldest requests that wait, ``most`` at once: however many ask, the worker goes on."""
        requests: list[Request] = []
        while len(requests) < most and (query := self._queryable.try_recv()) is not None:
            payload = None if query.payload is None else query.payload.to_bytes()
            requests.append(Request(self._key, payload, query))
        return requests
