"""The client of integrators that work in an event loop of asyncio."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rampe_guard.client.alerts import EVERYONE, network, several
from rampe_guard.client.items import Alert, Item
from rampe_guard.client.machine import MachineState
from rampe_guard.client.stream import Stream
from rampe_guard.settings import DEFAULT_ENDPOINT


class AsyncAlerts:
    """`Alerts` with ``async with`` and ``async for``; the same items, arguments and promises.

    It belongs to the event loop in which it is entered.
    """

    def __init__(
        self,
        connect: str | Sequence[str] = DEFAULT_ENDPOINT,
        base: str | Sequence[str] = EVERYONE,
        *,
        config: str | Path | None = None,
        plain_network: bool = False,
        repeats: bool = False,
        timeout_s: float = 2.0,
        expires_after_s: float = 1.0,
    ) -> None:
        self._news = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stream = Stream(
            network(connect, config, plain=plain_network),
            several(base),
            repeats=repeats,
            timeout_s=timeout_s,
            expires_after_s=expires_after_s,
            on_news=self._wake,
        )

    @property
    def machines(self) -> Mapping[str, MachineState]:
        """What is known of each machine now, by base; complete as soon as it is entered."""
        return self._stream.machines

    async def acknowledge(self, alert: Alert, *, who: str) -> Alert:
        """See `Alerts.acknowledge`."""
        return await asyncio.to_thread(self._stream.acknowledge, alert, who)

    async def shelve(self, alert: Alert, *, who: str, duration_s: float) -> Alert:
        """See `Alerts.shelve`."""
        return await asyncio.to_thread(self._stream.shelve, alert, who, duration_s)

    async def close(self) -> None:
        """End the session and the iteration."""
        await asyncio.to_thread(self._stream.close)

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Item:
        while True:
            self._news.clear()  # before the look: news that comes after it wakes us
            item = self._stream.take()
            if item is not None:
                return item
            if self._stream.closed:
                raise StopAsyncIteration
            await self._news.wait()

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        await asyncio.to_thread(self._stream.open)
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    def _wake(self) -> None:
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended: nobody waits
                self._loop.call_soon_threadsafe(self._news.set)
