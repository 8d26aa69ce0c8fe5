"""Can the guard see? Ages, refusals and silence of both inputs, and what follows from them.

``ok``              both inputs are fresh and plausible
``degraded``        monitoring, but something is not as it should be (with reasons)
``not_monitoring``  an input is missing or too old, or the machine computes what is not so:
                    nothing that is shown can be trusted; or the machine is switched off, and
                    there is nothing to guard
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from rampe_guard.core.config import InputConfig
from rampe_guard.core.screening import FAULTS
from rampe_guard.core.types import ActuatorSample, InputName, JoystickSample

RECENT_S = 5.0
"""How long a refusal or an unknown sweep keeps the status degraded [s]."""
_PLAUSIBLE_WINDOW_S = 10.0
_IMPLAUSIBLE_SHARE = 0.1
"""More refused samples than this share is not a glitch: wrong columns, scale or sensor."""
OVERLOAD: Final = "overload"
"""Refusal of a message that came faster than messages can be looked at."""
_FLOW_S = 1.0
_REFUSED_RUN, _REFUSED_S = 3, 0.2
"""So many refused in a row, and none good for so long [s], is not waited out like silence is: who
speaks and says nothing that can be used has more than a gap."""
_FAULTY_RUN = 3
"""Refused primitives in a row that are no chance."""
_ENOUGH_SAMPLES = 20


class Status(StrEnum):
    """Whether the guard protects."""

    OK = "ok"
    DEGRADED = "degraded"
    NOT_MONITORING = "not_monitoring"


@dataclass(frozen=True, slots=True)
class Reason:
    """Why the status is not ok: a code, the input it concerns (if one), words with values.

    ``key`` is the key of the object that it concerns, if it is one.
    """

    code: str
    input: InputName | None
    text: str
    key: str | None = None


@dataclass(frozen=True, slots=True)
class ObjectHealth:
    """The poses of one object that moves.

    Attributes:
        name: of its zone.
        key: of its poses.
        age_s: of the newest accepted pose [s], None before it.
        grown_m: how far it may have moved since [m], None where nobody knows where it is.
        accepted: poses accepted.
        rejected: messages refused, by reason.
    """

    name: str
    key: str
    age_s: float | None
    grown_m: float | None
    accepted: int
    rejected: dict[str, int]


@dataclass(frozen=True, slots=True)
class Health:
    """Status with its reasons, and the age of the newest good sample of each input [s].

    The age counts from its arrival, and to that how late it came: how far its stamp lagged behind
    the other input's, or behind its own sender's clock.

    ``starting``: not monitoring only because the first samples may still be on their way.
    ``off``: not monitoring only because the machine is switched off.
    """

    status: Status
    reasons: tuple[Reason, ...]
    ages_s: dict[InputName, float | None]
    accepted: dict[InputName, int]
    rejected: dict[tuple[InputName, str], int]
    starting: bool = False
    off: bool = False
    objects: tuple[ObjectHealth, ...] = ()


class _Flow:
    """How many messages a second were lost, over the last second or so."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._count = 0
        self._rate_hz: float | None = None

    def lost(self, now_s: float) -> None:
        if self._since_s is None or now_s - self._since_s > RECENT_S:
            self._since_s, self._count, self._rate_hz = now_s, 0, None
        self._count += 1
        if (passed_s := now_s - self._since_s) >= _FLOW_S:
            self._rate_hz = self._count / passed_s
            self._since_s, self._count = now_s, 0

    def words(self) -> str:
        if self._rate_hz is None:  # less than a second of it
            return f"{self._count} messages"
        return f"{self._rate_hz:.0f} messages/s"


