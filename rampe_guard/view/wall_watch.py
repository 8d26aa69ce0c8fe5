"""Many machines, live: a full screen on a terminal, a line per event elsewhere, or JSON lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from rich.console import Console
from rich.live import Live

from rampe_guard.client.items import Item, ProtectionBack, ProtectionLost
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.view.bell import Bell
from rampe_guard.view.links import Link
from rampe_guard.view.tell import json_line
from rampe_guard.view.wall import Wall
from rampe_guard.view.wall_screen import render_wall
from rampe_guard.view.watch import FRAME_S

_LINE_S = 0.05


def watch_wall(
    links: Sequence[Link], wall: Wall, stop: StopFlag, console: Console, *, bell: bool
) -> None:
    """Show the machines until ``stop``; on a pipe each event is one line.

    Args:
        links: entered; polled for every picture.
        wall: what is known before the first message.
        stop: ends it.
        console: where to.
        bell: ring the terminal's bell.
    """
    news = _News()
    if not console.is_terminal:
        troubles = _Troubles()
        while not stop.wait(_LINE_S):
            troubles.say(links)
            for event in reversed(wall.hear(news.of(links), time.monotonic()).events):
                line = f"{event.level.word:9} {event.text}"
                console.print(line, markup=False, highlight=False, soft_wrap=True)
        return
    strokes = Bell()
    with Live(console=console, screen=True, auto_refresh=False) as live:
        while not stop.wait(FRAME_S):
            now_s = time.monotonic()
            wall = wall.hear(news.of(links), now_s)
            known = [machine for link in links for machine in link.machines()]
            problems = [link.problem for link in links if link.problem is not None]
            wall = wall.look(known, problems, now_s, time.strftime("%H:%M:%S"))
            width, height = console.size
            live.update(render_wall(wall, width, height), refresh=True)
            if bell:
                levels = [a.level for row in wall.rows for a in row.alerts if a.flashes]
                lost = any(row.lost and not row.seen for row in wall.rows)
                strokes, ring = strokes.ring(levels, now_s, lost=lost)
                if ring:
                    console.bell()


def watch_json(links: Sequence[Link], stop: StopFlag) -> None:
    """Print every transition, change of protection and loss as one JSON object a line."""
    news, troubles = _News(), _Troubles()
    while not stop.wait(_LINE_S):
        troubles.say(links)
        for item in news.of(links):
            sys.stdout.buffer.write(json_line(item, time.time()) + b"\n")
        sys.stdout.buffer.flush()


class _Troubles:
    """Says on stderr why nothing can be heard, once for each reason: a pipe has no banner."""

    def __init__(self) -> None:
        self._said: dict[int, str | None] = {}

    def say(self, links: Sequence[Link]) -> None:
        for number, link in enumerate(links):
            problem = link.problem
            if problem != self._said.get(number):
                self._said[number] = problem
                sys.stderr.write(f"rampe-guard: {problem or 'the Zenoh router is there again'}\n")
                sys.stderr.flush()


class _News:
    """Items of all links; a protection that was told is not told again after a reconnection."""

    def __init__(self) -> None:
        self._told: dict[str, str] = {}

    def of(self, links: Sequence[Link]) -> list[Item]:
        return [item for link in links for item in link.take() if self._new(item)]

    def _new(self, item: Item) -> bool:
        if not isinstance(item, ProtectionLost | ProtectionBack):
            return True
        before = self._told.get(item.base)
        self._told[item.base] = item.protection
        return before != item.protection
