"""Hears everything that a guard publishes, with the time of arrival."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import zenoh

from tests.support.processes import until


def open_session(endpoint: str | list[str]) -> zenoh.Session:
    """A client of one router (the first that answers) that comes back by itself."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5(
        "connect/endpoints", json.dumps([endpoint] if isinstance(endpoint, str) else endpoint)
    )
    config.insert_json5("connect/timeout_ms", "5000")
    config.insert_json5("connect/retry", '{"period_init_ms": 100, "period_max_ms": 500}')
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    return zenoh.open(config)


@dataclass(frozen=True, slots=True)
class Heard:
    """One message: when it arrived on the monotonic clock [s], its key's last part, its JSON."""

    at_s: float
    topic: str
    body: dict[str, Any]


class Ears:
    """Subscribes to ``{base}/*`` on a session of its own."""

    def __init__(self, endpoint: str, base: str) -> None:
        self.base = base
        self.session = open_session(endpoint)
        self._heard: list[Heard] = []
        self._lock = threading.Lock()
        self._subscriber = self.session.declare_subscriber(f"{base}/*", self._hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        at_s = time.monotonic()
        topic = str(sample.key_expr).rpartition("/")[2]
        heard = Heard(at_s, topic, json.loads(sample.payload.to_bytes()))
        with self._lock:
            self._heard.append(heard)

    def all(self) -> list[Heard]:
        """Everything so far, in order of arrival."""
        with self._lock:
            return list(self._heard)

    def since(self, start_s: float, topic: str) -> list[Heard]:
        """What arrived on a topic after ``start_s``."""
        return [h for h in self.all() if h.at_s >= start_s and h.topic == topic]

    def wait(
        self,
        topic: str,
        wanted: Callable[[dict[str, Any]], bool],
        within_s: float,
        since_s: float,
    ) -> Heard:
        """The first message on ``topic`` after ``since_s`` that is ``wanted``."""

        def found() -> Heard | None:
            return next((h for h in self.since(since_s, topic) if wanted(h.body)), None)

        return until(found, within_s, lambda: f"the wanted {topic}; heard {self._tail(topic)}")

    def ask(self, key: str, payload: bytes | None = None) -> list[dict[str, Any]]:
        """Query a key; the answers."""
        replies = self.session.get(key, payload=payload, timeout=5.0)
        return [json.loads(r.ok.payload.to_bytes()) for r in replies if r.ok is not None]

    def refusal(self, key: str, payload: bytes) -> str:
        """Query a key that must refuse; its words."""
        replies = list(self.session.get(key, payload=payload, timeout=5.0))
        assert len(replies) == 1
        assert replies[0].err is not None, replies[0].ok
        return str(replies[0].err.payload.to_string())

    def tokens(self, key: str) -> list[str]:
        """Liveliness tokens that exist on a key expression."""
        replies = self.session.liveliness().get(key, timeout=5.0)
        return [str(r.ok.key_expr) for r in replies if r.ok is not None]

    def _tail(self, topic: str) -> str:
        return json.dumps([h.body for h in self.all() if h.topic == topic][-2:])[:2000]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