class InputMonitor:
    """Keeps the books of both inputs; time is passed in.

    Args:
        config: time-outs.
        start_s: when monitoring began; silence is counted from here until the first sample.
    """

    def __init__(self, config: InputConfig, start_s: float) -> None:
        self._config = config
        self._start_s = start_s
        self._last_s: dict[InputName, float | None] = {"joystick": None, "actuators": None}
        self._stamps: dict[InputName, tuple[float, float]] = {}
        self._lag_s: dict[InputName, float] = {}
        self._late_s: dict[InputName, float] = {}
        self._accepted: Counter[InputName] = Counter()
        self._rejected: Counter[tuple[InputName, str]] = Counter()
        self._recent: dict[tuple[InputName, str], float] = {}
        self._in_a_row: Counter[InputName] = Counter()
        self._window: deque[tuple[float, bool]] = deque()
        self._bad = 0
        self._unknown_s: float | None = None
        self._joystick_alive: bool | None = None
        self._flows: dict[InputName, _Flow] = {}
        self._faulty: list[str] = []
        self._distrust: str | None = None

    def accept(
        self,
        name: InputName,
        arrival_s: float,
        stamp_s: float | None = None,
        late_s: float = 0.0,
    ) -> None:
        """A good sample arrived; its own stamp, if it had one, tells how late.

        Args:
            name: of what.
            arrival_s: when it came [s].
            stamp_s: its own stamp, if it had one [s].
            late_s: how long it was under way, by its own sender's clock [s].
        """
        self._accepted[name] += 1
        self._in_a_row[name] = 0
        if name == "enabled":  # which says nothing of where the machine is
            return
        self._last_s[name] = arrival_s
        self._note(arrival_s, good=True)
        self._lag_s[name], self._late_s[name] = 0.0, late_s
        self._stamps.pop(name, None)
        if stamp_s is not None:
            self._stamps[name] = stamp_s, arrival_s
            other = self._stamps.get("joystick" if name == "actuators" else "actuators")
            if other is not None:  # what its clock shows now, as the other's newest tells
                clock_s = other[0] + (arrival_s - other[1])
                self._lag_s[name] = max(0.0, clock_s - stamp_s)

    def reject(self, name: InputName, reason: str, now_s: float) -> None:
        """A message was refused."""
        self._rejected[name, reason] += 1
        self._recent[name, reason] = now_s
        if reason == OVERLOAD:  # which says nothing of whether its columns are right
            self._flows.setdefault(name, _Flow()).lost(now_s)
            return
        self._in_a_row[name] += 1
        if name != "enabled":
            self._note(now_s, good=False)

    def sweep_unknown(self, now_s: float) -> None:
        """A sweep ended without an answer."""
        self._unknown_s = now_s

    def lesson(self, refusal: str | None) -> None:
        """A primitive was learned, or refused for a reason (see `core.screening`)."""
        if refusal is None:
            self._faulty.clear()
        elif refusal in FAULTS:
            self._faulty.append(refusal)

    def distrust(self, fault: str) -> None:
        """The machine computed wrongly: nothing it says is to be trusted until it starts anew."""
        self._distrust = self._distrust or fault

    def switched_on(self, now_s: float) -> None:
        """The machine is on again: its inputs may take as long to come as at the start."""
        self._start_s = now_s

    def lever_known(self, now_s: float) -> bool:
        """Whether the newest joystick sample says how the lever stands now."""
        return self._last_s["joystick"] is not None and self._joystick(now_s) is None

    def joystick_alive(self, alive: bool | None) -> None:
        """What the joystick's liveliness token says; None without a token."""
        self._joystick_alive = alive

    def plausible(self, now_s: float) -> bool:
        """Few enough samples are refused that the accepted ones may be learned from."""
        while self._window and self._window[0][0] < now_s - _PLAUSIBLE_WINDOW_S:
            _, good = self._window.popleft()
            self._bad -= not good
        seen = len(self._window)
        return seen < _ENOUGH_SAMPLES or self._bad <= _IMPLAUSIBLE_SHARE * seen

    def _note(self, at_s: float, *, good: bool) -> None:
        self._window.append((at_s, good))
        self._bad += not good

    def health(self, now_s: float, more: Sequence[Reason] = (), *, off: bool = False) -> Health:
        """Status at ``now_s``.

        Args:
            now_s: now.
            more: weaknesses that others have found.
            off: the machine is switched off: its silence is no fault, nor anything else of it.
        """
        if off and self._distrust is None:
            reason = Reason("machine_off", "enabled", "the machine is switched off")
            return self._told(Status.NOT_MONITORING, [reason], now_s, off=True)
        silent = [r for r in (self._silence("actuators", now_s), self._joystick(now_s)) if r]
        blind = [*self._distrusted(), *silent]
        weak = [*more, *self._weaknesses(now_s)]
        status = Status.NOT_MONITORING if blind else Status.DEGRADED if weak else Status.OK
        starting = bool(silent) and self._distrust is None and self._starting(now_s)
        return self._told(status, [*blind, *weak], now_s, starting=starting)

    def _told(
        self,
        status: Status,
        reasons: Sequence[Reason],
        now_s: float,
        *,
        starting: bool = False,
        off: bool = False,
    ) -> Health:
        ages: dict[InputName, float | None] = {
            name: None if last is None else max(now_s - last, 0.0) + self._under_way_s(name)
            for name, last in self._last_s.items()
        }
        counts = dict(self._accepted), dict(self._rejected)
        return Health(status, tuple(reasons), ages, *counts, starting=starting, off=off)

    def _starting(self, now_s: float) -> bool:
        """No sample came since monitoring began, which is not long ago."""
        limit = max(self._config.joystick_timeout_s, self._config.actuators_timeout_s)
        came = any(last is not None and last >= self._start_s for last in self._last_s.values())
        return not came and now_s - self._start_s <= limit

    def _distrusted(self) -> list[Reason]:
        if self._distrust is None:
            return []
        return [Reason("canary_failed", None, f"canary failed: {self._distrust}")]

    def _joystick(self, now_s: float) -> Reason | None:
        if self._joystick_alive is False:
            return Reason("joystick_gone", "joystick", "the joystick's liveliness token is gone")
        if self._config.joystick_on_change:
            last = self._last_s["joystick"]
            recent = last is not None and now_s - last <= RECENT_S
            # it may not speak again for long: one that was late does not blind for ever
            late = self._late("joystick", 0.0) if recent else None
            return late or self._unusable("joystick", now_s)
        return self._silence("joystick", now_s)

    def _silence(self, name: InputName, now_s: float) -> Reason | None:
        limit, last = self._limit_s(name), self._last_s[name]
        if last is None:
            return Reason(f"{name}_silent", name, f"no good {name} message yet")
        if now_s - last <= limit:
            return self._late(name, max(now_s - last, 0.0)) or self._unusable(name, now_s)
        return Reason(f"{name}_silent", name, f"no good {name} message for more than {limit:g} s")

    def _unusable(self, name: InputName, now_s: float) -> Reason | None:
        """Messages keep coming, but not one of them is fit for use."""
        count, last = self._in_a_row[name], self._last_s[name]
        if count < _REFUSED_RUN or last is None or now_s - last <= _REFUSED_S:
            return None
        text = f"the last {count} {name} messages were refused, none was good for {_REFUSED_S:g} s"
        return Reason(f"{name}_refused", name, text)

    def _late(self, name: InputName, since_s: float) -> Reason | None:
        """Messages keep coming, but they tell of long ago."""
        if since_s + self._under_way_s(name) <= self._limit_s(name):
            return None
        lag_s, late_s = self._lag_s.get(name, 0.0), self._late_s.get(name, 0.0)
        if late_s > lag_s:
            text = (
                f"{name} messages come {late_s:.1f} s late by their stamps: kept on their way,"
                " or by a clock that runs slow?"
            )
            return Reason(f"{name}_late", name, text)
        other = "joystick" if name == "actuators" else "actuators"
        text = (
            f"{name} messages lag {lag_s:.1f} s behind the {other} by their stamps:"
            " do both come from one clock?"
        )
        return Reason(f"{name}_late", name, text)

    def _under_way_s(self, name: InputName) -> float:
        return max(self._lag_s.get(name, 0.0), self._late_s.get(name, 0.0))

    def _limit_s(self, name: InputName) -> float:
        config = self._config
        return config.actuators_timeout_s if name == "actuators" else config.joystick_timeout_s

    def _weaknesses(self, now_s: float) -> list[Reason]:
        found = []
        if self._config.joystick_on_change and self._last_s["joystick"] is None:
            text = "no joystick message yet: only the stopping forecast protects"
            found.append(Reason("joystick_unknown", "joystick", text))
        for (name, reason), at in sorted(self._recent.items()):
            if now_s - at <= RECENT_S:
                if reason == OVERLOAD:
                    found.append(self._overload(name))
                    continue
                count = self._rejected[name, reason]
                text = f"{count} {name} messages refused: {reason}"
                found.append(Reason(f"{name}_{reason}", name, text))
        if not self.plausible(now_s):
            text = "many messages refused: columns, scale or sensor wrong? Nothing is learned now"
            found.append(Reason("implausible", None, text))
        if len(self._faulty) >= _FAULTY_RUN:
            words = ", ".join(sorted(set(self._faulty)))
            text = (
                f"the last primitives cannot be what they seem ({words}): wrong column or sensor?"
            )
            found.append(Reason("primitives_refused", "actuators", text))
        if self._unknown_s is not None and now_s - self._unknown_s <= RECENT_S:
            text = "a sweep ran out of its budget and was taken as contact"
            found.append(Reason("sweep_unknown", None, text))
        return found

    def _overload(self, name: InputName) -> Reason:
        text = (
            f"{name}: {self._flows[name].words()} beyond {self._config.max_rate_hz:g}/s were not"
            " looked at, only the newest were; nothing is learned meanwhile"
        )
        return Reason(OVERLOAD, name, text)


def stamp_of(sample: JoystickSample | ActuatorSample) -> float | None:
    """When the sender says that it was measured [s]; None where it does not say."""
    return sample.stamp_s if sample.stamped else None
