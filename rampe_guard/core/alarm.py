"""Life cycle of one alert (names of ISA-18.2 and OPC UA), time passed in, one table.

**Quick to warn, slow to calm.** A zone's evidence comes once per evaluation. A level is shown
once it was seen in ``debounce_steps`` evaluations in a row (``imminent_steps`` for imminent);
until then the alarm is ``pending``, and nobody is told. It is taken back once its cause was
gone for ``release_steps`` evaluations in a row *and* for ``off_delay_s``, and never sooner than
``min_on_s`` after it was shown. What holds a level is looser than what raises it as well: the
deadbands of `core.levels`.

**Attention.** Every rise of the level asks for attention anew (``unacked``), and so does an
alert that has gone on for ``realarm_s`` since it asked last, seen or not. A latched alarm whose
cause is gone stays ``rtn_unacked`` until someone says that he has seen it.

**Inhibition** is a second region of the same chart, as in OPC UA: it says why nobody is to be
troubled, and changes nothing of what is known. *Shelving* silences an alert for a time that the
caller gives and ``shelve_max_s`` caps; it cannot be prolonged while it lasts. It never covers
``imminent``: what is imminent is not shelved, and every rise of the level ends the shelving. So
does the end of the alert. *Machine off* is suppression by design: an alert that is shown
returns, as if its cause were gone, and nothing is raised until the machine is on again.

**Missing data** is no trigger: the caller freezes the alarm instead, by not stepping it. Only
the end of a shelving, which makes noise and no calm, comes all the same.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import TypeAlias, TypeVar, cast

from rampe_guard.core.config import AlertConfig
from rampe_guard.errors import RefusedError


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
    """Alarm states: whether it is shown, and whether it was seen."""

    NORMAL = "normal"
    PENDING = "pending"
    UNACKED = "unacked"
    ACKED = "acked"
    RTN_UNACKED = "rtn_unacked"


class Inhibit(StrEnum):
    """Why nobody is to be troubled."""

    NONE = "none"
    SHELVED = "shelved"
    MACHINE_OFF = "machine_off"


class Trigger(StrEnum):
    """What moves the state machine; each is offered to both regions."""

    EVIDENCE = "evidence"  # seen, not yet often enough
    LOST = "lost"  # gone before it was often enough
    RAISE = "raise"  # a level is reached that was not shown before
    REALARM = "realarm"  # it has gone on for long
    RETURN = "return"  # back to clear
    RETURN_LATCHED = "return_latched"
    ACK = "ack"
    SHELVE = "shelve"
    UNSHELVE = "unshelve"  # by time, or by someone
    SWITCH_OFF = "switch_off"  # followed by a return, if it is shown
    SWITCH_ON = "switch_on"


Mode: TypeAlias = State | Inhibit

TABLE: dict[tuple[Mode, Trigger], Mode] = {
    (State.NORMAL, Trigger.EVIDENCE): State.PENDING,
    (State.NORMAL, Trigger.RAISE): State.UNACKED,
    (State.PENDING, Trigger.LOST): State.NORMAL,
    (State.PENDING, Trigger.RAISE): State.UNACKED,
    (State.UNACKED, Trigger.RAISE): State.UNACKED,
    (State.UNACKED, Trigger.REALARM): State.UNACKED,
    (State.UNACKED, Trigger.ACK): State.ACKED,
    (State.UNACKED, Trigger.RETURN): State.NORMAL,
    (State.UNACKED, Trigger.RETURN_LATCHED): State.RTN_UNACKED,
    (State.ACKED, Trigger.RAISE): State.UNACKED,
    (State.ACKED, Trigger.REALARM): State.UNACKED,
    (State.ACKED, Trigger.RETURN): State.NORMAL,
    (State.ACKED, Trigger.RETURN_LATCHED): State.NORMAL,
    (State.RTN_UNACKED, Trigger.RAISE): State.UNACKED,
    (State.RTN_UNACKED, Trigger.ACK): State.NORMAL,
    # the other region
    (Inhibit.NONE, Trigger.SHELVE): Inhibit.SHELVED,
    (Inhibit.NONE, Trigger.SWITCH_OFF): Inhibit.MACHINE_OFF,
    (Inhibit.SHELVED, Trigger.SHELVE): Inhibit.SHELVED,
    (Inhibit.SHELVED, Trigger.UNSHELVE): Inhibit.NONE,
    (Inhibit.SHELVED, Trigger.RAISE): Inhibit.NONE,
    (Inhibit.SHELVED, Trigger.RETURN): Inhibit.NONE,
    (Inhibit.SHELVED, Trigger.RETURN_LATCHED): Inhibit.NONE,
    (Inhibit.SHELVED, Trigger.SWITCH_OFF): Inhibit.MACHINE_OFF,
    (Inhibit.MACHINE_OFF, Trigger.SWITCH_ON): Inhibit.NONE,
}
"""All transitions; a pair that is not here changes nothing."""

_NEVER = float("-inf")
_M = TypeVar("_M", State, Inhibit)


def urgency(level: Level, time_to_collision_s: float | None) -> tuple[int, float]:
    """Sort key: the gravest level first, then the least time [s]; without a time last."""
    return -level, float("inf") if time_to_collision_s is None else time_to_collision_s


class Alarm:
    """One alert through its life.

    Attributes:
        level: the level shown.
        previous: the level shown before the last change.
        state: life-cycle state.
        inhibit: why nobody is to be troubled.
        number: how many times it was raised.
        acked_by: who acknowledged it, or None.
        shelved_by: who shelved it, None unless it is shelved.
        shelved_until_s: when that ends, on the caller's clock of requests [s].
        latched: a return to clear waits for an acknowledgement.
    """

    def __init__(self, config: AlertConfig, *, latched: bool = False) -> None:
        self._config = config
        self.latched = latched
        self._count = dict.fromkeys(Level, 0)
        self._absent = dict.fromkeys(Level, 0)
        self._seen_s = dict.fromkeys(Level, _NEVER)
        self._shown_s = _NEVER
        self._asked_s = _NEVER
        self.level = Level.CLEAR
        self.previous = Level.CLEAR
        self.state = State.NORMAL
        self.inhibit = Inhibit.NONE
        self.number = 0
        self.acked_by: str | None = None
        self.shelved_by: str | None = None
        self.shelved_until_s: float | None = None

    @property
    def active(self) -> bool:
        """Something is shown to people."""
        return self.state not in {State.NORMAL, State.PENDING}

    def step(self, evidence: Level, now_s: float) -> bool:
        """Take the evidence of one evaluation; True if people are to be told of a change."""
        for level in (Level.CAUTION, Level.WARNING, Level.IMMINENT):
            if evidence >= level:
                self._count[level] += 1
                self._absent[level] = 0
                self._seen_s[level] = now_s
            else:
                self._count[level] = 0
                self._absent[level] += 1
        reached = max((lv for lv in Level if self._confirmed(lv)), default=Level.CLEAR)
        if reached > self.level:
            if not self.active:
                self.number += 1
            self._show(reached, now_s)
            self._ask(Trigger.RAISE, now_s)
            return True
        if self.level is Level.CLEAR:
            self._fire(Trigger.EVIDENCE if evidence else Trigger.LOST)
            return False
        return self._calm(now_s) or (evidence > Level.CLEAR and self._again(now_s))

    def acknowledge(self, who: str) -> bool:
        """Someone has seen it; False if there was nothing to acknowledge."""
        if (self.state, Trigger.ACK) not in TABLE:
            return False
        self._fire(Trigger.ACK)
        self.acked_by = who
        return True

    def shelve(self, who: str, duration_s: float, now_s: float) -> None:
        """Silence it until ``now_s + duration_s``, on the caller's clock of requests.

        Raises:
            RefusedError: it is not shown, imminent, or silent for too long then.
        """
        cap_s = self._config.shelve_max_s
        if not 0.0 < duration_s <= cap_s:
            raise RefusedError(
                f"{duration_s:g} s is not above 0 and at most {cap_s:g} s, which is as long as an"
                " alert may be silent here (alerts.shelve_max_s)"
            )
        if self.level is Level.IMMINENT:
            raise RefusedError("it is imminent, and what is imminent is never shelved")
        if self.level is Level.CLEAR:
            raise RefusedError("its cause is gone: acknowledge it")
        until_s = now_s + duration_s
        if self.shelved_until_s is not None and until_s > self.shelved_until_s:
            rest_s = self.shelved_until_s - now_s
            raise RefusedError(
                f"{self.shelved_by} has shelved it for {rest_s:.1f} s more: it can be shelved"
                " again when it has asked again"
            )
        self._fire(Trigger.SHELVE)
        self.shelved_by, self.shelved_until_s = who, until_s

    def unshelve(self) -> bool:
        """End its silence; False if it was not shelved."""
        shelved = self.inhibit is Inhibit.SHELVED
        self._fire(Trigger.UNSHELVE)
        return shelved

    def lapse(self, now_s: float) -> bool:
        """End its silence if the time is up; True if people are to be told."""
        over = self.shelved_until_s is not None and now_s >= self.shelved_until_s
        return over and self.unshelve()

    def switch_off(self, now_s: float) -> bool:
        """The machine is off: it returns; True if people are to be told."""
        told = self.active and self.inhibit is not Inhibit.MACHINE_OFF
        self._fire(Trigger.SWITCH_OFF)
        self._count = dict.fromkeys(Level, 0)
        if self.level is Level.CLEAR:
            self._fire(Trigger.LOST)
        else:
            self._return(now_s)
        return told

    def switch_on(self) -> None:
        """The machine is on again."""
        self._fire(Trigger.SWITCH_ON)

    def _confirmed(self, level: Level) -> bool:
        if level is Level.CLEAR:
            return True
        steps = self._config.debounce_steps
        if level is Level.IMMINENT:
            steps = self._config.imminent_steps
        return self._count[level] >= steps

    def _calm(self, now_s: float) -> bool:
        """Fall to the highest level whose cause is not gone for good."""
        if now_s - self._shown_s < self._config.min_on_s:
            return False
        lowered = max((lv for lv in Level if self._lingers(lv, now_s)), default=Level.CLEAR)
        if lowered >= self.level:
            return False
        if lowered is Level.CLEAR:
            self._return(now_s)
        else:
            self._show(lowered, now_s)
        return True

    def _lingers(self, level: Level, now_s: float) -> bool:
        if now_s - self._seen_s[level] < self._config.off_delay_s:
            return True
        return level <= self.level and self._absent[level] < self._config.release_steps

    def _again(self, now_s: float) -> bool:
        """Ask again after a long time; not while shelved, since that ends with asking."""
        due = now_s - self._asked_s >= self._config.realarm_s
        if not due or self.inhibit is not Inhibit.NONE:
            return False
        self._ask(Trigger.REALARM, now_s)
        return True

    def _ask(self, trigger: Trigger, now_s: float) -> None:
        self.acked_by, self._asked_s = None, now_s
        self._fire(trigger)

    def _return(self, now_s: float) -> None:
        self._show(Level.CLEAR, now_s)
        self._fire(Trigger.RETURN_LATCHED if self.latched else Trigger.RETURN)

    def _show(self, level: Level, now_s: float) -> None:
        self.previous, self.level, self._shown_s = self.level, level, now_s

    def _fire(self, trigger: Trigger) -> None:
        self.state = _next(self.state, trigger)
        self.inhibit = _next(self.inhibit, trigger)
        if self.inhibit is not Inhibit.SHELVED:
            self.shelved_by = self.shelved_until_s = None


def _next(mode: _M, trigger: Trigger) -> _M:
    return cast("_M", TABLE.get((mode, trigger), mode))
