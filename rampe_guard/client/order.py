"""What people ask of a guard: of one alert, or of what it learned."""

from __future__ import annotations

from typing import TypeAlias

from rampe_guard import wire
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.runtime.zenoh_io import Bus

Order: TypeAlias = wire.Ack | wire.Shelve | wire.Forget

_WORDS = {wire.Ack: "ack", wire.Shelve: "shelve", wire.Forget: "forget"}


def give(bus: Bus, base: str, order: Order, timeout_s: float = 2.0) -> bytes:
    """Ask it of the guard at ``base``; returns its answer, as it came.

    Raises:
        ConnectionFailedError: no guard answers, or it refuses, with its reason.
    """
    key = f"{base}/{_WORDS[type(order)]}"
    answers = bus.ask(key, wire.encode(order), timeout_s)
    if not answers:
        raise ConnectionFailedError(unanswered(key))
    return answers[0]


def unanswered(key: str) -> str:
    """What may be the matter when nobody answers: a router that refuses does it silently."""
    return (
        f"no answer on {key}: no guard is there, or this certificate may not ask, or the way to it"
        " was lost; whether it was done is not known"
    )
