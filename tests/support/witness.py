"""What a consumer of the alerts would show, at every moment: the judge of the fault tests.

It trusts exactly what the contract says may be trusted: an alert for as long as it expires after,
a guard for as long as its heartbeat is younger than a second and says that it monitors. Both count
from when they were sent, as the promptest message of the guard shows; and a guard that was lost
must be heard for half a second, or tell its state. It keeps no messages, so it can listen for days.
"""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass, field
from typing import Any, Self

import zenoh

from tests.support.ears import open_session

TRUST_S = 1.0
"""Age of a heartbeat at which nothing is to be trusted any more."""
KNOWN_S = 0.5
"""How long a guard that was lost is heard before every alert of it has been repeated."""
LOST = "lost"


@dataclass(slots=True)
class _Active:
    level: str
    until_s: float
    text: str
    state: str
    quality: str
    stamp_s: float


@dataclass(slots=True)
class Heartbeats:
    """Of all that were heard: how many, the longest time between two [s], how many are missing."""

    count: int = 0
    longest_s: float = 0.0
    missing: int = 0
    newest: dict[str, Any] = field(default_factory=dict)
    at_s: float = float("-inf")


class Witness:
    """Listens to one guard on a session of its own."""

    def __init__(self, endpoints: str | list[str], base: str) -> None:
        self._lock = threading.Lock()
        self._active: dict[str | None, _Active] = {}
        self._seq: dict[str, int] = {}
        self._boot = ""
        self._base = base
        self.behind = True
        self.beats = Heartbeats()
        self.missing_alerts = 0
        self.unreadable = 0
        self.restarts: list[str] = []
        self._raised: dict[str, float] = {}
        self._promptest_s = float("inf")
        self._known_s = 0.0
        self.session = open_session(endpoints)
        self._subscriber = self.session.declare_subscriber(f"{base}/*", self._hear)

    def shown(self, zone: str) -> str:
        """What stands on the screen of a zone now: a level, or `LOST`."""
        now_s = time.monotonic()
        with self._lock:
            beat = self.beats.newest
            if now_s - self.beats.at_s > TRUST_S or beat.get("status") not in ("ok", "degraded"):
                return LOST
            if any(now_s > active.until_s for active in self._active.values()):
                return LOST
            found = self._active.get(zone)
            if now_s < self._known_s:
                return LOST
            return "clear" if found is None else found.level

    def status(self, since_s: float) -> str | None:
        """Of the newest heartbeat, if it came after ``since_s``."""
        with self._lock:
            return str(self.beats.newest["status"]) if self.beats.at_s > since_s else None

    def newest(self, zone: str) -> str:
        """The alert of a zone and the heartbeat as they are, for people."""
        with self._lock:
            beat = self.beats.newest
            age_s = time.monotonic() - self.beats.at_s
            return (
                f"{self._active.get(zone)}, now {time.time():.3f}; {beat.get('status')}"
                f" {[r['code'] for r in beat.get('reasons', ())]} {age_s:.2f} s ago"
            )

    def raised_s(self, zone: str) -> float | None:
        """Since when a zone has been imminent without a break; None if it is not."""
        with self._lock:
            return self._raised.get(zone)

    def refresh(self) -> None:
        """Ask for the present if something was missed, as every consumer should."""
        if not self.behind:
            return
        self.behind = False
        try:
            answers = self.ask(f"{self._base}/state")
        except zenoh.ZError:
            answers = []
        if len(answers) != 1:
            self.behind = True
            return
        at_s, (state,) = time.monotonic(), answers
        with self._lock:
            if state["heartbeat"]["boot_id"] != self._boot:
                return
            self._known_s = at_s
            alive = {alert["zone"] for alert in state["alerts"]}
            for zone in self._active.keys() - alive:
                del self._active[zone]
            for alert in state["alerts"]:
                self._note(alert, at_s)

    def system_text(self) -> str:
        """Of the system alert that stands; empty if none."""
        with self._lock:
            found = self._active.get(None)
            return "" if found is None else found.text

    @property
    def boot_id(self) -> str:
        """Of the guard that speaks."""
        return self._boot

    def ask(self, key: str, payload: bytes | None = None) -> list[dict[str, Any]]:
        """Query a key; the answers."""
        replies = self.session.get(key, payload=payload, timeout=5.0)
        return [json.loads(r.ok.payload.to_bytes()) for r in replies if r.ok is not None]

    def _hear(self, sample: zenoh.Sample) -> None:
        at_s = time.monotonic()
        topic = str(sample.key_expr).rpartition("/")[2]
        if topic not in ("alert", "heartbeat"):
            return
        try:
            body = json.loads(sample.payload.to_bytes())
        except ValueError:
            self.unreadable += 1
            return
        with self._lock:
            if body["boot_id"] != self._boot:
                self._boot = body["boot_id"]
                self.restarts.append(self._boot)
                self._active.clear()
                self._seq.clear()
                self._raised.clear()
                self.behind = True
                self._promptest_s = float("inf")
            # how much later it came than the promptest: for so long at least it was on its way
            self._promptest_s = min(self._promptest_s, at_s - body["uptime_s"])
            at_s = body["uptime_s"] + self._promptest_s
            if topic == "heartbeat":
                self._beat(body, at_s)
            else:
                self._alert(body, at_s)

    def _beat(self, body: dict[str, Any], at_s: float) -> None:
        beats = self.beats
        now_s = time.monotonic()
        if now_s - beats.at_s > TRUST_S >= now_s - at_s:
            self._known_s, self.behind = now_s + KNOWN_S, True
        if beats.count:
            beats.longest_s = max(beats.longest_s, at_s - beats.at_s)
        beats.count += 1
        beats.missing += self._skipped("heartbeat", body["seq"])
        beats.newest, beats.at_s = body, at_s

    def _alert(self, body: dict[str, Any], at_s: float) -> None:
        missing = self._skipped("alert", body["seq"])
        self.missing_alerts += missing
        self.behind |= missing > 0
        self._note(body, at_s)

    def _note(self, body: dict[str, Any], at_s: float) -> None:
        zone, level = body["zone"], body["level"]
        if body["state"] == "normal":
            self._active.pop(zone, None)
        else:
            until_s = at_s + body["expires_after_s"]
            self._active[zone] = _Active(
                level,
                until_s,
                *(body["text"], body["state"], body["quality"]),
                body["stamp"] or 0.0,
            )
        if zone is not None and level != "imminent":
            self._raised.pop(zone, None)
        elif zone is not None:
            self._raised.setdefault(zone, at_s)

    def _skipped(self, topic: str, seq: int) -> int:
        before, self._seq[topic] = self._seq.get(topic), seq
        return 0 if before is None else max(seq - before - 1, 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
