"""When advice is given, and what is said while none can be given."""

from __future__ import annotations

from rampe_guard.core.advice import Advice, Adviser, Instant
from rampe_guard.core.config import GuardConfig
from rampe_guard.core.events import AdviceEvent
from rampe_guard.core.monitor import Health, Status
from rampe_guard.core.types import FloatArray, PathSweeper

_HAIR_S = 1e-6
"""So that a period survives the rounding of ticks [s]."""
_BLIND_S = 0.2
"""From one word that there is no advice to the next [s]."""


class Advising:
    """Advice at its pace; nothing at all where the site wants none.

    Args:
        config: settings.
        limits: (n, 2) [unit].
        sweeper: geometry.
    """

    def __init__(self, config: GuardConfig, limits: FloatArray, sweeper: PathSweeper) -> None:
        self._config = config.advice
        self._adviser = Adviser(config.actuators, limits, config.advice, sweeper)
        self._given_s, self._blind_s = float("-inf"), float("-inf")
        self._seq = 0

    def change_scene(self, sweeper: PathSweeper) -> None:
        """Advise by another geometry from now on."""
        self._adviser.change_scene(sweeper)

    def sighted(self, moment: Instant, stamp_s: float, health: Health) -> list[AdviceEvent]:
        """Advice for the present state, if it is time for it."""
        due_s = self._given_s + self._config.period_s - _HAIR_S
        if not self._config.enabled or moment.now_s < due_s:
            return []
        self._given_s, self._blind_s = moment.now_s, float("-inf")
        advice = self._adviser.advise(moment)
        return [self._event(advice, health, stamp_s, moment.now_s)]

    def blind(self, health: Health, stamp_s: float | None, now_s: float) -> list[AdviceEvent]:
        """There is none: told at once, and again and again."""
        if not self._config.enabled or now_s < self._blind_s + _BLIND_S - _HAIR_S:
            return []
        self._given_s, self._blind_s = float("-inf"), now_s
        self._adviser.forget()
        return [self._event(None, health, stamp_s, now_s)]

    def _event(
        self, advice: Advice | None, health: Health, stamp_s: float | None, now_s: float
    ) -> AdviceEvent:
        self._seq += 1
        why = None if advice is not None else "; ".join(r.text for r in health.reasons)
        degraded = health.status is not Status.OK
        return AdviceEvent(self._seq, advice, why, degraded, stamp_s, now_s)
