"""The scene that a guard says it works with: fetched when it is another than is attached."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Final

from rampe_guard.errors import ConnectionFailedError, RampeGuardError
from rampe_guard.recording.bundle import Bundle, gather
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.scene_asked import fetch_scene
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site

_ANSWER_S: Final = 2.0


class SceneWatch:
    """Keeps site and bundle at the scene in force.

    `notice` is called by the thread that hears, `changed` by the one that writes, which may wait.

    Args:
        site: with the scene of its file.
        bundle: made of that.
        say: log.
    """

    def __init__(self, site: Site, bundle: Bundle, say: Sayer) -> None:
        self.site, self.bundle = site, bundle
        self._own, self._say = site, say
        self._bus: Bus | None = None
        self._wanted = threading.Event()
        self._said = site.scene.content_hash

    def ask(self, bus: Bus) -> None:
        """The session on which the guard is asked."""
        self._bus = bus

    def notice(self, scene_hash: str) -> None:
        """Take what a heartbeat says."""
        if scene_hash != self._said:
            self._said = scene_hash
            self._wanted.set()

    def changed(self) -> bool:
        """Whether another scene is attached from now on; asks the guard if it must."""
        if self._bus is None or not self._wanted.is_set():
            return False
        self._wanted.clear()
        if self._said == self.site.scene.content_hash:
            return False
        try:
            self.site, self.bundle = self._fetched(self._bus)
        except RampeGuardError as error:
            text = "the guard works with another scene than is attached, and it cannot be had"
            self._say.warn("scene", f"{text}: {error}")
            return False
        heard = {item.key for item in self._own.scene.moving}
        unheard = [item.name for item in self.site.scene.moving if item.key not in heard]
        self._say.info(f"the guard works with another scene: {self.site.scene.content_hash[:12]}")
        if unheard:
            names = ", ".join(unheard)
            self._say.warn("unheard", f"poses of {names} are not recorded: start the recorder anew")
        return True

    def _fetched(self, bus: Bus) -> tuple[Site, Bundle]:
        scene, told = fetch_scene(bus, self._own, _ANSWER_S)
        if scene.content_hash != told.scene_hash:
            raise ConnectionFailedError("its meshes are others than here")
        site = replace(self._own, scene=scene)
        return site, gather(site)
