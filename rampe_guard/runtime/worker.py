"""The daemon's one worker: drain, step, publish, answer, and a heartbeat at 5 Hz.

It wakes every few milliseconds. When something arrived (or nothing did for a while), it
takes everything that waits through `Guard.step`, which sweeps once, from the newest state;
so however fast inputs come, nothing queues up. The heartbeat comes from this loop and from
nowhere else: if the loop is stuck, the heartbeat stops. Every two seconds it tries the canary;
if that fails, the loop says so for a while, and ends.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from rampe_guard import wire
from rampe_guard.assembly import Machine
from rampe_guard.core.events import AdviceEvent, AlertEvent, Event, PredictionEvent
from rampe_guard.core.rampe import Rampe
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import Inputs
from rampe_guard.runtime.audit import Audit
from rampe_guard.runtime.canary_watch import CanaryWatch
from rampe_guard.runtime.decoding import decoders_of
from rampe_guard.runtime.expiry import Expiry
from rampe_guard.runtime.health import Own, Pulse, TimedSweeper
from rampe_guard.runtime.intake import Intake
from rampe_guard.runtime.life import restarted_after
from rampe_guard.runtime.messages import Scribe
from rampe_guard.runtime.metrics_start import Show
from rampe_guard.runtime.minders import Minders
from rampe_guard.runtime.orders import Orders
from rampe_guard.runtime.replay import IDLE_STEP_S
from rampe_guard.runtime.run_marker import RunMarker
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.scene_builder import Built
from rampe_guard.runtime.scene_desk import SceneDesk, Scenes
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.zenoh_io import Bus

if TYPE_CHECKING:
    from rampe_guard.runtime.ros2_publisher import RosVoice

_WAKE_S = 0.002
"""Sleep between looks at the inboxes: adds half of it to the latency, costs 3 % of a core."""
_ANSWER_S = 0.005
"""People who ask can wait so long: looking for them costs as much as looking for inputs."""
_BEAT_S = 0.2
SWITCH_S = 0.001
"""Longest the loop waits for a thread that saves, logs or serves metrics to let go of Python (its
default of 5 ms would be felt; see tests/benchmarks/saving.py)."""


def boot_id() -> str:
    """A new id for this run of a guard."""
    return f"{int(time.time()):x}-{os.urandom(3).hex()}"


class Worker:
    """Runs one guard on a Zenoh session until it is told to stop.

    Args:
        machine: site, geometry and sweeper, loaded.
        bus: an open session.
        say: log.
        keeper: remembers what earlier runs learned, and keeps what this one learns.
        canary: is asked again and again whether this machine computes what is so.
        scenes: the scene in force, and who keeps another one.
        minders: are told that the loop turns, and how the guard is.
        marker: knows how the run before ended, and keeps what nobody has seen.
        show: takes heartbeats for metrics.
        voice: tells tools of ROS 2.
    """

    def __init__(
        self,
        machine: Machine,
        bus: Bus,
        say: Sayer,
        keeper: Keeper,
        canary: CanaryWatch,
        scenes: Scenes,
        minders: Minders,
        marker: RunMarker,
        *,
        show: Show | None = None,
        voice: RosVoice | None = None,
    ) -> None:
        site = machine.site
        base = site.keys.base
        self._bus, self._say, self._minders = bus, say, minders
        boot = boot_id()
        start_s = time.monotonic()
        self._scribe = Scribe(site, boot, _unix_s, start_s)
        self._pulse = Pulse(site, boot, start_s, _unix_s, site.scene.content_hash)
        timed = TimedSweeper(machine.sweeper, self._pulse.sweep_ms)
        self._guard = machine.guard(start_s, boot, timed, advise=True)
        self._keeper, self._canary, self._marker, self._show = keeper, canary, marker, show
        self._voice = voice
        self._restarted = _cause(marker.after(restarted_after()), scenes.keeper.lost)
        keeper.begin(self._guard.rampe, start_s, self._guard.situations)
        self._intake = Intake(bus, site, say, decoders_of(site, machine.arm.limits))
        self._alerts = bus.outbox(f"{base}/alert", "rampe.alert.v1", urgent=True)
        self._predictions = bus.outbox(f"{base}/prediction", "rampe.prediction.v1")
        self._advice = (
            bus.outbox(f"{base}/advice", "rampe.advice.v1", urgent=True)
            if site.guard.advice.enabled
            else None
        )
        self._beats = bus.outbox(f"{base}/heartbeat", "rampe.heartbeat.v1", urgent=True)
        self._states = bus.desk(f"{base}/state")
        audit = self._audit = Audit(say)
        self._orders = Orders(bus, site, self._guard, audit, self._order_done, keeper.hurry)
        self._scene = SceneDesk(bus, site, scenes, machine.sweeper, audit, self._change_scene)
        self._expiry = Expiry(site.zenoh)
        bus.declare_alive(f"{base}/alive")
        self._prediction: wire.Prediction | None = None
        self._status: str | None = None
        self._connected = True
        self._heartbeat: wire.Heartbeat | None = None

    def run(self, stopped: Callable[[], bool], wait: Callable[[float], object]) -> bool:
        """Work until ``stopped``; ``wait`` sleeps but returns early when stopping.

        Returns:
            Whether it ended by itself, because the canary failed.
        """
        sys.setswitchinterval(SWITCH_S)
        gc.collect()
        gc.freeze()  # meshes and models are for life: do not walk them at every collection
        last_step_s = last_beat_s = last_answer_s = float("-inf")
        while not stopped() and not self._canary.told(now_s := time.monotonic()):
            self._pulse.turn(now_s)
            self._minders.turn(now_s)
            inputs = self._with_trial(self._intake.collect(now_s), now_s)
            if arrived(inputs) or now_s - last_step_s >= IDLE_STEP_S:
                last_step_s = now_s
                self._step(inputs, now_s)
            if now_s - last_beat_s >= _BEAT_S:
                last_beat_s = now_s
                self._beat(now_s)
            if now_s - last_answer_s >= _ANSWER_S:
                last_answer_s = now_s
                self._answer(now_s)
                self._keeper.keep(now_s)
            wait(_WAKE_S)
        return not stopped()

    def _with_trial(self, inputs: Inputs, now_s: float) -> Inputs:
        """The inputs with what this machine has to say of itself, if anything."""
        fault, restarted = self._canary.look(now_s), self._restarted
        if fault is None and restarted is None:
            return inputs
        self._restarted = None
        return replace(inputs, canary=fault, restarted=restarted)

    def _step(self, inputs: Inputs, now_s: float) -> None:
        began = time.perf_counter()
        events = self._guard.step(inputs, now_s)
        compute_ms = (time.perf_counter() - began) * 1e3
        for event in events:
            self._publish(event, compute_ms)
        if inputs.actuators:
            self._pulse.step(now_s, (time.perf_counter() - began) * 1e3)

    def _publish(self, event: Event, compute_ms: float | None) -> None:
        if isinstance(event, AlertEvent):
            self._publish_alert(event, compute_ms)
        elif isinstance(event, PredictionEvent):
            self._prediction = self._scribe.prediction(event)
            self._predictions.put(wire.encode(self._prediction))
        elif isinstance(event, AdviceEvent):
            if self._advice is not None:
                self._advice.put(wire.encode(self._scribe.advice(event)))
        else:
            kind = f"{event.input}:{event.reason}"
            self._say.warn(kind, f"{event.input}: refused: {event.reason}: {event.detail}")

    def _publish_alert(self, event: AlertEvent, compute_ms: float | None) -> bytes:
        message = self._scribe.alert(event, compute_ms)
        payload = wire.encode(message)
        self._alerts.put(payload)
        self._marker.note(message)  # repeats too: a contact that begins may be no transition
        if event.kind == "transition":
            own = message.source == "system"  # a log has room for what a display has not
            text = wire.in_full(message.text, event.evidence.note) if own else message.text
            self._say.info(
                f"{message.level}: {text}",
                alert_id=message.alert_id,
                level=message.level,
                zone=message.zone,
                link=message.link,
                time_to_collision_s=message.time_to_collision_s,
            )
        return payload

    def _beat(self, now_s: float) -> None:
        connected = self._bus.connected
        extra = [*self._keeper.reasons(), *self._scene.reasons(), *self._marker.reasons()]
        extra += self._expiry.reasons(_unix_s(now_s))
        if not connected:
            extra.append(wire.Reason(code="no_router", text="no Zenoh router", key=None))
        snapshot = self._guard.snapshot(now_s)
        self._heartbeat = self._pulse.beat(
            snapshot.health,
            now_s,
            self._intake.overruns,
            self._guard.lessons,
            extra,
            self._canary.trial(now_s),
            _remembered(self._guard.situations),
            Own(
                Counter(alert.level.word for alert in snapshot.alerts),
                _learned(self._guard.rampe),
                self._keeper.failures,
                connected,
                self._audit.counts,
            ),
        )
        self._beats.put(wire.encode(self._heartbeat))
        if self._show is not None:
            self._show(self._heartbeat, self._pulse, now_s)
        if self._voice is not None:
            state = self._scribe.state(self._heartbeat, snapshot, self._prediction)
            self._voice.tell(state, self._intake.lost_on_the_way)
        if connected is not self._connected:
            self._connected = connected
            self._say.info("Zenoh router is back" if connected else "Zenoh router is gone")
        if self._heartbeat.status != self._status:
            self._status = self._heartbeat.status
            why = "; ".join(r.text for r in self._heartbeat.reasons)
            codes = ",".join(r.code for r in self._heartbeat.reasons)
            text = f"status {self._status}{': ' + why if why else ''}"
            self._say.info(text, status=self._status, reasons=codes)
            self._minders.status(text)

    def _answer(self, now_s: float) -> None:
        state: bytes | None = None  # made once, however many ask
        for request in self._states.drain():
            if self._heartbeat is None:
                request.refuse("not ready yet")
                continue
            if state is None:
                snapshot = self._guard.snapshot(now_s)
                told = self._scribe.state(self._heartbeat, snapshot, self._prediction)
                state = wire.encode(told)
            request.reply(state)
        self._orders.answer(now_s)
        self._scene.answer(now_s)
        self._audit.turn(now_s)

    def _order_done(self, event: AlertEvent) -> bytes:
        return self._publish_alert(event, None)

    def _change_scene(self, built: Built) -> None:
        """Sweep against another scene from the next step on."""
        scene = built.source.scene
        timed = TimedSweeper(built.sweeper, self._pulse.sweep_ms)
        self._guard.change_scene(timed, built.sweeper.zones, scene.moving)
        self._intake.change_objects(scene.moving)
        if self._voice is not None:
            self._voice.change_scene(scene)
        self._pulse.scene_hash = scene.content_hash
        self._step(Inputs(), time.monotonic())


def arrived(inputs: Inputs) -> bool:
    """Anything at all came, good or refused, from outside or of this machine itself."""
    lists = (inputs.joystick, inputs.actuators, inputs.rejected)
    news = (inputs.canary, inputs.restarted)
    return any((*lists, inputs.objects, inputs.objects_rejected, inputs.enabled, *news))


def _cause(restarted: str | None, lost: str | None) -> str | None:
    """What a guard that begins has to tell until somebody has seen it."""
    if lost is None:
        return restarted
    return f"{restarted or 'a stop'}; {lost}"


def _learned(rampe: Rampe) -> wire.Learned:
    counts = rampe.categories
    return wire.Learned(categories=len(counts), occurrences=int(sum(counts.values())))


def _remembered(memory: SituationMemory) -> wire.Remembered:
    return wire.Remembered(situations=memory.count, work_s=memory.hours * 3600.0)


def _unix_s(now_s: float) -> float:
    """Unix time of a monotonic time, by the wall clock as it is set now."""
    return time.time() - time.monotonic() + now_s
