"""A router, speakers for many machines, and clients of them, in little time."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rampe_guard.client import Alert, Alerts, Item
from tests.support import processes
from tests.support.processes import Process, until

FLEET = [f"rampe/quarry/excavator-{i}/guard" for i in (1, 2, 3)]
EVERYONE = "rampe/quarry/*/guard"


@dataclass
class Hall:
    """Where guards speak."""

    folder: Path
    endpoint: str
    router: Process
    speaker: Process

    def say(self, base: str = FLEET[0], **word: Any) -> None:
        """Words for a speaker, see `speaker`."""
        self.speaker.tell(json.dumps({"base": base, **word}))


@contextlib.contextmanager
def hall(folder: Path, bases: list[str] | None = None) -> Iterator[Hall]:
    """Start all; end all."""
    endpoint = processes.free_endpoint()
    with processes.router(folder, endpoint) as router, speaker(folder, endpoint, bases) as voice:
        yield Hall(folder, endpoint, router, voice)


@contextlib.contextmanager
def speaker(folder: Path, endpoint: str, bases: list[str] | None = None) -> Iterator[Process]:
    """Guards that say what they are told."""
    args = ["-m", "tests.support.speaker", endpoint, *(bases or FLEET)]
    with Process(folder, "speaker", args, talk=True) as voice:
        voice.wait_for("ready")
        yield voice


def gather(
    alerts: Alerts, enough: Callable[[list[Item]], object], within_s: float = 10.0
) -> list[Item]:
    """Items until there are enough."""
    items: list[Item] = []

    def more() -> bool:
        item = alerts.get(timeout_s=0.05)
        items.extend([] if item is None else [item])
        return bool(enough(items))

    until(more, within_s, lambda: f"more than {[(type(i).__name__, i.text) for i in items]}")
    return items


def of(kind: type[Item]) -> Callable[[list[Item]], bool]:
    """One of this kind has come."""
    return lambda items: any(isinstance(item, kind) for item in items)


def shown(items: list[Item]) -> list[tuple[str, str | None, str, str]]:
    """Machine, zone, level and state of the alerts among items."""
    return [(i.machine, i.zone, i.level, i.state) for i in items if isinstance(i, Alert)]
