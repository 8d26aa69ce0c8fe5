"""The client of integrators that wait in a thread: iterate, look, acknowledge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rampe_guard.client.items import Alert, Item
from rampe_guard.client.machine import MachineState
from rampe_guard.client.stream import Stream
from rampe_guard.settings import DEFAULT_ENDPOINT, ZenohSettings

EVERYONE = "rampe/*/*/guard"


class Alerts:
    """What happens to guarded machines, as a context manager to iterate over.

    It begins with the present: how each machine is protected, and every alert that is active.
    Then come transitions, each once: a rise or fall of an alert, an acknowledgement, a clear;
    `ProtectionLost` and `ProtectionBack`; `GuardRestarted`; `MessagesLost`. All have ``base``,
    ``site``, ``machine``, ``level`` and ``text``. The end of the iteration is `close`.

    A machine is safe to call clear only while its `MachineState.protection` is guarded. Nothing
    is called clear because a message did not come.

    Any thread may call any method. Items wait for a slow reader (`stream.MAX_WAITING`, then the
    oldest are dropped, which `MessagesLost` tells); the guard never waits for anybody.

    Args:
        connect: Zenoh endpoint(s) of a router.
        base: key expression(s) of the prefixes of guards. A machine named without wildcards is
            told as unavailable if nothing is heard of it.
        config: a Zenoh configuration file (TLS, users), instead of ``connect``.
        plain_network: accept endpoints without certificates that are not on this machine: anyone
            on that network can read and forge messages.
        repeats: give the repeats of active alerts too (5 Hz each).
        timeout_s: how long to wait for a router, and for an answer of a guard [s].
        expires_after_s: age at which a heartbeat (5 Hz) must not be trusted [s].
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
        self._stream = Stream(
            network(connect, config, plain=plain_network),
            several(base),
            repeats=repeats,
            timeout_s=timeout_s,
            expires_after_s=expires_after_s,
        )

    @property
    def machines(self) -> Mapping[str, MachineState]:
        """What is known of each machine now, by base; complete as soon as it is entered."""
        return self._stream.machines

    def get(self, timeout_s: float | None = None) -> Item | None:
        """The next item; None when the time [s] is over, or it was closed."""
        return self._stream.wait(timeout_s)

    def acknowledge(self, alert: Alert, *, who: str) -> Alert:
        """Say that someone has seen an alert; returns the alert as it is then.

        Raises:
            ConnectionFailedError: no guard answers, or it refuses, with its reason.
        """
        return self._stream.acknowledge(alert, who)

    def shelve(self, alert: Alert, *, who: str, duration_s: float) -> Alert:
        """Keep an alert silent for a while [s], at most 30 s; 0 ends that.

        An imminent alert cannot be shelved, and one that becomes imminent breaks through.

        Raises:
            ConnectionFailedError: no guard answers, or it refuses, with its reason.
        """
        return self._stream.shelve(alert, who, duration_s)

    def close(self) -> None:
        """End the session and the iteration, here and in other threads."""
        self._stream.close()

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Item:
        item = self._stream.wait(None)
        if item is None:
            raise StopIteration
        return item

    def __enter__(self) -> Self:
        self._stream.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def network(
    connect: str | Sequence[str], config: str | Path | None, *, plain: bool
) -> ZenohSettings:
    """How to join: a configuration file, or endpoints as a client."""
    file, ends = (None, several(connect)) if config is None else (str(config), ())
    return ZenohSettings(file, "client", ends, plain_network=plain)


def several(names: str | Sequence[str]) -> tuple[str, ...]:
    """One or more of them."""
    return (names,) if isinstance(names, str) else tuple(names)
