"""A session, a thread that follows the guards, and the items that wait for whoever reads them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from rampe_guard import wire
from rampe_guard.client.feed import Feed
from rampe_guard.client.items import Alert, Item, MessagesLost, alert_from
from rampe_guard.client.machine import MachineState
from rampe_guard.client.order import Order, give
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import ZenohSettings

MAX_WAITING = 10_000
"""Items that may wait for a slow reader; then the oldest goes, and its loss is told."""
_WAKE_S = 0.02
"""Sleep between looks at the network: adds half of it to the latency; many clients may share
a machine."""
_TRY_AGAIN_S = 0.2


class Stream:
    """Follows guards from `open` to `close`; safe to use from several threads.

    Args:
        zenoh: how to join the network.
        bases: key expressions of prefixes of guards.
        repeats: give repeats of alerts too.
        timeout_s: how long to wait for a router, and for an answer [s].
        expires_after_s: age at which a heartbeat must not be trusted [s].
        on_news: called from our thread whenever items wait or the end has come.
    """

    def __init__(
        self,
        zenoh: ZenohSettings,
        bases: Sequence[str],
        *,
        repeats: bool,
        timeout_s: float,
        expires_after_s: float,
        on_news: Callable[[], None] | None = None,
    ) -> None:
        self._zenoh, self._bases, self._repeats = zenoh, bases, repeats
        self._timeout_s, self._expires_after_s = timeout_s, expires_after_s
        self._on_news = on_news
        self._news = threading.Condition()
        self._feed_lock = threading.Lock()
        self._waiting: deque[Item] = deque()
        self._dropped = 0
        self._closing = threading.Event()
        self._failure: BaseException | None = None
        self._bus: Bus | None = None
        self._feed: Feed | None = None
        self._thread = threading.Thread(target=self._follow, name="rampe-guard client", daemon=True)

    @property
    def closed(self) -> bool:
        """No item will come any more."""
        return self._closing.is_set()

    def open(self) -> None:
        """Join, learn the present state, and begin to follow.

        Raises:
            ConnectionFailedError: no router answers.
            SettingsError: an endpoint or a key expression is not valid.
        """
        bus = _open(self._zenoh, time.monotonic() + self._timeout_s)
        try:
            feed = Feed(
                bus,
                self._bases,
                repeats=self._repeats,
                answer_s=self._timeout_s,
                expires_after_s=self._expires_after_s,
            )
            self._add(feed.catch_up())
        except BaseException:
            bus.close()
            raise
        self._bus, self._feed = bus, feed
        self._thread.start()

    def close(self) -> None:
        """End; whoever waits for an item is told so."""
        self._closing.set()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join()
        if self._bus is not None:
            self._bus.close()
            self._bus = None
        self._tell()

    @property
    def machines(self) -> Mapping[str, MachineState]:
        """What is known of each machine now, by base."""
        if self._feed is None:
            return {}
        with self._feed_lock:
            return self._feed.look().machines

    def take(self) -> Item | None:
        """The next item, if one waits. Raises what ended our thread, if something did."""
        with self._news:
            if self._dropped:
                dropped, self._dropped = self._dropped, 0
                return _overrun(dropped)
            if self._waiting:
                return self._waiting.popleft()
        if self._failure is not None:
            raise self._failure
        return None

    def wait(self, timeout_s: float | None) -> Item | None:
        """The next item; None when the time [s] is over or the end has come."""
        with self._news:
            self._news.wait_for(lambda: self._waiting or self.closed, timeout_s)
        return self.take()

    def acknowledge(self, alert: Alert, who: str) -> Alert:
        """Say that someone has seen an alert; the alert as it is then.

        Raises:
            ConnectionFailedError: no guard answers, or it refuses, with its reason.
        """
        return self._order(alert.base, wire.Ack(alert_id=alert.alert_id, who=who))

    def shelve(self, alert: Alert, who: str, duration_s: float) -> Alert:
        """Keep an alert silent for a while [s]; 0 ends that; the alert as it is then.

        Raises:
            ConnectionFailedError: no guard answers, or it refuses, with its reason.
        """
        wish = wire.Shelve(alert_id=alert.alert_id, who=who, duration_s=duration_s)
        return self._order(alert.base, wish)

    def _order(self, base: str, order: Order) -> Alert:
        if self._bus is None:
            raise ConnectionFailedError(f"{base}: the client is closed")
        answer = give(self._bus, base, order, self._timeout_s)
        return alert_from(wire.decode(answer, wire.Alert), base, time.monotonic())

    def _follow(self) -> None:
        try:
            while not self._closing.wait(_WAKE_S):
                with self._feed_lock:
                    items = [] if self._feed is None else self._feed.poll()
                self._add(items)
        except BaseException as error:  # noqa: BLE001 - the reader gets it, whatever it is
            self._failure = error
            self._closing.set()
            self._tell()

    def _add(self, items: Sequence[Item]) -> None:
        if not items:
            return
        with self._news:
            self._waiting.extend(items)
            while len(self._waiting) > MAX_WAITING:
                self._waiting.popleft()
                self._dropped += 1
        self._tell()

    def _tell(self) -> None:
        with self._news:
            self._news.notify_all()
        if self._on_news is not None:
            self._on_news()


def _open(zenoh: ZenohSettings, deadline_s: float) -> Bus:
    while True:
        try:
            return Bus.open(zenoh)
        except ConnectionFailedError:
            if time.monotonic() >= deadline_s:
                raise
            time.sleep(_TRY_AGAIN_S)


def _overrun(dropped: int) -> MessagesLost:
    return MessagesLost(
        base="",
        site="",
        machine="",
        key="",
        count=dropped,
        level="warning",
        text=f"{dropped} items were not read in time: see `machines`",
    )
