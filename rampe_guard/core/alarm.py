"""Life cycle of one alert (names of ISA-18.2 / OPC UA), time passed in, one table.

A zone's evidence comes once per evaluation. It must hold for some evaluations in a row
before anyone is told (``pending``), and must be gone for ``off_delay_s`` before it is taken
back: quick to warn, slow to calm. Every rise of the level asks for attention anew. A
latched alarm whose cause is gone stays ``rtn_unacked`` until someone says he has seen it.

No transition is caused by missing data: the caller freezes the alarm instead.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum

from rampe_guard.core.config import AlertConfig


class Level(IntEnum):
    """How urgent an alert is; the order is the urgency."""

    CLEAR = 0
    CAUTION = 1
    WARNING = 2
    IMMINENT = 3

    @property
    def word(self) -> str:
        """Name on the wire."""
        return self.name.lower()


class State(StrEnum):
    """Alarm states."""

    NORMAL = "normal"
    PENDING = "pending"
    UNACKED = "unacked"
    ACKED = "acked"
    RTN_UNACKED = "rtn_unacked"


class Trigger(StrEnum):
    """What moves the state machine."""

    EVIDENCE = "evidence"  # seen, not yet often enough
    LOST = "lost"  # gone before it was often enough
    RAISE = "raise"  # a level is reached that was not shown before
    RETURN = "return"  # back to clear
    RETURN_LATCHED = "return_latched"
    ACK = "ack"


TABLE: dict[tuple[State, Trigger], State] = {
    (State.NORMAL, Trigger.EVIDENCE): State.PENDING,
    (State.NORMAL, Trigger.RAISE): State.UNACKED,
    (State.PENDING, Trigger.LOST): State.NORMAL,
    (State.PENDING, Trigger.RAISE): State.UNACKED,
    (State.UNACKED, Trigger.RAISE): State.UNACKED,
    (State.UNACKED, Trigger.ACK): State.ACKED,
    (State.UNACKED, Trigger.RETURN): State.NORMAL,
    (State.UNACKED, Trigger.RETURN_LATCHED): State.RTN_UNACKED,
    (State.ACKED, Trigger.RAISE): State.UNACKED,
    (State.ACKED, Trigger.RETURN): State.NORMAL,
    (State.ACKED, Trigger.RETURN_LATCHED): State.NORMAL,
    (State.RTN_UNACKED, Trigger.RAISE): State.UNACKED,
    (State.RTN_UNACKED, Trigger.ACK): State.NORMAL,
}
"""All transitions; a pair that is not here changes nothing."""

_NEVER = float("-inf")


class Alarm:
    """One alert through its life.

    Attributes:
        level: the level shown.
        previous: the level shown before the last change.
        state: life-cycle state.
        changed_s: when the level or state last changed [s].
        number: how many times it was raised.
        acked_by: who acknowledged it, or None.
        latched: a return to clear waits for an acknowledgement.
    """

    def __init__(self, config: AlertConfig, *, latched: bool = False) -> None:
        self._config = config
        self.latched = latched
        self._count = dict.fromkeys(Level, 0)
        self._seen_s = dict.fromkeys(Level, _NEVER)
        self.level = Level.CLEAR
        self.previous = Level.CLEAR
        self.state = State.NORMAL
        self.changed_s = _NEVER
        self.number = 0
        self.acked_by: str | None = None

    @property
    def active(self) -> bool:
        """Something is shown to people."""
        return self.state not in {State.NORMAL, State.PENDING}

    def step(self, evidence: Level, now_s: float) -> bool:
        """Take the evidence of one evaluation; True if level or state changed for people."""
        for level in (Level.CAUTION, Level.WARNING, Level.IMMINENT):
            if evidence >= level:
                self._count[level] += 1
                self._seen_s[level] = now_s
            else:
                self._count[level] = 0
        reached = max((lv for lv in Level if self._confirmed(lv)), default=Level.CLEAR)
        if reached > self.level:
            if not self.active:
                self.number += 1
            self.acked_by = None
            self._show(reached, Trigger.RAISE, now_s)
            return True
        if self.level is Level.CLEAR:
            self._fire(Trigger.EVIDENCE if evidence else Trigger.LOST)
            return False
        return self._calm(now_s)

    def acknowledge(self, who: str, now_s: float) -> bool:
        """Someone has seen it; False if there was nothing to acknowledge."""
        if (self.state, Trigger.ACK) not in TABLE:
            return False
        self._fire(Trigger.ACK)
        self.acked_by, self.changed_s = who, now_s
        return True

    def _confirmed(self, level: Level) -> bool:
        if level is Level.CLEAR:
            return True
        steps = self._config.debounce_steps
        if level is Level.IMMINENT:
            steps = self._config.imminent_steps
        return self._count[level] >= steps

    def _calm(self, now_s: float) -> bool:
        """Fall to the highest level whose cause was seen within the off-delay."""
        if now_s - self.changed_s < self._config.min_on_s:
            return False
        recent = [lv for lv in Level if now_s - self._seen_s[lv] < self._config.off_delay_s]
        lowered = max(recent, default=Level.CLEAR)
        if lowered >= self.level:
            return False
        if lowered is not Level.CLEAR:
            self._show(lowered, None, now_s)
        else:
            trigger = Trigger.RETURN_LATCHED if self.latched else Trigger.RETURN
            self._show(lowered, trigger, now_s)
        return True

    def _show(self, level: Level, trigger: Trigger | None, now_s: float) -> None:
        self.previous, self.level, self.changed_s = self.level, level, now_s
        if trigger is not None:
            self._fire(trigger)

    def _fire(self, trigger: Trigger) -> None:
        self.state = TABLE.get((self.state, trigger), self.state)
