"""``{base}/scene`` and ``{base}/scene/put``: shows the scene in force, and replaces it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from rampe_guard import wire
from rampe_guard.collision import FclSweeper
from rampe_guard.errors import MessageError, RampeGuardError, RefusedError
from rampe_guard.runtime.audit import Audit
from rampe_guard.runtime.scene_builder import Built, SceneBuilder
from rampe_guard.runtime.scene_kept import SceneKeeper, SceneSource
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.runtime.zenoh_queries import Request
from rampe_guard.settings import Site

COMMAND: Final = "scene/put"


@dataclass(frozen=True, slots=True)
class Scenes:
    """The scene in force when a guard starts, and who keeps another one."""

    source: SceneSource
    keeper: SceneKeeper


class SceneDesk:
    """Answers both keys; the worker calls `answer` at every turn.

    Args:
        bus: an open session.
        site: whose scene it is.
        scenes: the scene in force, and who keeps what is put.
        sweeper: built from it.
        audit: told of every wish to replace it.
        put: has the guard change to a scene that is built.
    """

    def __init__(
        self,
        bus: Bus,
        site: Site,
        scenes: Scenes,
        sweeper: FclSweeper,
        audit: Audit,
        put: Callable[[Built], None],
    ) -> None:
        base = site.keys.base
        self._reads = bus.desk(f"{base}/scene")
        self._puts = bus.desk(f"{base}/{COMMAND}")
        self._site, self._keeper, self._audit, self._put = site, scenes.keeper, audit, put
        self._builder = SceneBuilder(site, scenes.keeper)
        self._waiting: tuple[Request, str] | None = None
        self._in_force = Built(scenes.source, sweeper, kept=True)

    def reasons(self) -> tuple[wire.Reason, ...]:
        """Why the scene is not the one that somebody wanted, for the heartbeat."""
        problem = self._keeper.problem
        if problem is None:
            return ()
        return (wire.Reason(code=self._keeper.code, text=problem, key=None),)

    def answer(self, now_s: float) -> None:
        """Answer what waits, and take a scene that is ready."""
        for request in self._reads.drain():
            if request.payload:
                request.refuse(f"a scene is replaced on {self._site.keys.base}/{COMMAND}")
            else:
                request.reply(wire.encode(self._message(with_text=True)))
        for request in self._puts.drain():
            self._take(request, now_s)
        if self._builder.busy and (result := self._builder.take()) is not None:
            self._finish(result, now_s)

    def _take(self, request: Request, now_s: float) -> None:
        who = None
        try:
            request.check_exact()
            wish = wire.decode(request.payload or b"", wire.ScenePut, limit=wire.MAX_SCENE_BYTES)
            who = wish.who
            self._builder.check_free()
        except (MessageError, RefusedError) as error:
            self._audit.refuse(COMMAND, who, str(error), now_s)
            request.refuse(str(error))
            return
        self._waiting = request, wish.who
        self._builder.begin(wish.scene, wish.who, time.time(), self._in_force.sweeper)

    def _finish(self, result: Built | RampeGuardError, now_s: float) -> None:
        if self._waiting is None:
            raise RuntimeError("nobody has put what was built")
        (request, who), self._waiting = self._waiting, None
        if not isinstance(result, Built):
            self._audit.refuse(COMMAND, who, str(result), now_s)
            request.refuse(str(result))
            return
        self._in_force = result
        self._put(result)
        scene = result.source.scene
        what = f"{len(scene.objects)} objects, {scene.content_hash[:12]}"
        self._audit.grant(COMMAND, who, what if result.kept else f"{what}, not kept")
        request.reply(wire.encode(self._message(with_text=False)))

    def _message(self, *, with_text: bool) -> wire.SceneInForce:
        now = self._in_force
        return wire.SceneInForce(
            site=self._site.name,
            machine=self._site.machine,
            scene_hash=now.source.scene.content_hash,
            scene=now.source.scene.text if with_text else None,
            zones=now.sweeper.zones,
            put_by=now.source.put_by,
            put_unix_s=now.source.put_unix_s,
            kept=now.kept,
            notes=now.sweeper.notes,
        )
