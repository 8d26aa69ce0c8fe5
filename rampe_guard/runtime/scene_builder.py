"""Builds a scene that was put, beside the worker, which goes on to sweep against the old one.

::

    text ─► read ─► (meshes, or much text: tried in a process of its own) ─► sweeper ─► kept

One at a time. What comes out waits for the worker, who takes it between two steps.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from rampe_guard.collision import FclSweeper
from rampe_guard.core.scene import Mesh
from rampe_guard.errors import RampeGuardError, RefusedError
from rampe_guard.runtime.scene_kept import SceneKeeper, SceneSource
from rampe_guard.runtime.scene_trial import try_scene
from rampe_guard.settings import Site, load_scene_text

_LONG: Final = 32 * 1024
"""Longer texts take more than a moment to read [characters]."""


@dataclass(frozen=True, slots=True)
class Built:
    """A scene that is ready, and whether it is kept."""

    source: SceneSource
    sweeper: FclSweeper
    kept: bool


class SceneBuilder:
    """One thread at a time.

    Args:
        site: whose scene is replaced.
        keeper: keeps what was built.
        trial: builds a text elsewhere, and raises what is wrong with it.
    """

    def __init__(
        self, site: Site, keeper: SceneKeeper, trial: Callable[[str, str], None] = try_scene
    ) -> None:
        self._site, self._keeper, self._trial = site, keeper, trial
        self._thread: threading.Thread | None = None
        self._result: Built | RampeGuardError | None = None

    @property
    def busy(self) -> bool:
        """A scene is being built, or waits to be taken."""
        return self._thread is not None

    def check_free(self) -> None:
        """See whether another scene can be begun.

        Raises:
            RefusedError: it cannot.
        """
        if self.busy:
            raise RefusedError("another scene is being built; put this one again when that is done")

    def begin(self, text: str, who: str, unix_s: float, sweeper: FclSweeper) -> None:
        """Build the scene of ``text`` for the arm of ``sweeper``."""
        if self._thread is not None:
            raise RuntimeError("one scene at a time")
        # a daemon: a mesh that takes long must not keep the process from ending
        self._thread = threading.Thread(
            target=self._work, args=(text, who, unix_s, sweeper), name="scene", daemon=True
        )
        self._thread.start()

    def take(self) -> Built | RampeGuardError | None:
        """What came of it, once: the scene or what is wrong with it; None while it is built."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread.join()
        result, self._thread, self._result = self._result, None, None
        return result

    def _work(self, text: str, who: str, unix_s: float, sweeper: FclSweeper) -> None:
        try:
            self._result = self._build(text, who, unix_s, sweeper)
        except RampeGuardError as error:
            self._result = error
        except Exception as error:  # noqa: BLE001 - whatever it is, the old scene stays
            self._result = RefusedError(f"the scene cannot be built: {error!r}")

    def _build(self, text: str, who: str, unix_s: float, sweeper: FclSweeper) -> Built:
        tried = len(text) > _LONG
        if tried:
            self._trial(self._site.path, text)
        scene = load_scene_text(text, self._site)
        if not tried and any(isinstance(item, Mesh) for item in scene.objects):
            self._trial(self._site.path, text)
        source = SceneSource(scene, who, unix_s)
        ready = sweeper.in_scene(scene)
        return Built(source, ready, self._keeper.keep(source))
