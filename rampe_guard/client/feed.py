"""What guards publish, drained from Zenoh into a `Fleet`; polled by whoever owns it, no thread."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from rampe_guard import wire
from rampe_guard.client import fleet as core
from rampe_guard.client.fleet import Fleet, Told
from rampe_guard.client.items import Alert, Item
from rampe_guard.errors import MessageError
from rampe_guard.runtime.zenoh_io import Bus, check_key_expression, is_pattern
from rampe_guard.runtime.zenoh_queries import Inquiry

_CAPACITY = 4096
"""Messages that may wait on one subscription."""
_ANSWER_S = 1.0
"""How long a guard may take to tell its state; it takes milliseconds."""
_ASK_AGAIN_S = 0.5
_LOOK_S = 0.004
_PASS_S = 0.05
"""How often the passing of time is looked at, beside the messages."""


@dataclass(frozen=True, slots=True)
class _Asked:
    inquiry: Inquiry
    at_s: float


class Feed:
    """Alerts, heartbeats, tokens and states of all guards on some key expressions.

    Args:
        bus: an open session.
        bases: key expressions of prefixes of guards, such as ``rampe/*/*/guard``. Of one
            without wildcards it is known that a machine should be there.
        repeats: tell repeats of alerts too.
        answer_s: how long a guard may take to tell its state at first [s].
        expires_after_s: age at which a heartbeat must not be trusted [s].

    Attributes:
        fleet: all that is known, as of the last `poll`.
    """

    def __init__(
        self,
        bus: Bus,
        bases: Sequence[str],
        *,
        repeats: bool = False,
        answer_s: float = _ANSWER_S,
        expires_after_s: float = 1.0,
    ) -> None:
        for base in bases:
            check_key_expression(f"{base}/state")
        self._bus, self._bases, self._repeats = bus, bases, repeats
        self._beats = [bus.inbox(f"{base}/heartbeat", _CAPACITY) for base in bases]
        self._alerts = [bus.inbox(f"{base}/alert", _CAPACITY) for base in bases]
        self._tokens = [bus.tokens(f"{base}/alive") for base in bases]
        self._asked_s: dict[str, float] = {}
        self._passed_s = float("-inf")
        self.fleet = Fleet(expires_after_s=expires_after_s)
        self._answer_s = answer_s
        self._open = [self._ask(base, time.monotonic(), answer_s) for base in bases]

    def catch_up(self) -> list[Item]:
        """Wait until every guard that is there has told its state; the first items."""
        deadline_s = time.monotonic() + self._answer_s
        items: list[Item] = []
        while self._open and time.monotonic() < deadline_s:
            items += self._answers()
            time.sleep(_LOOK_S)
        items += self.poll()
        for base in self._bases:
            if not is_pattern(base):
                items += self._take(core.expect(self.fleet, base, time.monotonic()))
        return items

    def poll(self) -> list[Item]:
        """Take all that arrived into `fleet`; what there is to tell, in order."""
        items = self._answers()
        now_s = time.monotonic()
        for inbox in self._beats:
            for message in inbox.drain():
                base = _base(message.key)
                try:
                    beat = wire.decode(message.payload, wire.Heartbeat)
                except MessageError:
                    continue  # as if it had not come: silence is told
                items += self._take(core.on_heartbeat(self.fleet, base, beat, now_s))
        for inbox in self._alerts:
            for message in inbox.drain():
                items += self._alert(_base(message.key), message.payload, now_s)
        for tokens in self._tokens:
            for key, alive in tokens.drain():
                items += self._take(core.on_token(self.fleet, _base(key), now_s, alive=alive))
        if now_s - self._passed_s >= _PASS_S:
            self._passed_s = now_s
            items += self._take(core.at(self.fleet, now_s))
            self._ask_where_behind(now_s)
        return items

    def look(self) -> Fleet:
        """All that is known, as of now: what is too old shows it."""
        return core.at(self.fleet, time.monotonic())[0]

    def _alert(self, base: str, payload: bytes, now_s: float) -> list[Item]:
        try:
            alert = wire.decode(payload, wire.Alert)
        except MessageError:
            return self._take(core.on_unreadable(self.fleet, base, now_s))
        items = self._take(core.on_alert(self.fleet, base, alert, now_s))
        if self._repeats and not any(isinstance(item, Alert) for item in items):
            kept = self.fleet.machines[base].alerts if base in self.fleet.machines else ()
            items += [a for a in kept if (a.alert_id, a.seq) == (alert.alert_id, alert.seq)]
        return items

    def _answers(self) -> list[Item]:
        items: list[Item] = []
        for asked in self._open:
            for message in asked.inquiry.drain():
                try:
                    state = wire.decode(message.payload, wire.State)
                except MessageError:
                    continue
                now_s, base = time.monotonic(), _base(message.key)
                items += self._take(core.on_state(self.fleet, base, state, now_s, asked.at_s))
        self._open = [asked for asked in self._open if not asked.inquiry.done]
        return items

    def _ask_where_behind(self, now_s: float) -> None:
        for base, machine in self.fleet.machines.items():
            asked_s = self._asked_s.get(base, float("-inf"))
            if machine.behind and not machine.silent and now_s - asked_s >= _ASK_AGAIN_S:
                self._open.append(self._ask(base, now_s))

    def _ask(self, base: str, now_s: float, answer_s: float = _ANSWER_S) -> _Asked:
        self._asked_s[base] = now_s
        return _Asked(self._bus.inquire(f"{base}/state", answer_s), now_s)

    def _take(self, told: Told) -> list[Item]:
        self.fleet, items = told
        return list(items)


def _base(key: str) -> str:
    return key.rpartition("/")[0]
