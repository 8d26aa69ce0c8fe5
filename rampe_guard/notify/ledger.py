"""What one target still has to be told: bounded, the gravest first; pure, time passed in.

Of each matter only the newest notice is kept, so a slow target hears what is, not what was. A
matter that ended before anyone tried to tell it is forgotten; one that may have been heard of is
told to have ended, however long that takes. A raise is tried again only while it is current:
when protection is lost, what was last known of the machine's zones is not told any more.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rampe_guard.notify.choose import Notice

MAX_MATTERS = 256
"""Matters that may wait for one target, and as many that it was told of."""
_FIRST_RETRY_S = 0.5
_LAST_RETRY_S = 30.0
_BURST_S = 10.0
"""As many notices may go out at once as the rate allows in this time [s]."""


@dataclass(slots=True)
class _Matter:
    wanted: Notice | None = None
    told: Notice | None = None  # the last that may have been heard
    sure: bool = False  # that was heard
    since_s: float = 0.0
    due_s: float = 0.0
    failures: int = 0


class Ledger:
    """Notices of one target.

    Args:
        per_minute: how many it may get, in the long run [1/min].
    """

    def __init__(self, per_minute: float) -> None:
        self._rate_hz = per_minute / 60.0
        self._burst = max(1.0, self._rate_hz * _BURST_S)
        self._tokens, self._counted_s = self._burst, 0.0
        self._matters: dict[tuple[str, str], _Matter] = {}

    def offer(self, notice: Notice, now_s: float) -> list[Notice]:
        """Take a notice; returns those that nobody will be told."""
        untold: list[Notice] = []
        if notice.about_protection and not notice.over:
            untold += self._not_current(notice.base)
        matter = self._matters.get(notice.key)
        if notice.over:
            if matter is None:
                return untold
            if matter.told is None:  # nobody has heard of it, nor will
                del self._matters[notice.key]
                return untold + ([matter.wanted] if matter.wanted else [])
        elif matter is None:
            untold += self._make_room(notice)
            if notice in untold:
                return untold
            matter = self._matters.setdefault(notice.key, _Matter())
        if matter.wanted is None and matter.sure and notice.same(matter.told):
            return untold
        if matter.wanted is None or notice.level > matter.wanted.level or notice.over:
            matter.due_s, matter.failures = now_s, 0
        matter.wanted, matter.since_s = notice, now_s
        return untold

    def next(self, now_s: float) -> Notice | None:
        """The notice to try now; it counts as heard of from now on."""
        self._count(now_s)
        due = [m for m in self._matters.values() if m.wanted is not None and m.due_s <= now_s]
        if not due or self._tokens < 1.0:
            return None
        # what fails again and again must not stand in the way of the rest
        matter = min(due, key=lambda m: (m.failures > 0, -_rank(m), m.since_s))
        self._tokens -= 1.0
        matter.told, matter.sure = matter.wanted, False
        return matter.wanted

    def done(self, notice: Notice, now_s: float, *, heard: bool) -> None:
        """What came of a notice."""
        matter = self._matters.get(notice.key)
        if matter is None:
            return
        if not heard:
            matter.failures += 1
            wait_s = _FIRST_RETRY_S * 2.0 ** min(matter.failures - 1, 16)
            if matter.wanted is notice:  # else the newer one is tried at once
                matter.due_s = now_s + min(wait_s, _LAST_RETRY_S)
            return
        matter.failures, matter.sure = 0, matter.told is notice
        if matter.wanted is notice:
            matter.wanted = None
            if notice.over:
                del self._matters[notice.key]

    def wait_s(self, now_s: float) -> float | None:
        """Time until something may be tried [s]; None while nothing waits."""
        due = [m.due_s for m in self._matters.values() if m.wanted is not None]
        if not due:
            return None
        self._count(now_s)
        token_s = max(0.0, (1.0 - self._tokens) / self._rate_hz)
        return max(min(due) - now_s, token_s)

    @property
    def waiting(self) -> int:
        """How many notices wait."""
        return sum(m.wanted is not None for m in self._matters.values())

    def _count(self, now_s: float) -> None:
        self._tokens = min(self._burst, self._tokens + (now_s - self._counted_s) * self._rate_hz)
        self._counted_s = now_s

    def _not_current(self, base: str) -> list[Notice]:
        """Take back what waits of a machine's zones, but not that something is over."""
        untold = []
        for (whose, _), matter in list(self._matters.items()):
            wanted = matter.wanted
            if whose != base or wanted is None or wanted.over or wanted.about_protection:
                continue
            untold.append(wanted)
            matter.wanted = None
            if matter.told is None:
                del self._matters[wanted.key]
        return untold

    def _make_room(self, notice: Notice) -> list[Notice]:
        """Let the least of all matters go if there are too many: perhaps the new one."""
        self._forget_told()
        waiting = [m.wanted for m in self._matters.values() if m.wanted and m.told is None]
        if self.waiting < MAX_MATTERS:
            return []
        least = min([*waiting, notice], key=lambda n: n.level)  # of equals the oldest
        if least is not notice:
            del self._matters[least.key]
        return [least]

    def _forget_told(self) -> None:
        told = [key for key, m in self._matters.items() if m.wanted is None]
        for key in told[: max(0, len(told) - MAX_MATTERS + 1)]:
            del self._matters[key]


def _rank(matter: _Matter) -> int:
    """How urgent it is to tell: that a matter is over is as urgent as the matter was."""
    levels: Iterable[Notice | None] = (matter.wanted, matter.told)
    return max(int(notice.level) for notice in levels if notice is not None)
