"""A process that speaks as a guard does, on words from stdin: also what no guard should say.

    python -m tests.support.speaker ENDPOINT BASE...

Lines are JSON. ``{"alert": {...}}`` raises or changes an alert (fields over those of
`messages.ALERT`; ``"state": "normal"`` ends it), ``{"beat": {...}}`` changes all heartbeats to
come, ``{"lose": n}`` skips n numbers of `seq`, ``{"silent": true}`` stops repeats and heartbeats,
``{"raw": "..."}`` puts anything on the alert key. A line may name its ``"base"``; without, the
first speaks. Active alerts are repeated and heartbeats sent at 5 Hz, and `state` and `ack` are
answered, all from one loop.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from typing import Any

from msgspec import structs

from rampe_guard import wire
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import ZenohSettings
from tests.support.messages import ALERT, HEARTBEAT, STATE

_PERIOD_S = 0.2


class Speaker:
    """One guard's voice."""

    def __init__(self, bus: Bus, base: str) -> None:
        self._alerts = bus.outbox(f"{base}/alert", "rampe.alert.v1", urgent=True)
        self._beats = bus.outbox(f"{base}/heartbeat", "rampe.heartbeat.v1", urgent=True)
        self._states, self._acks = bus.desk(f"{base}/state"), bus.desk(f"{base}/ack")
        bus.declare_alive(f"{base}/alive")
        self._machine = base.split("/")[-2]
        self._alert_seq = self._beat_seq = 0
        self._beat = structs.replace(HEARTBEAT, machine=self._machine)
        self._active: dict[str, wire.Alert] = {}
        self._silent = False
        self._due_s = 0.0

    def obey(self, word: dict[str, Any]) -> None:
        if "alert" in word:
            alert = structs.replace(ALERT, changed_unix_s=time.time(), **word["alert"])
            self._active[alert.alert_id] = alert
            self._say(alert)
            if alert.state == "normal":
                del self._active[alert.alert_id]
        if "beat" in word:
            change = wire.decode(json.dumps(word["beat"]).encode(), dict[str, Any])
            reasons = tuple(wire.Reason(**reason) for reason in change.pop("reasons", ()))
            self._beat = structs.replace(self._beat, reasons=reasons, **change)
            self._due_s = 0.0
        self._alert_seq += word.get("lose", 0)
        self._silent = word.get("silent", self._silent)
        if "forget" in word:
            self._active.clear()
        if "raw" in word:
            self._alerts.put(word["raw"].encode())

    def work(self, now_s: float) -> None:
        if now_s >= self._due_s and not self._silent:
            self._due_s = now_s + _PERIOD_S
            self._beat_seq += 1
            self._beats.put(wire.encode(self._heartbeat()))
            for alert in self._active.values():
                self._say(alert)
        for request in self._states.drain():
            alerts = tuple(self._now(alert) for alert in self._active.values())
            state = structs.replace(STATE, heartbeat=self._heartbeat(), alerts=alerts)
            request.reply(wire.encode(state))
        for request in self._acks.drain():
            ack = wire.decode(request.payload or b"", wire.Ack)
            if ack.alert_id not in self._active:
                request.refuse(f"no alert {ack.alert_id!r} waits for an acknowledgement")
                continue
            self.obey({"alert": {"alert_id": ack.alert_id, "state": "acked", "acked_by": ack.who}})
            request.reply(wire.encode(self._now(self._active[ack.alert_id])))

    def _say(self, alert: wire.Alert) -> None:
        self._alert_seq += 1
        self._alerts.put(wire.encode(self._now(alert)))

    def _now(self, alert: wire.Alert) -> wire.Alert:
        now_s = time.time()
        return structs.replace(
            alert, seq=self._alert_seq, machine=self._machine, published_unix_s=now_s
        )

    def _heartbeat(self) -> wire.Heartbeat:
        return structs.replace(self._beat, seq=self._beat_seq, published_unix_s=time.time())


def main(endpoint: str, bases: list[str]) -> None:
    """Speak until stdin ends."""
    words: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            words.put(line)
        words.put("")

    threading.Thread(target=read, daemon=True).start()
    with Bus.open(ZenohSettings(None, "client", (endpoint,))) as bus:
        speakers = {base: Speaker(bus, base) for base in bases}
        print("ready", flush=True)
        while True:
            while not words.empty():
                line = words.get()
                if not line:
                    return
                word = json.loads(line)
                speakers[word.get("base", bases[0])].obey(word)
            for speaker in speakers.values():
                speaker.work(time.monotonic())
            time.sleep(0.001)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
