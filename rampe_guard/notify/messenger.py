"""A thread for one target: a slow or dead one keeps nobody else waiting."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from rampe_guard.notify.choose import Notice
from rampe_guard.notify.ledger import Ledger
from rampe_guard.notify.target import NotHeardError, Target


class Messenger:
    """Carries notices to one target until it is stopped.

    Args:
        target: where to.
        per_minute: how many it may get, in the long run [1/min].
        say: tells people of what was not told.
    """

    def __init__(self, target: Target, per_minute: float, say: Callable[[str, str], None]) -> None:
        self._target, self._say = target, say
        self._ledger = Ledger(per_minute)
        self._news = threading.Condition()
        self._stopped = False
        self._thread = threading.Thread(target=self._work, name=target.name, daemon=True)
        self._thread.start()

    def offer(self, notice: Notice) -> None:
        """Have it told; never waits."""
        with self._news:
            untold = self._ledger.offer(notice, time.monotonic())
            self._news.notify()
        for missed in untold:
            self._say(
                f"{self._target.name} untold",
                f"{self._target.name}: not told, no longer current: {missed.text}",
            )

    def stop(self, within_s: float = 1.0) -> None:
        """End; breaks off what is under way."""
        with self._news:
            self._stopped = True
            self._news.notify()
        self._target.stop()
        self._thread.join(within_s)

    def _work(self) -> None:
        while (notice := self._next()) is not None:
            heard = self._tell(notice)
            with self._news:
                self._ledger.done(notice, time.monotonic(), heard=heard)

    def _next(self) -> Notice | None:
        with self._news:
            while not self._stopped:
                now_s = time.monotonic()
                notice = self._ledger.next(now_s)
                if notice is not None:
                    return notice
                self._news.wait(self._ledger.wait_s(now_s))
        return None

    def _tell(self, notice: Notice) -> bool:
        try:
            self._target.tell(notice)
        except NotHeardError as error:
            if not self._stopped:
                self._say(f"{self._target.name} failed", f"{error}; not told yet: {notice.text}")
            return False
        except Exception as error:  # noqa: BLE001 - a fault of ours must not silence a target
            self._say(f"{self._target.name} failed", f"{self._target.name}: {error!r}")
            return False
        return True
