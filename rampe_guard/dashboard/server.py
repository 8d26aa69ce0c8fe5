"""The dashboard: machines followed, pages served.

One loop polls every machine, composes a picture of each that somebody looks at, and puts it
onto their pages. Sending is viser's: it keeps for each page only the newest value of what
has not gone out yet, so a page on a bad line gets fewer pictures and slows nobody.
"""

from __future__ import annotations

import logging
import socket
import threading
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace

import viser

from rampe_guard.core.scene import Scene
from rampe_guard.dashboard.access import Access
from rampe_guard.dashboard.compose import compose
from rampe_guard.dashboard.feed import Feed
from rampe_guard.dashboard.gate import Gate
from rampe_guard.dashboard.model import Model, in_scene
from rampe_guard.dashboard.panel import Panel
from rampe_guard.dashboard.stage import Stage
from rampe_guard.errors import ConnectionFailedError, GeometryError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag

FRAME_S = 1.0 / 30.0
"""Period of pictures [s]."""


class _Server(viser.ViserServer):
    """viser, without its way out to the internet."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002 - its name
        """Refuse: no page of a machine is put on a server of somebody else's."""
        return None


class Page:
    """One browser window: its own choice of machine.

    Args:
        client: of viser.
        models: all machines.
        feeds: the same, followed.
    """

    def __init__(
        self, client: viser.ClientHandle, models: Sequence[Model], feeds: Sequence[Feed]
    ) -> None:
        self._client = client
        self._models = models
        self._stage: Stage | None = None
        self._staged: Model | None = None
        self.chosen = 0
        names = [f"{m.site.machine} · {m.site.name}" for m in models]
        self._panel = Panel(client, names, self._choose, lambda: feeds[self.chosen])

    def show(self, feeds: Sequence[Feed]) -> None:
        """Put the newest picture of the chosen machine onto it."""
        chosen = self.chosen
        model = self._models[chosen]
        picture = compose(model, feeds[chosen].sight)
        with self._client.atomic():
            if self._stage is None or self._staged is not model:
                if self._stage is not None:
                    self._stage.clear()
                self._stage, self._staged = Stage(self._client, model), model
            self._stage.show(picture, night=self._panel.night)
            self._panel.show(picture)

    def _choose(self, index: int) -> None:
        self.chosen = index


class Dashboard:
    """Serves pages of some machines until told to stop.

    Args:
        models: the machines.
        feeds: who follows them, in the same order.
        host: address to listen on.
        port: the same; 0 for any that is free.
        token: that pages have to show; needed beyond loopback.
        names: further names by which browsers may call it.

    Raises:
        ConnectionFailedError: the address cannot be listened on.
    """

    def __init__(
        self,
        models: Sequence[Model],
        feeds: Sequence[Feed],
        host: str,
        port: int,
        token: str | None = None,
        names: Sequence[str] = (),
    ) -> None:
        self._models, self._feeds = list(models), feeds
        # a picture may be on its way to a page that has just gone: nothing to warn of
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        self._lock = threading.Lock()
        self._pages: dict[int, Page] = {}
        # a health check, or whatever else speaks no websocket, is no fault of ours
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
        port = _free(host, port)
        self.gate = Gate(Access(host, port, token, names), Sayer("rampe_guard.dashboard"))
        with self.gate.guarding():
            self._server = _Server(host=host, port=port, verbose=False)
        self._server.on_client_connect(self._come)
        self._server.on_client_disconnect(self._go)

    @property
    def port(self) -> int:
        """What it listens on."""
        return self._server.get_port()

    def run(self, stop: StopFlag) -> None:
        """Follow and show until ``stop``."""
        next_s = time.monotonic()
        while not stop.wait(max(0.0, next_s - time.monotonic())):
            next_s = max(next_s + FRAME_S, time.monotonic())
            self.tick()

    def tick(self) -> None:
        """One picture for every page."""
        now_s = time.monotonic()
        for number, feed in enumerate(self._feeds):
            feed.poll(now_s)
            self._change_scene(number, feed.scene)
        with self._lock:
            pages = list(self._pages.items())
        for number, page in pages:
            try:
                page.show(self._feeds)
            except Exception:  # whatever it is, the other pages go on
                # this one will say by itself that it has lost its dashboard
                logging.getLogger(__name__).exception("page %d is given up", number)
                self._drop(number)

    def _change_scene(self, number: int, scene: Scene) -> None:
        """Draw a machine in another scene from now on, if there is another."""
        model = self._models[number]
        if scene is model.site.scene:
            return
        try:
            self._models[number] = in_scene(model, scene)
        except GeometryError as error:  # what is drawn stays, and says that it is another
            self._feeds[number].undrawable = f"the guard's scene cannot be drawn: {error}"
            self._models[number] = replace(model, site=replace(model.site, scene=scene))

    def close(self) -> None:
        """Send all pages away."""
        self._server.stop()

    # in threads of viser's

    def _come(self, client: viser.ClientHandle) -> None:
        page = Page(client, self._models, self._feeds)
        with self._lock:
            self._pages[client.client_id] = page

    def _go(self, client: viser.ClientHandle) -> None:
        self._drop(client.client_id)

    def _drop(self, number: int) -> None:
        with self._lock:
            self._pages.pop(number, None)


def _free(host: str, port: int) -> int:
    """The port, seen to be free: viser would quietly take the next one."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise ConnectionFailedError(
                f"cannot listen on {host} port {port}: {error.strerror or error};"
                " give another with --port or --host"
            ) from None
        found: int = probe.getsockname()[1]
        return found
