"""A bus within the process: what `runtime.zenoh_io.Bus` is to a daemon, without a network.

For fuzzing a million messages through the daemon's own loop. Rings drop their oldest as the real
ones do; requests are real `Request`s, with a stand-in for Zenoh's query.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Self

from rampe_guard.runtime.zenoh_queries import Message, Request


class MemoryInbox:
    """See `zenoh_io.Inbox`."""

    def __init__(self, capacity: int) -> None:
        self.waiting: deque[Message] = deque(maxlen=capacity)
        self._capacity = capacity
        self.overruns = 0

    def drain(self) -> list[Message]:
        messages = list(self.waiting)
        self.waiting.clear()
        self.overruns += len(messages) == self._capacity
        return messages

    def close(self) -> None:
        """Nothing to close."""


class MemoryOutbox:
    """See `zenoh_io.Outbox`."""

    def __init__(self, key: str, sent: Callable[[str, bytes], None]) -> None:
        self._key, self._sent = key, sent
        self.heard = True

    def put(self, payload: bytes) -> None:
        self._sent(self._key, payload)


class Query:
    """What a `Request` answers to."""

    def __init__(self, key: str) -> None:
        self.key_expr = key
        self.answers: list[bytes] = []
        self.refusals: list[str] = []
        self.dropped = False

    def reply(self, _key: str, payload: bytes, **_: Any) -> None:
        self.answers.append(payload)

    def reply_err(self, payload: bytes, **_: Any) -> None:
        self.refusals.append(payload.decode("utf-8", "replace"))

    def drop(self) -> None:
        self.dropped = True


class MemoryDesk:
    """See `zenoh_io.Desk`."""

    def __init__(self, key: str) -> None:
        self._key = key
        self._waiting: deque[Request] = deque(maxlen=256)

    def ask(self, payload: bytes | None, key: str | None = None) -> Query:
        query = Query(key or self._key)
        self._waiting.append(Request(self._key, payload, query))
        return query

    def drain(self, most: int = 16) -> list[Request]:
        return [self._waiting.popleft() for _ in range(min(most, len(self._waiting)))]


class MemoryLiveness:
    """See `zenoh_io.Liveness`: it lives."""

    alive = True

    def poll(self) -> bool | None:
        return self.alive


class MemoryBus:
    """See `zenoh_io.Bus`.

    Args:
        sent: told of all that is put: key and payload.
    """

    def __init__(self, sent: Callable[[str, bytes], None]) -> None:
        self._sent = sent
        self.inboxes: dict[str, MemoryInbox] = {}
        self.desks: dict[str, MemoryDesk] = {}
        self.connected = True

    def open_retrying(self, *_: object) -> Self:
        """In the place of the class method."""
        return self

    def put(self, key: str, payload: bytes, arrives_at: str | None = None) -> None:
        """Put on a key; one that is a pattern arrives at what it matches."""
        inbox = self.inboxes.get(arrives_at or key)
        if inbox is not None:
            inbox.waiting.append(Message(key, payload))

    def inbox(self, key: str, capacity: int = 256) -> MemoryInbox:
        return self.inboxes.setdefault(key, MemoryInbox(capacity))

    def outbox(self, key: str, _schema: str | None = None, **_: bool) -> MemoryOutbox:
        return MemoryOutbox(key, self._sent)

    def desk(self, key: str) -> MemoryDesk:
        return self.desks.setdefault(key, MemoryDesk(key))

    def liveness(self, _key: str) -> MemoryLiveness:
        return MemoryLiveness()

    def declare_alive(self, _key: str) -> None:
        """Nobody looks."""

    def is_alive(self, _key: str) -> bool:
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to close."""
