"""A scripted machine: publishes levers and positions of a simple arm in real time."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import zenoh

from rampe_guard.settings import Site
from tests.support.ears import open_session


@dataclass(frozen=True, slots=True)
class Sent:
    """One position as it was put: monotonic time before the put [s], stamp [s], position (n,)."""

    at_s: float
    stamp_s: float
    position: tuple[float, ...]


class Rig:
    """Moves as the levers say, at once and exactly: position += axis · max_velocity · dt.

    Attributes:
        levers: axes now pushed; the thread sends them at the next tick.
        stalled: the levers are sent but nothing moves (an arm against a stop).
        joystick_on, actuators_on: whether that stream is sent.
    """

    def __init__(
        self, endpoint: str, site: Site, start: Sequence[float], *, rate_hz: float = 50.0
    ) -> None:
        self._session = open_session(endpoint)
        self._keys = site.keys
        self._speed = np.array([a.max_velocity for a in site.guard.actuators])
        self._period_s = 1.0 / rate_hz
        self._lock = threading.RLock()
        self._position = np.array(start, dtype=float)
        self.levers: tuple[float, ...] = (0.0,) * len(start)
        self.stalled = False
        self.joystick_on = self.actuators_on = True
        self.sent: list[Sent] = []
        self.lever_sent_s = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._work, name="rig")

    @property
    def position(self) -> tuple[float, ...]:
        return tuple(self._position.tolist())

    def jump(self, position: Sequence[float]) -> None:
        """Set the position anew; the guard sees a jump unless the stream was silent."""
        with self._lock:
            self._position = np.array(position, dtype=float)

    def lever(self, message: Any, key: str | None = None) -> None:
        """Put anything on the joystick key (or another): bytes as they are, else as JSON.

        Unlike the stream it is never dropped: what a test sends must arrive.
        """
        self._put(key or self._keys.joystick, message, zenoh.CongestionControl.BLOCK)

    def actuators(self, message: Any, key: str | None = None) -> None:
        """The same for the actuators."""
        self._put(key or self._keys.actuators, message, zenoh.CongestionControl.BLOCK)

    def _put(self, key: str, message: Any, congestion: zenoh.CongestionControl) -> None:
        payload = message if isinstance(message, bytes) else json.dumps(message).encode()
        self._session.put(key, payload, congestion_control=congestion)

    def _work(self) -> None:
        last_s = time.monotonic()
        while not self._over.wait(self._period_s):
            with self._lock:
                now_s = time.monotonic()
                self._tick(now_s - last_s)
                last_s = now_s

    def _tick(self, dt: float) -> None:
        levers = self.levers
        if not self.stalled:
            self._position = self._position + np.array(levers) * self._speed * dt
        stamp_s = time.time()
        if self.joystick_on:
            self.lever_sent_s = time.monotonic()
            message: dict[str, Any] = {"stamp": stamp_s, "axes": levers}
            self._put(self._keys.joystick, message, zenoh.CongestionControl.DROP)
        if self.actuators_on:
            self.sent.append(Sent(time.monotonic(), stamp_s, self.position))
            message = {"stamp": stamp_s, "position": self.position}
            self._put(self._keys.actuators, message, zenoh.CongestionControl.DROP)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._session.close()
