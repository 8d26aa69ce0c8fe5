"""Diagnostics and markers for tools of ROS 2, in a thread of its own.

The worker hands over its newest state and goes on; what is not sent in time is replaced by what is
newer. If the worker hands over nothing for a second, or ends, that is said: nobody is left who
monitors, and no tool of ROS 2 shall show that as clear.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final, Self

from rampe_guard import wire
from rampe_guard.assembly import Machine
from rampe_guard.core.scene import Scene
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.attachment import Attachment
from rampe_guard.ros2.diagnostics import diagnostics
from rampe_guard.ros2.graph import Voice, gid_of
from rampe_guard.ros2.markers import Painter
from rampe_guard.ros2.shapes import Ghost, Solid, zones
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings.ros2_keys import Ros2Settings, RosType

_LOOK_S: Final = 0.2
"""Five marker arrays a second, at most."""
_DIAGNOSTICS_S: Final = 1.0
_ZONES_S: Final = 0.5
_SILENT_S: Final = 1.0
_END_S: Final = 2.0


class Publisher:
    """One topic: numbers its messages, and is seen in the ROS graph.

    Args:
        bus: an open session.
        ros: node and domain.
        number: of the publisher, in its node.
        topic: its name.
        kind: of its messages.
        key: instead of that which follows from the topic.
    """

    def __init__(
        self,
        bus: Bus,
        ros: Ros2Settings,
        number: int,
        topic: str,
        kind: RosType,
        key: str | None = None,
    ) -> None:
        self._outbox, self._kind = bus.cdr_outbox(key or ros.key(topic, kind)), kind
        self._gid: bytes | None = None
        self._sequence = 0
        if ros.transport == "rmw_zenoh":
            token = Voice(ros, bus.zid).publisher(number, topic, kind)
            bus.declare_alive(token)
            self._gid = gid_of(token)

    def put(self, message: Any) -> None:
        """Send a message of the library's."""
        self.put_bytes(cdr.encode(message, self._kind))

    def put_bytes(self, payload: bytes) -> None:
        """Send one that is encoded already."""
        self._sequence += 1
        attached = None
        if self._gid is not None:  # subscribers of rmw_zenoh need it, those of the bridge do not
            attached = Attachment(self._sequence, time.time_ns(), self._gid).packed()
        self._outbox.put(payload, attached)


class RosVoice:
    """The guard's node. A context manager: leaving it says that the guard has ended.

    Args:
        bus: an open session.
        machine: whose arm and zones are drawn.
        ros: names and domain.
        say: log.
    """

    def __init__(self, bus: Bus, machine: Machine, ros: Ros2Settings, say: Sayer) -> None:
        site = machine.site
        self._machine, self._node, self._say = site.machine, ros.node, say
        if ros.transport == "rmw_zenoh":
            bus.declare_alive(Voice(ros, bus.zid).node)
        self._diagnostics, self._markers = (
            Publisher(bus, ros, number, topic, kind)
            for number, (topic, kind) in enumerate(ros.published)
        )
        self._painter = Painter(Ghost(machine.arm), site.actuator_names, ros.frame)
        self._scene: Scene | None = site.scene
        self._solids: Mapping[str, tuple[Solid, ...]] = MappingProxyType({})
        self._newest: tuple[float, wire.State, Mapping[str, int]] | None = None
        self._began_s = time.monotonic()
        self._over = threading.Event()
        self._due_s = {"diagnostics": 0.0, "zones": 0.0}
        self._shown: tuple[object, ...] = ()
        self._thread = threading.Thread(target=self._work, name="ros2", daemon=True)

    def tell(self, state: wire.State, lost: Mapping[str, int]) -> None:
        """Take the newest state, and messages lost on their way by input; never waits."""
        self._newest = time.monotonic(), state, lost

    def change_scene(self, scene: Scene) -> None:
        """Draw other zones from now on."""
        self._scene = scene

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(_END_S)

    def _work(self) -> None:
        while not self._over.wait(_LOOK_S):
            self._guarded(self._turn)
        self._newest = None
        self._guarded(lambda: self._send_all(None, {}, time.time(), "the guard has ended"))

    def _guarded(self, turn: Callable[[], None]) -> None:
        try:
            turn()
        except Exception as error:  # noqa: BLE001 - a picture is never worth the guard
            self._say.warn("ros2", f"ros2: not published: {type(error).__name__}: {error}")

    def _turn(self) -> None:
        now_s = time.monotonic()
        if self._scene is not None:
            scene, self._scene = self._scene, None
            self._solids = zones(scene.objects, 5.0 * self._painter.ghost.size_m)
            self._due_s["zones"] = 0.0
        if self._newest is None:
            if now_s - self._began_s >= _SILENT_S and now_s >= self._due_s["diagnostics"]:
                self._due_s["diagnostics"] = now_s + _DIAGNOSTICS_S
                self._send_all(None, {}, time.time(), "the guard has not begun yet")
            return
        at_s, state, lost = self._newest
        if now_s - at_s > _SILENT_S:
            why = f"the guard's loop stands still for {now_s - at_s:.0f} s"
            self._send_due(now_s, None, lost, why)
        else:
            self._send_due(now_s, state, lost, "")

    def _send_due(
        self, now_s: float, state: wire.State | None, lost: Mapping[str, int], why: str
    ) -> None:
        """What is due, or has changed."""
        shown = _gist(state)
        changed, self._shown = shown != self._shown, shown
        stamp_s = time.time()
        if changed or now_s >= self._due_s["diagnostics"]:
            self._due_s["diagnostics"] = now_s + _DIAGNOSTICS_S
            self._send_diagnostics(state, lost, stamp_s, why)
        if changed or now_s >= self._due_s["zones"]:
            self._due_s["zones"] = now_s + _ZONES_S
            self._markers.put(self._painter.zones(state, self._solids, stamp_s))
        elif state is not None and (way := self._painter.way(state, stamp_s)) is not None:
            self._markers.put(way)

    def _send_all(
        self, state: wire.State | None, lost: Mapping[str, int], stamp_s: float, why: str
    ) -> None:
        self._send_diagnostics(state, lost, stamp_s, why)
        self._markers.put(self._painter.zones(state, self._solids, stamp_s))

    def _send_diagnostics(
        self, state: wire.State | None, lost: Mapping[str, int], stamp_s: float, why: str
    ) -> None:
        array = diagnostics(state, self._node, self._machine, stamp_s, lost, why)
        self._diagnostics.put(array)


@contextlib.contextmanager
def ros_voice(bus: Bus, machine: Machine, say: Sayer) -> Iterator[RosVoice | None]:
    """The guard's voice in ROS 2, if its site wishes one."""
    ros = machine.site.ros2
    if ros is None or not ros.publish:
        yield None
        return
    for _, kind in ros.published:  # its code is made before the guard is at work
        cdr.store().get_msgdef(kind.name)
    with RosVoice(bus, machine, ros, say) as voice:
        topics = " and ".join(topic for topic, _ in ros.published)
        say.info(f"ROS 2: node {ros.node} on {topics}")
        yield voice


def _gist(state: wire.State | None) -> tuple[object, ...]:
    """What is told at once when it changes."""
    if state is None:
        return ()
    return state.heartbeat.status, *sorted((a.zone or "", a.level) for a in state.alerts)
