"""Puts inputs on a machine's keys as the machine itself would: simulated or from a log."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

from rampe_guard import wire
from rampe_guard.core.types import FloatArray
from rampe_guard.runtime.ros2_player import RosInputs
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, Outbox
from rampe_guard.settings import Site

T = TypeVar("T")

_PATIENCE_S = 10.0
_LOOK_S = 0.1


@dataclass(frozen=True, slots=True)
class Frame:
    """Both inputs of one moment; ``at_s`` is when to send them, from the start of play [s]."""

    at_s: float
    stamp_s: float | None
    axes: FloatArray
    position: FloatArray
    velocity: FloatArray | None


class Player:
    """Publishes frames in real time, the joystick before the actuators that it moved."""

    def __init__(self, bus: Bus, site: Site) -> None:
        self._bus, self._alive_key = bus, f"{site.keys.base}/alive"
        self._joystick = bus.outbox(site.keys.joystick)
        self._actuators = bus.outbox(site.keys.actuators)
        self._ros = None if site.ros2 is None else RosInputs(bus, site, site.ros2)

    def wait_for_listener(self, stop: StopFlag) -> bool:
        """Wait until somebody subscribes, at most ten seconds; whether somebody did."""
        until = time.monotonic() + _PATIENCE_S
        while time.monotonic() < until and not stop.wait(0.02):
            if self._joystick.heard and self._actuators.heard:
                return True
        return False

    def wait_for_guard(self, stop: StopFlag) -> bool:
        """Wait until the guard of the site says that it is there, however long it takes to load.

        Others may listen long before: a screen, or a recorder.

        Returns:
            Whether it did; false if told to stop.
        """
        while not self._bus.is_alive(self._alive_key):
            if stop.wait(_LOOK_S):
                return False
        return True

    def play(self, frames: Iterable[Frame], stop: StopFlag, speed: float = 1.0) -> int:
        """Send every frame at its time, ``speed`` times as fast; returns how many were sent."""
        return self._paced(((frame.at_s, frame) for frame in frames), self._send, stop, speed)

    def post(
        self, posts: Iterable[tuple[float, str, bytes]], stop: StopFlag, speed: float = 1.0
    ) -> int:
        """Send messages as they are, (time [s], key, payload), the first at once.

        They may come ``speed`` times as fast; returns how many were sent.
        """
        outboxes: dict[str, Outbox] = {}
        coming = iter(posts)
        first = next(coming, None)
        if first is None:
            return 0

        def put(message: tuple[str, bytes]) -> None:
            key, payload = message
            if self._ros is not None and self._ros.put(key, payload):
                return
            if key not in outboxes:
                outboxes[key] = self._bus.outbox(key)
            outboxes[key].put(payload)

        timed = ((at_s - first[0], (key, said)) for at_s, key, said in chain([first], coming))
        return self._paced(timed, put, stop, speed)

    def _paced(
        self,
        items: Iterable[tuple[float, T]],
        send: Callable[[T], None],
        stop: StopFlag,
        speed: float,
    ) -> int:
        """Send each at its time from now on [s]; how many were sent."""
        start_s = time.monotonic()
        sent = 0
        for at_s, item in items:
            wait_s = start_s + at_s / speed - time.monotonic()
            if stop.wait(wait_s) if wait_s > 0.0 else stop():
                break
            send(item)
            sent += 1
        return sent

    def _send(self, frame: Frame) -> None:
        stamp = time.time() if frame.stamp_s is None else frame.stamp_s
        axes = tuple(frame.axes.tolist())
        if self._ros is not None:
            self._ros.send(axes, frame.position.tolist(), stamp)
            return
        self._joystick.put(wire.encode(wire.JoystickMessage(axes=axes, stamp=stamp)))
        velocity = None if frame.velocity is None else tuple(frame.velocity.tolist())
        position = tuple(frame.position.tolist())
        message = wire.ActuatorsMessage(position=position, velocity=velocity, stamp=stamp)
        self._actuators.put(wire.encode(message))
