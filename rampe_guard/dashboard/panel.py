"""The controls of one page, and everything that is text on it.

An alert keeps its place for as long as it lives, and no place moves while one below it is
taken: a finger that comes down on a button meets the alert that it was meant for. A button
whose alert has just changed does nothing but say so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import viser

from rampe_guard.dashboard import markup
from rampe_guard.dashboard.picture import Card, Picture
from rampe_guard.dashboard.places import Places
from rampe_guard.errors import ConnectionFailedError

PLACES = 4
WIDTH_PX = 416
"""As --rg-panel in style.css: 400 and the frame that says that nobody watches."""
_SETTLED_S = 0.5
"""How long a place must have shown its alert before its buttons count [s]."""
_BEAT_S = 0.3
"""How often the page is told that its dashboard lives [s]; it waits for 1.2 s."""
_SLOW_S = 0.1
"""Bars move ten times a second [s]."""
ACKNOWLEDGE = "Acknowledge"
SHELVE_S = {"10 s": 10.0, "30 s": 30.0}
UNSHELVE = "end it"
NO_SHELVING = "not possible"
DAY, NIGHT = "Day", "Night"


class Orders(Protocol):
    """What a page may ask of a guard; `Feed` can."""

    def acknowledge(self, alert_id: str, who: str) -> None:
        """Somebody has seen it."""

    def shelve(self, alert_id: str, who: str, duration_s: float) -> None:
        """Put it aside for a time [s]."""


class Html:
    """A piece of HTML that is sent only when it changed."""

    def __init__(self, gui: viser.GuiApi, content: str = "") -> None:
        self._handle = gui.add_html(content)
        self._content = content

    def put(self, content: str) -> None:
        """Show this."""
        if content != self._content:
            self._content = content
            self._handle.content = content


@dataclass
class _Place:
    """Where one alert is shown: HTML and two rows of buttons."""

    html: Html
    ack: viser.GuiButtonHandle
    shelve: viser.GuiButtonGroupHandle
    card: Card | None = None
    since_s: float = 0.0
    used: bool = True


class Panel:
    """The panel of one client.

    Args:
        client: of viser.
        machines: names to choose from.
        choose: is told the chosen index.
        orders: where acknowledgements of the chosen machine go.

    Attributes:
        night: the dark colours are on.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        machines: Sequence[str],
        choose: Callable[[int], None],
        orders: Callable[[], Orders],
    ) -> None:
        self._client = client
        self._orders = orders
        self._count = 0
        self._beat_s = self._slow_s = float("-inf")
        gui = client.gui
        self._theme(night=True)  # a bright screen blinds in a dark cab, a dark one nobody
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH_PX)
        gui.add_html(markup.style())
        self._alive = Html(gui, markup.alive(0))
        self._banner = Html(gui)
        self._side = Html(gui)
        self._head = Html(gui)
        if len(machines) > 1:
            chooser = gui.add_dropdown("Machine", tuple(machines))
            chooser.on_update(lambda _: choose(list(machines).index(chooser.value)))
        self._places = [self._place(gui, i) for i in range(PLACES)]
        self._seats = Places(PLACES)
        self._bars = Html(gui)
        self._happenings = Html(gui)
        self._who = gui.add_text("Your name", "dashboard")
        theme = gui.add_button_group("Light", (DAY, NIGHT))
        theme.on_click(lambda _: self._theme(night=theme.value == NIGHT))
        self._foot = Html(gui)

    def show(self, picture: Picture) -> None:
        """Bring the panel up to date."""
        now_s = picture.now_s
        if now_s - self._beat_s >= _BEAT_S:
            self._beat_s, self._count = now_s, self._count + 1
            self._alive.put(markup.alive(self._count))
        self._banner.put(markup.banner(picture.banner))
        self._side.put(markup.side(picture))
        self._head.put(markup.head(picture))
        cards = {card.alert_id: card for card in picture.cards}
        seats = self._seats.seat([card.alert_id for card in picture.cards])
        last = max((i for i, seated in enumerate(seats) if seated is not None), default=0)
        for index, (place, seated) in enumerate(zip(self._places, seats, strict=True)):
            card = None if seated is None else cards[seated]
            self._fill(place, card, now_s, used=index <= last)
        if now_s - self._slow_s >= _SLOW_S:
            self._slow_s = now_s
            self._bars.put(markup.actuators(picture))
            self._happenings.put(markup.happenings(picture, time.time() - time.monotonic()))
            self._foot.put(markup.footer(picture))

    def _theme(self, *, night: bool) -> None:
        self.night = night
        self._client.gui.configure_theme(
            dark_mode=night, show_logo=False, show_share_button=False, control_width="large"
        )

    def _place(self, gui: viser.GuiApi, index: int) -> _Place:
        html = Html(gui, markup.card(None))
        ack = gui.add_button(ACKNOWLEDGE, disabled=True)
        shelve = gui.add_button_group("Shelve", (NO_SHELVING,))  # cannot be disabled, so it says so
        ack.on_click(lambda _: self._pressed(index, ACKNOWLEDGE))
        shelve.on_click(lambda _: self._pressed(index, str(shelve.value)))
        return _Place(html, ack, shelve)

    def _fill(self, place: _Place, card: Card | None, now_s: float, *, used: bool) -> None:
        before = place.card
        if (before and before.alert_id) != (card and card.alert_id):
            place.since_s = now_s
        place.card = card
        place.html.put(markup.card(card) if used else "")
        waits = card is not None and card.can_ack
        if place.ack.disabled is waits:
            place.ack.disabled = not waits
        options = _shelving(card)
        if place.shelve.options != options:
            place.shelve.options = options
        for handle in (place.ack, place.shelve):
            if handle.visible is not used:
                handle.visible = used

    def _pressed(self, index: int, button: str) -> None:
        """In a thread of viser's: it may wait for the guard's answer."""
        place = self._places[index]
        card = place.card
        if card is None or time.monotonic() - place.since_s < _SETTLED_S:
            self._say("Not sent", "The alert has just changed: look again, then press.")
            return
        who = self._who.value.strip()[:100] or "dashboard"
        try:
            if button == ACKNOWLEDGE:
                self._orders().acknowledge(card.alert_id, who)
            elif button == NO_SHELVING:
                self._say(f"Shelve: {card.title}", "What is imminent or latched is not shelved.")
            else:
                self._orders().shelve(card.alert_id, who, SHELVE_S.get(button, 0.0))
        except ConnectionFailedError as error:
            self._say(f"{button}: {card.title}", str(error))

    def _say(self, title: str, body: str) -> None:
        self._client.add_notification(title, body, auto_close_seconds=6.0, color="gray")


def _shelving(card: Card | None) -> tuple[str, ...]:
    """Buttons for it; always one row of them, so that nothing moves."""
    if card is not None and card.shelved:
        return (UNSHELVE,)
    if card is not None and card.can_shelve:
        return tuple(SHELVE_S)
    return (NO_SHELVING,)
