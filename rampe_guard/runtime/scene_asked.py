"""The scene in force, asked of a guard that works: for viewers, recorders and people."""

from __future__ import annotations

from rampe_guard import wire
from rampe_guard.core.scene import Scene
from rampe_guard.errors import ConnectionFailedError, MessageError
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, load_scene_text


def ask_scene(
    bus: Bus,
    site: Site,
    word: str = "scene",
    payload: bytes | None = None,
    timeout_s: float = 2.0,
) -> wire.SceneInForce | None:
    """What the guard answers on ``{base}/WORD``; None if nobody does.

    Raises:
        ConnectionFailedError: it refuses, with its reason, or its answer cannot be read.
    """
    key = f"{site.keys.base}/{word}"
    answers = bus.ask(key, payload, timeout_s)
    if not answers:
        return None
    try:
        return wire.decode(answers[0], wire.SceneInForce)
    except MessageError as error:
        raise ConnectionFailedError(f"{key} answered what is no scene: {error}") from None


def fetch_scene(bus: Bus, site: Site, timeout_s: float) -> tuple[Scene, wire.SceneInForce]:
    """The scene in force, read in the place of the site's own, and what was told of it.

    Its hash differs from the one that was told if its meshes are others here.

    Raises:
        ConnectionFailedError: nobody answers, or with what cannot be read.
        SettingsError: the scene is wrong here: a mesh is missing, say.
    """
    told = ask_scene(bus, site, timeout_s=timeout_s)
    if told is None:
        raise ConnectionFailedError("nobody answers")
    return load_scene_text(told.scene or "", site, name="the guard's scene"), told
