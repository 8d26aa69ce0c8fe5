"""The guards of one or more networks, each followed by a thread of its own.

A router that is not there, or goes, must not blind the view of the others: each network is
joined and polled in its own thread, and whoever draws only looks at frozen values.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Self

from rampe_guard.client import fleet as core
from rampe_guard.client.feed import Feed
from rampe_guard.client.fleet import Fleet
from rampe_guard.client.items import Item
from rampe_guard.client.machine import MachineState
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.zenoh_io import Bus, check_configuration, check_key_expression, is_pattern
from rampe_guard.settings import ZenohSettings

_POLL_S = 0.02
_TRY_AGAIN_S = 0.5
_MAX_WAITING = 10_000
"""Items that may wait for a terminal that takes none (Ctrl-S, a full pipe)."""


class Link:
    """Follows guards on one network from entering to leaving; it waits for no router.

    Args:
        zenoh: how to join.
        bases: key expressions of prefixes of guards.

    Raises:
        SettingsError: the configuration or a key expression is not valid.
    """

    def __init__(self, zenoh: ZenohSettings, bases: Sequence[str]) -> None:
        check_configuration(zenoh)
        for base in bases:
            check_key_expression(f"{base}/alert")
        self._zenoh, self._bases = zenoh, tuple(bases)
        self._closing = threading.Event()
        self._items: deque[Item] = deque(maxlen=_MAX_WAITING)
        self._missing: list[Item] = []
        self._failure: BaseException | None = None
        self._fleet = Fleet()
        self.problem: str | None = None
        """Why nothing can be heard, if nothing can."""
        self._thread = threading.Thread(target=self._follow, name="rampe-guard watch", daemon=True)

    def take(self) -> list[Item]:
        """What there is to tell since the last look. Raises what ended our thread, if any did."""
        if self._failure is not None:
            raise self._failure
        return [self._items.popleft() for _ in range(len(self._items))]

    def machines(self) -> Iterable[MachineState]:
        """What is known of each machine now: what is too old shows it."""
        return core.at(self._fleet, time.monotonic())[0].machines.values()

    def _follow(self) -> None:
        try:
            self._expect()
            bus = self._join()
            if bus is not None:
                with bus:
                    self._hear(bus)
        except BaseException as error:  # noqa: BLE001 - whoever looks gets it, whatever it is
            self._failure = error

    def _expect(self) -> None:
        """Machines that are named should be there: until they are heard, nobody is protected."""
        for base in self._bases:
            if not is_pattern(base):
                self._fleet, items = core.expect(self._fleet, base, time.monotonic())
                self._missing.extend(items)

    def _join(self) -> Bus | None:
        while not self._closing.is_set():
            try:
                bus = Bus.open(self._zenoh)
            except ConnectionFailedError as error:
                self.problem = str(error)
                self._items.extend(self._missing)
                self._missing.clear()
                self._closing.wait(_TRY_AGAIN_S)
            else:
                self.problem = None
                return bus
        return None

    def _hear(self, bus: Bus) -> None:
        feed = Feed(bus, self._bases)
        self._items.extend(feed.catch_up())
        while not self._closing.is_set():
            self._fleet = feed.fleet
            self.problem = None if bus.connected else "the Zenoh router is gone"
            self._closing.wait(_POLL_S)
            self._items.extend(feed.poll())

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._closing.set()
        self._thread.join()
