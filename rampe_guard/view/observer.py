"""Follows one machine over Zenoh: inboxes drained into a `ViewState` and handed on."""

from __future__ import annotations

import time
from typing import TypeAlias

import msgspec

from rampe_guard import wire
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.decoding import decoders_of
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site
from rampe_guard.view import follow
from rampe_guard.view.state import ViewState

Heard: TypeAlias = (
    wire.Alert | wire.Prediction | wire.Heartbeat | wire.JoystickMessage | wire.ActuatorsMessage
)
_CAPACITY = 2048
"""Viewers drain at the rate of the screen: more may wait than in the guard."""


class Observer:
    """What anyone on the network can know of a machine.

    Args:
        bus: an open session.
        site: whose machine.
        limits: actuator limits (n, 2) [unit].

    Attributes:
        state: the screen as of the last `poll`.
    """

    def __init__(self, bus: Bus, site: Site, limits: FloatArray) -> None:
        keys, base = site.keys, site.keys.base
        self._decoders = decoders_of(site, limits)
        self._joystick = bus.inbox(keys.joystick, _CAPACITY)
        self._actuators = bus.inbox(keys.actuators, _CAPACITY)
        self._alerts = bus.inbox(f"{base}/alert", _CAPACITY)
        self._predictions = bus.inbox(f"{base}/prediction", _CAPACITY)
        self._beats = bus.inbox(f"{base}/heartbeat", _CAPACITY)
        pairs = [(float(low), float(high)) for low, high in limits]
        self.state: ViewState = follow.begin(
            site.machine, site.name, site.guard.actuators, pairs, time.monotonic()
        )
        self._catch_up(bus, f"{base}/state")

    def poll(self) -> list[Heard]:
        """Take all that arrived into `state`; returns it too, oldest first per key."""
        now_s = time.monotonic()
        heard: list[Heard] = []
        heard += self._joystick.read(self._decoders.joystick)
        heard += self._actuators.read(self._decoders.actuators)
        heard += self._beats.read(lambda p: wire.decode(p, wire.Heartbeat))
        heard += self._predictions.read(lambda p: wire.decode(p, wire.Prediction))
        heard += self._alerts.read(lambda p: wire.decode(p, wire.Alert))
        state = follow.at(self.state, now_s)
        for message in heard:
            state = _show(state, message, now_s)
        self.state = state
        return heard

    def _catch_up(self, bus: Bus, key: str) -> None:
        try:
            answers = bus.ask(key, timeout_s=0.5)
        except ConnectionFailedError:
            return  # the guard is starting: its first heartbeat will come
        for answer in answers:
            state = wire.decode(answer, wire.State)
            self.state = follow.on_state(self.state, state, time.monotonic())


def _show(state: ViewState, message: msgspec.Struct, now_s: float) -> ViewState:
    if isinstance(message, wire.JoystickMessage):
        return follow.on_joystick(state, message, now_s)
    if isinstance(message, wire.ActuatorsMessage):
        return follow.on_actuators(state, message, now_s)
    if isinstance(message, wire.Heartbeat):
        return follow.on_heartbeat(state, message, now_s)
    if isinstance(message, wire.Prediction):
        return follow.on_prediction(state, message, now_s)
    if isinstance(message, wire.Alert):
        return follow.on_alert(state, message, now_s)
    raise TypeError(f"{type(message).__name__} is not shown")
