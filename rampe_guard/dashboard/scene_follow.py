"""The scene against which a guard sweeps, followed: another one may be put while it works."""

from __future__ import annotations

import time
from typing import Final

from rampe_guard.core.scene import Scene
from rampe_guard.errors import RampeGuardError
from rampe_guard.runtime.scene_asked import fetch_scene
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site

_AGAIN_S: Final = 2.0
_ANSWER_S: Final = 1.0


class SceneFollower:
    """Asks for the scene when a heartbeat names another one than is known.

    Args:
        site: with the scene of its file.

    Attributes:
        scene: the newest that could be read.
        trouble: why that is not the guard's; empty if it is.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self.scene: Scene = site.scene
        self.trouble = ""
        self._asked: tuple[str, float] | None = None

    def follow(self, bus: Bus, wanted_hash: str) -> bool:
        """See to it that the scene of this hash is known; whether it is a new one."""
        if wanted_hash == self.scene.content_hash:
            self.trouble, self._asked = "", None
            return False
        now_s = time.monotonic()
        if self._asked is not None and self._asked[0] == wanted_hash:
            if now_s - self._asked[1] < _AGAIN_S:
                return False
        else:
            self.trouble = "the guard's scene is not the one that is shown"
        self._asked = wanted_hash, now_s
        try:
            self.scene, _ = fetch_scene(bus, self._site, _ANSWER_S)
        except RampeGuardError as error:
            self.trouble = f"the guard's scene cannot be shown: {error}"
            return False
        if self.scene.content_hash != wanted_hash:
            self.trouble = "the guard's scene cannot be shown: its meshes are others than here"
        else:
            self.trouble = ""
        return True
