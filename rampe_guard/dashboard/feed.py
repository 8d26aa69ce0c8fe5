"""One machine over Zenoh: what was heard becomes a `Sight`.

A thread of its own opens the session (for as long as it takes) and asks the guard for its
`state` when something may have been missed. Everything else happens in `poll`: nothing is
computed in a Zenoh callback, and what nobody polls is dropped by the rings of the inboxes,
so a dashboard that stands still harms nobody.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from rampe_guard import wire
from rampe_guard.client import fleet as fleets
from rampe_guard.client.fleet import Fleet, Told
from rampe_guard.client.items import Item
from rampe_guard.client.order import Order, give
from rampe_guard.core.scene import Scene
from rampe_guard.core.types import ActuatorSample
from rampe_guard.core.velocity import VelocityEstimator
from rampe_guard.dashboard.happenings import Leads, with_items
from rampe_guard.dashboard.scene_follow import SceneFollower
from rampe_guard.dashboard.sight import Sight
from rampe_guard.errors import ConnectionFailedError, MessageError
from rampe_guard.runtime.batch import pose_of
from rampe_guard.runtime.decoding import decoders_of, limits_said
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, Inbox, Liveness
from rampe_guard.settings import Site

_CAPACITY = 1024
"""Of an inbox: several seconds of a fast machine."""
_ASK_S = 0.25
"""Period at which the guard is asked for its state while something may be missing [s]."""
_ANSWER_S = 1.0
_KEPT_ANSWERS = 8


@dataclass(frozen=True, slots=True)
class _Line:
    """An open session with its inboxes."""

    bus: Bus
    joystick: Inbox
    actuators: Inbox
    alerts: Inbox
    predictions: Inbox
    beats: Inbox
    token: Liveness
    objects: tuple[tuple[str, Inbox], ...]


class Feed:
    """Follows one machine.

    Args:
        site: whose machine; its Zenoh settings say where.
        stop: ends the thread.

    Attributes:
        sight: what is known, as of the last `poll`.
        undrawable: why the newest scene cannot be drawn; empty if it can.
    """

    def __init__(self, site: Site, stop: StopFlag) -> None:
        self._site = site
        self._decoders = decoders_of(site, limits_said(site))
        self._base = site.keys.base
        self._stop = stop
        now_s = time.monotonic()
        self._fleet, _ = fleets.expect(Fleet(), self._base, now_s)
        self.sight = Sight(
            self._fleet.machines[self._base], now_s, trouble="connecting to the Zenoh router"
        )
        self._speed = VelocityEstimator(np.array([a.max_velocity for a in site.guard.actuators]))
        self._leads = Leads()
        self._token: bool | None = None
        self._line: _Line | None = None
        self._trouble = self.sight.trouble
        self._answers: deque[tuple[float, wire.State]] = deque(maxlen=_KEPT_ANSWERS)
        self._scene = SceneFollower(site)
        self.undrawable = ""
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._work, name=f"feed {self._base}", daemon=True)

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def poll(self, now_s: float) -> Sight:
        """Take all that arrived; returns the new `sight`.

        Raises what ended our thread, if anything did: a page that goes on without it would show
        what is long past.
        """
        if self._failure is not None:
            raise self._failure
        items: list[Item] = []
        other_scene = self._scene.trouble or self.undrawable
        sight = replace(self.sight, now_s=now_s, trouble=self._trouble, other_scene=other_scene)
        line = self._line
        if line is not None:
            sight = self._take_inputs(line, sight)
            items += self._take_guard(line, now_s)
            sight = self._take_predictions(line, sight)
        items += self._tell(fleets.at(self._fleet, now_s))
        guard = self._fleet.machines[self._base]
        prediction = sight.prediction
        if prediction is not None and prediction.boot_id != guard.boot_id:
            prediction = None  # of a guard that is no more
        events = with_items(sight.events, tuple(items), now_s)
        self.sight = replace(
            sight, guard=guard, prediction=prediction, events=events, leads=self._leads.lines
        )
        return self.sight

    @property
    def scene(self) -> Scene:
        """The newest that is known of the guard's."""
        return self._scene.scene

    def acknowledge(self, alert_id: str, who: str) -> None:
        """Tell the guard that someone has seen an alert.

        Raises:
            ConnectionFailedError: nobody answers, or the guard refuses.
        """
        self._order(wire.Ack(alert_id=alert_id, who=who))

    def shelve(self, alert_id: str, who: str, duration_s: float) -> None:
        """Put an alert aside for a time [s]; 0 ends that.

        Raises:
            ConnectionFailedError: nobody answers, or the guard refuses.
        """
        self._order(wire.Shelve(alert_id=alert_id, who=who, duration_s=duration_s))

    def close(self) -> None:
        """End the thread (``stop`` is set by now) and the session."""
        self._thread.join()
        if self._line is not None:
            self._line.bus.close()

    def _order(self, order: Order) -> None:
        if self._line is None:
            raise ConnectionFailedError(self._trouble)
        give(self._line.bus, self._base, order)

    # the thread

    def _work(self) -> None:
        try:
            self._follow()
        except BaseException as error:  # noqa: BLE001 - whoever polls gets it, whatever it is
            self._failure = error

    def _follow(self) -> None:
        bus = Bus.open_retrying(self._site.zenoh, self._stop, self._cannot, self._stop.wait)
        if bus is None:
            return
        self._trouble = ""
        self._line = self._subscribe(bus)
        while not self._stop.wait(_ASK_S):
            self._trouble = "" if bus.connected else "no Zenoh router"
            guard = self._fleet.machines[self._base]
            if guard.behind:
                self._catch_up(bus)
            beat = guard.heartbeat
            if beat is not None and self._scene.follow(bus, beat.scene_hash):
                self.undrawable = ""
                self._line = replace(self._line, objects=self._objects(bus))

    def _cannot(self, why: str) -> None:
        self._trouble = why

    def _subscribe(self, bus: Bus) -> _Line:
        keys, base = self._site.keys, self._base
        return _Line(
            bus=bus,
            joystick=bus.inbox(keys.joystick, _CAPACITY),
            actuators=bus.inbox(keys.actuators, _CAPACITY),
            alerts=bus.inbox(f"{base}/alert", _CAPACITY),
            predictions=bus.inbox(f"{base}/prediction", _CAPACITY),
            beats=bus.inbox(f"{base}/heartbeat", _CAPACITY),
            token=bus.liveness(f"{base}/alive"),
            objects=self._objects(bus),
        )

    def _objects(self, bus: Bus) -> tuple[tuple[str, Inbox], ...]:
        """The poses of all that moves; those that are heard already stay as they are."""
        heard = {} if self._line is None else dict(self._line.objects)
        wanted = {item.name: item.key or "" for item in self._scene.scene.moving}
        for name in heard.keys() - wanted.keys():
            heard[name].close()
        return tuple(
            (name, heard[name] if name in heard else bus.inbox(key, _CAPACITY))
            for name, key in wanted.items()
        )

    def _catch_up(self, bus: Bus) -> None:
        asked_s = time.monotonic()
        try:
            answers = bus.ask(f"{self._base}/state", timeout_s=_ANSWER_S)
            for answer in answers:
                self._answers.append((asked_s, wire.decode(answer, wire.State)))
        except (ConnectionFailedError, MessageError):
            return  # asked again soon, for as long as something is missing

    # what `poll` does

    def _take_guard(self, line: _Line, now_s: float) -> list[Item]:
        items: list[Item] = []
        while self._answers:
            asked_s, state = self._answers.popleft()
            items += self._tell(fleets.on_state(self._fleet, self._base, state, now_s, asked_s))
        for beat in line.beats.read(lambda p: wire.decode(p, wire.Heartbeat)):
            items += self._tell(fleets.on_heartbeat(self._fleet, self._base, beat, now_s))
        for message in line.alerts.drain():
            items += self._tell(self._alert(message.payload, now_s))
        alive = line.token.poll()
        if alive is not None and alive is not self._token:
            if self._token is not None or alive:  # one that never was there says nothing
                told = fleets.on_token(self._fleet, self._base, now_s, alive=alive)
                items += self._tell(told)
            self._token = alive
        return items

    def _alert(self, payload: bytes, now_s: float) -> Told:
        try:
            alert = wire.decode(payload, wire.Alert)
        except MessageError:  # something is raised, nobody knows what: that is no protection
            return fleets.on_unreadable(self._fleet, self._base, now_s)
        self._leads = self._leads.take(alert)
        return fleets.on_alert(self._fleet, self._base, alert, now_s)

    def _tell(self, told: Told) -> tuple[Item, ...]:
        self._fleet, items = told
        return items

    def _take_predictions(self, line: _Line, sight: Sight) -> Sight:
        for message in line.predictions.read(lambda p: wire.decode(p, wire.Prediction)):
            under_way = message.event != "ended" and message.mean is not None
            sight = replace(sight, prediction=message if under_way else None)
        return sight

    def _take_inputs(self, line: _Line, sight: Sight) -> Sight:
        site, now_s = self._site, sight.now_s
        levers = line.joystick.read(self._decoders.joystick)
        if levers:
            command = [a.sign * levers[-1].axes[a.axis] for a in site.guard.actuators]
            sight = replace(sight, command=np.array(command), command_s=now_s)
        for moved in line.actuators.read(self._decoders.actuators):
            position = np.array(moved.position)
            measured = None if moved.velocity is None else np.array(moved.velocity)
            stamp_s = now_s if moved.stamp is None else moved.stamp
            self._speed.update(ActuatorSample(stamp_s, position, measured, now_s))
            sight = replace(sight, position=position, position_s=now_s)
        placed, placed_s = dict(sight.placed), dict(sight.placed_s)
        for name, inbox in line.objects:
            poses = inbox.read(wire.decode_object_pose)
            if poses:
                placed[name], placed_s[name] = pose_of(poses[-1]), now_s
        velocity = self._speed.velocity
        return replace(sight, velocity=velocity, placed=placed, placed_s=placed_s)
