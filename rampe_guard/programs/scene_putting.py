"""``rampe-guard scene``: the scene in force of a guard that works, and another one for it."""

from __future__ import annotations

import contextlib
import getpass
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rampe_guard import wire
from rampe_guard.client.order import unanswered
from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.scene_asked import ask_scene
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, load_scene_text, load_site
from rampe_guard.settings.source import read_bytes

_PUT_S = 330.0
"""A mesh that must be wrapped takes a while."""
_LOOK_S = 20.0
_AT_ONCE_S = 0.5


def show_scene(site_path: str, endpoints: Sequence[str]) -> int:
    """Print the text of the scene in force; on stderr, whose it is.

    Raises:
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    site = connect_to(load_site(site_path), endpoints)
    found = _asked(site, "scene", None, 2.0)
    sys.stderr.write(f"{_facts(found, site)}\n")
    sys.stdout.write(found.scene or "")
    return 0


def put_scene(site_path: str, endpoints: Sequence[str], file: str, who: str | None) -> int:
    """Have the guard sweep against the scene of a file from now on.

    Its meshes are named as seen from the site's own scene file, wherever ``file`` lies.

    Raises:
        SettingsError: the file is wrong.
        ConnectionFailedError: no router, no guard, or the guard refuses (with its reason).
    """
    site = connect_to(load_site(site_path), endpoints)
    content = read_bytes(file, "scene file")
    load_scene_text(content, site, name=file)  # what can be told here is told with its file
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SettingsError(f"{file}: not UTF-8: {error}") from None
    wish = wire.ScenePut(scene=text, who=who or getpass.getuser())
    began_s = time.monotonic()
    try:
        found = _asked(site, "scene/put", wire.encode(wish), _PUT_S)
    except UnansweredError:
        if time.monotonic() - began_s < _AT_ONCE_S:  # there was nobody to ask
            raise
        found = _in_force(site, wish)
    for note in found.notes:
        sys.stderr.write(f"{note}\n")
    sys.stdout.write(f"{_facts(found, site)}\n")
    return 0


class UnansweredError(ConnectionFailedError):
    """Nobody answered; whether it was done is not known."""


def _in_force(site: Site, wish: wire.ScenePut) -> wire.SceneInForce:
    """Look whether a scene is in force though the answer to its put was lost on the way.

    Raises:
        UnansweredError: it is not, or that cannot be seen.
    """
    key = f"{site.keys.base}/scene/put"
    sys.stderr.write("the answer did not come; looking whether the scene is in force\n")
    until_s = time.monotonic() + _LOOK_S
    while time.monotonic() < until_s:
        with contextlib.suppress(ConnectionFailedError):
            found = _asked(site, "scene", None, 2.0)
            if (found.scene, found.put_by) == (wish.scene, wish.who):
                return found
        time.sleep(1.0)
    raise UnansweredError(f"{unanswered(key)}; `rampe-guard scene show` tells") from None


def _asked(site: Site, word: str, payload: bytes | None, timeout_s: float) -> wire.SceneInForce:
    with Bus.open(site.zenoh) as bus:
        found = ask_scene(bus, site, word, payload, timeout_s)
    if found is None:
        raise UnansweredError(unanswered(f"{site.keys.base}/{word}"))
    return found


def _facts(found: wire.SceneInForce, site: Site) -> str:
    if found.put_by is None or found.put_unix_s is None:
        whose = f"its own, {Path(site.scene.path).name}"
    else:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(found.put_unix_s))
        whose = f"put by {found.put_by} at {when}"
        whose += ", kept" if found.kept else ", NOT kept: a guard that starts anew has its own"
    zones = f"{len(found.zones)} zones"
    return f"{found.machine} at {found.site}: {zones}, {found.scene_hash[:12]}, {whose}"
