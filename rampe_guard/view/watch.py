"""``rampe-guard watch``: one machine on a terminal, live."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.live import Live

from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.view.bell import Bell
from rampe_guard.view.marks import ALARMING
from rampe_guard.view.observer import Heard, Observer
from rampe_guard.view.screen import render
from rampe_guard.view.state import EventView

FRAME_S = 0.12
"""Eight pictures a second: a person sees no more, and a cab computer has better to do."""


def watch(
    observer: Observer,
    stop: StopFlag,
    console: Console,
    heard: Callable[[list[Heard]], bool] = lambda _: False,
    *,
    bell: bool = False,
) -> None:
    """Show the machine until ``stop``, or until ``heard`` says that it is enough.

    On a terminal this is a full screen; elsewhere (a pipe, a log) each event is one line.

    Args:
        observer: polled for every picture.
        stop: ends it.
        console: where to.
        heard: is given what each poll brought; True ends the watch.
        bell: ring the terminal's bell.
    """
    if console.is_terminal:
        _screen(observer, stop, console, heard, bell=bell)
    else:
        _lines(observer, stop, console, heard)


def _screen(
    observer: Observer,
    stop: StopFlag,
    console: Console,
    heard: Callable[[list[Heard]], bool],
    *,
    bell: bool,
) -> None:
    strokes = Bell()
    with Live(console=console, screen=True, auto_refresh=False) as live:
        while not stop.wait(FRAME_S) and not heard(observer.poll()):
            width, height = console.size
            state = observer.state
            live.update(render(state, width, height), refresh=True)
            if bell:
                levels = [alert.level for alert in state.alerts if alert.flashes]
                lost = state.protection in ALARMING and not state.seen
                strokes, ring = strokes.ring(levels, state.now_s, lost=lost)
                if ring:
                    console.bell()


def _lines(
    observer: Observer, stop: StopFlag, console: Console, heard: Callable[[list[Heard]], bool]
) -> None:
    last: EventView | None = None
    while not stop.wait(FRAME_S) and not heard(observer.poll()):
        new: list[EventView] = []
        for event in observer.state.events:  # newest first
            if event is last:
                break
            new.append(event)
        for event in reversed(new):
            line = f"{event.level.word:9} {event.text}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)
            last = event
