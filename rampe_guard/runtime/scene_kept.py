"""The scene that was put over the network, kept so that a guard that starts anew has it too.

It holds for as long as the site's own scene file stays as it was when it was put: who edits that
file and starts the guard again means the file. A kept scene that cannot be used any more is told
in every heartbeat, since the scene that then holds is not the one that somebody wanted.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from rampe_guard.core.scene import Scene
from rampe_guard.errors import ModelFileError, RampeGuardError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_folder
from rampe_guard.settings import Site, load_scene_text
from rampe_guard.wire import MAX_SCENE_BYTES

_NAME: Final = "scene.kept.json"
_FORMAT: Final = "rampe.scene_kept.v1"
NOT_KEPT: Final = "scene_not_kept"
"""The scene that was put holds, and would be lost with the guard's process."""
UNUSABLE: Final = "scene_put_unusable"
"""The scene that was put does not hold any more."""


@dataclass(frozen=True, slots=True)
class SceneSource:
    """A scene, and where it came from.

    Attributes:
        scene: as the sweeper is built from it.
        put_by: who put it; None if it is the site's own file.
        put_unix_s: when [s].
    """

    scene: Scene
    put_by: str | None = None
    put_unix_s: float | None = None


class _Kept(msgspec.Struct, frozen=True, kw_only=True):
    format: str
    instead_of: str
    text: str
    who: str
    unix_s: float


class SceneKeeper:
    """Keeps one machine's scene beside its models.

    Args:
        site: with its own scene.
        say: log.

    Attributes:
        problem: why the scene in force is not the one that was put last, or will not be after a
            restart; None if all is well.
        code: which of both.
        lost: in few words, that the scene that was put does not hold; None if it does.
    """

    def __init__(self, site: Site, say: Sayer) -> None:
        self._site, self._say = site, say
        self.problem: str | None = None
        self.code = NOT_KEPT
        self.lost: str | None = None

    def recall(self) -> SceneSource:
        """The scene that holds when a guard starts."""
        own = SceneSource(self._site.scene)
        if not self._site.memory.enabled:
            return own
        who = "somebody"
        try:
            content = self._file().read()
            if content is None:
                return own
            kept = _decode(content)
            who = kept.who
            if kept.instead_of != self._site.scene.content_hash:
                self._say.info(f"the scene that {who} put gives way to a newer scene file")
                return own
            scene = load_scene_text(kept.text, self._site)
        except RampeGuardError as error:
            return self.give_up(who, error)
        self._say.info(f"the scene is the one that {who} put", put_by=who)
        return SceneSource(scene, who, kept.unix_s)

    def give_up(self, who: str, error: RampeGuardError) -> SceneSource:
        """The site's own scene instead of one that cannot be used any more.

        What was kept stays where it is: a mesh that went may come back.
        """
        self.code, self.lost = UNUSABLE, "the scene put last is lost"
        self.problem = (
            f"{self._place()}: the scene that {who} put cannot be used, the site's own holds:"
            f" {error}; put it again, or the site's own"
        )
        self._say.warn("scene", self.problem, code=UNUSABLE)
        return SceneSource(self._site.scene)

    def keep(self, found: SceneSource) -> bool:
        """Keep a scene that was put; whether that could be done (else `problem` tells why not)."""
        if not self._site.memory.enabled:
            self.problem = None
            return False
        kept = _Kept(
            format=_FORMAT,
            instead_of=self._site.scene.content_hash,
            text=found.scene.text,
            who=found.put_by or "",
            unix_s=found.put_unix_s or 0.0,
        )
        try:
            with self._file() as file:
                file.write(msgspec.json.encode(kept))
        except ModelFileError as error:
            self.code = NOT_KEPT
            self.problem = f"the scene that was put is lost when the guard starts anew: {error}"
            self._say.warn("scene", self.problem, code=NOT_KEPT)
            return False
        self.problem = None
        return True

    def _file(self) -> ModelFile:
        return ModelFile(self._place(), MAX_SCENE_BYTES)

    def _place(self) -> Path:
        return model_folder(self._site) / _NAME


def _decode(content: bytes) -> _Kept:
    try:
        kept = msgspec.json.decode(content, type=_Kept)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise ModelFileError(f"its file is damaged: {error}") from None
    if kept.format != _FORMAT:
        raise ModelFileError(f"its file is {kept.format!r}, need {_FORMAT!r}")
    return kept
