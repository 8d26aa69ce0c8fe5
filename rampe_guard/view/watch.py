"""``rampe-guard watch``: one machine on a terminal, live."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.live import Live

from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.view.observer import Heard, Observer
from rampe_guard.view.screen import render
from rampe_guard.view.state import EventView

_FRAME_S = 0.12
"""Eight pictures a second: a person sees no more, and a cab computer has better to do."""


def watch(
    observer: Observer,
    stop: StopFlag,
    console: Console,
    heard: Callable[[list[Heard]], bool] = lambda _: False,
) -> None:
    """Show the machine until ``stop``, or until ``heard`` says that it is enough.

    On a terminal this is a full screen; elsewhere (a pipe, a log) each event is one line.

    Args:
        observer: polled for every picture.
        stop: ends it.
        console: where to.
        heard: is given what each poll brought; True ends the watch.
    """
    if console.is_terminal:
        _screen(observer, stop, console, heard)
    else:
        _lines(observer, stop, console, heard)


def _screen(
    observer: Observer, stop: StopFlag, console: Console, heard: Callable[[list[Heard]], bool]
) -> None:
    with Live(console=console, screen=True, auto_refresh=False) as live:
        while not stop.wait(_FRAME_S) and not heard(observer.poll()):
            width, height = console.size
            live.update(render(observer.state, width, height), refresh=True)


def _lines(
    observer: Observer, stop: StopFlag, console: Console, heard: Callable[[list[Heard]], bool]
) -> None:
    last: EventView | None = None
    while not stop.wait(_FRAME_S) and not heard(observer.poll()):
        new: list[EventView] = []
        for event in observer.state.events:  # newest first
            if event is last:
                break
            new.append(event)
        for event in reversed(new):
            line = f"{event.level.word:9} {event.text}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)
            last = event
