"""What people want of a guard: ``{base}/ack``, ``{base}/shelve`` and ``{base}/forget``.

A wish that is granted is answered with what came of it, any other with the reason why not. Both
are written down with the name that the sender gave.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from rampe_guard import wire
from rampe_guard.core.events import AlertEvent
from rampe_guard.core.guard import Guard
from rampe_guard.errors import MessageError, RefusedError
from rampe_guard.runtime.audit import Audit
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.runtime.zenoh_queries import Request
from rampe_guard.settings import Site

W = TypeVar("W", wire.Ack, wire.Shelve, wire.Forget)


class Orders:
    """Grants or refuses; the worker calls `answer` at every turn.

    Args:
        bus: an open session.
        site: with its operator.
        guard: of whom it is wanted.
        audit: told of every wish.
        publish: publishes an alert, and returns it as it was published.
        forgotten: called when the guard has forgotten.
    """

    def __init__(
        self,
        bus: Bus,
        site: Site,
        guard: Guard,
        audit: Audit,
        publish: Callable[[AlertEvent], bytes],
        forgotten: Callable[[], None],
    ) -> None:
        base = site.keys.base
        self._desks = {word: bus.desk(f"{base}/{word}") for word in ("ack", "shelve", "forget")}
        self._site, self._guard, self._audit = site, guard, audit
        self._publish, self._forgotten = publish, forgotten

    def answer(self, now_s: float) -> None:
        """Answer what waits."""
        for request in self._desks["ack"].drain():
            self._grant(
                "ack", request, wire.Ack, lambda wish: self._acknowledge(wish, now_s), now_s
            )
        for request in self._desks["shelve"].drain():
            self._grant(
                "shelve", request, wire.Shelve, lambda wish: self._shelve(wish, now_s), now_s
            )
        for request in self._desks["forget"].drain():
            self._grant("forget", request, wire.Forget, self._forget, now_s)

    def _grant(
        self,
        command: str,
        request: Request,
        kind: type[W],
        do: Callable[[W], tuple[str, tuple[bytes, ...]]],
        now_s: float,
    ) -> None:
        who = None
        try:
            request.check_exact()
            wish = wire.decode(request.payload or b"", kind, limit=wire.MAX_PAYLOAD_BYTES)
            who = wish.who
            what, answers = do(wish)
        except (MessageError, RefusedError) as error:
            self._audit.refuse(command, who, str(error), now_s)
            request.refuse(str(error))
            return
        self._audit.grant(command, who, what)
        for answer in answers:
            request.reply(answer)

    def _acknowledge(self, wish: wire.Ack, now_s: float) -> tuple[str, tuple[bytes, ...]]:
        events = self._guard.acknowledge(wish.alert_id, wish.who, now_s)
        if not events:
            raise RefusedError(f"no alert {wish.alert_id!r} waits for an acknowledgement")
        return wish.alert_id, tuple(self._publish(event) for event in events)

    def _shelve(self, wish: wire.Shelve, now_s: float) -> tuple[str, tuple[bytes, ...]]:
        events = self._guard.shelve(wish.alert_id, wish.who, wish.duration_s, now_s)
        how = f"for {wish.duration_s:g} s" if wish.duration_s else "no longer"
        return f"{wish.alert_id} {how}", tuple(self._publish(event) for event in events)

    def _forget(self, wish: wire.Forget) -> tuple[str, tuple[bytes, ...]]:
        operator = self._site.operator
        if wish.operator != operator:
            raise RefusedError(f"{wish.operator!r} is not at the levers, but {operator!r}")
        known = wire.Forgotten(
            site=self._site.name,
            machine=self._site.machine,
            operator=operator,
            primitives=sum(self._guard.rampe.categories.values()),
            situations=self._guard.situations.count,
        )
        self._guard.forget()
        self._forgotten()
        what = f"{known.primitives} primitives, {known.situations} situations of {operator!r}"
        return what, (wire.encode(known),)
