"""Who sits where: an alert keeps its place for as long as it lives."""

from __future__ import annotations

from collections.abc import Sequence


class Places:
    """A few places for alerts.

    Args:
        count: how many.
    """

    def __init__(self, count: int) -> None:
        self._seated: list[str | None] = [None] * count

    def seat(self, wanted: Sequence[str]) -> tuple[str | None, ...]:
        """Who sits where now.

        Args:
            wanted: ids of all alerts, the gravest first. One that lives keeps its place, unless
                the gravest has none: that one takes the place of the least grave.
        """
        seated = self._seated
        for place, alert_id in enumerate(seated):
            if alert_id not in wanted:
                seated[place] = None
        for alert_id in wanted:
            if alert_id in seated:
                continue
            if None in seated:
                seated[seated.index(None)] = alert_id
            elif alert_id == wanted[0]:
                least = max(seated, key=lambda one: wanted.index(one or ""))
                seated[seated.index(least)] = alert_id
        return tuple(seated)
