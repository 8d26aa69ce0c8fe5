"""Is the machine switched off? What its enable key says, held against what the machine does.

Only a fresh, explicit "off" counts. No message, an old one, a refused one or one whose sender's
clock is ahead of the machine's (nobody knows how old it is) reads as on: then the guard watches,
and says what is wrong with the key. Signs of life are a lever that is pushed and an actuator that
moves. While they last, the machine is not off, whatever it says:

- for a second after the word they are the end of the work (an arm that runs out), and the guard
  watches on until they have ceased;
- later they contradict the word. The guard watches on, says so, and believes it again when
  nothing has moved for as long as a refusal counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rampe_guard.core.config import ActuatorConfig, InputConfig
from rampe_guard.core.inputs import Accepted, Continuity, Fault
from rampe_guard.core.monitor import RECENT_S, Reason
from rampe_guard.core.sender_clock import SenderClock
from rampe_guard.core.types import ActuatorSample, EnabledSample, FloatArray

_CALM_S = 0.3
"""Nothing may have moved for this long before the machine is taken as off: less than the
time-out of any usual input, so that inputs which go silent with the machine are no fault."""
_RUN_OUT_S = 1.0
"""How long a machine may go on moving after it was switched off [s]."""
_WAY = 0.05
"""Way of an actuator that is a motion and no noise [share of its top speed · 1 s]..."""
_WAY_S = 1.0
"""...if it was made within this time."""
_NEVER = float("-inf")


class EnableKey:
    """The enable key of one machine, if it has one.

    Args:
        actuators: in site order.
        config: time-outs; without ``enabled_timeout_s`` the machine is always on.
        start_s: when monitoring began.
    """

    def __init__(
        self, actuators: Sequence[ActuatorConfig], config: InputConfig, start_s: float
    ) -> None:
        self._timeout_s = config.enabled_timeout_s
        self._gate = Continuity[EnabledSample](self._timeout_s or 0.0, config.max_stamp_jump_s)
        self._clock = SenderClock()
        self._way = _WAY * _WAY_S * np.array([a.max_velocity for a in actuators])
        self._deadband = np.array([a.deadband for a in actuators])
        self._start_s = start_s
        self._word: EnabledSample | None = None
        self._said_s = _NEVER
        self._own = SenderClock()
        self._early_s: float | None = None
        self._off_since_s: float | None = None
        self._anchor: tuple[float, FloatArray] | None = None
        self._life_s = _NEVER
        self._contradicted_s: float | None = None

    def take(self, sample: EnabledSample) -> Accepted[EnabledSample] | Fault:
        """Take a message, or tell why it was refused; "on" is believed however it is stamped."""
        verdict = self._gate.check(sample)
        if isinstance(verdict, Accepted):
            if verdict.restarted:
                self._own = SenderClock()
            self._own = self._own.followed(sample.stamp_s, sample.arrival_s, stamped=sample.stamped)
        if sample.enabled:
            verdict = Accepted(sample)
        if isinstance(verdict, Fault):
            self.refused()
            return verdict
        self._word, self._said_s, self._early_s = sample, sample.arrival_s, None
        if sample.stamped and not sample.enabled:
            self._said_s = self._clock.measured_s(sample.stamp_s, sample.arrival_s)
            self._early_s = self._clock.early_s(self._own)
        return verdict

    def refused(self) -> None:
        """Something came that cannot be used: nobody knows what it would have said."""
        self._word = None

    def moved(self, sample: ActuatorSample, *, restarted: bool) -> None:
        """Take an accepted position of the machine."""
        if restarted:
            self._clock = SenderClock()
            self._anchor = None
        self._clock = self._clock.followed(sample.stamp_s, sample.arrival_s, stamped=sample.stamped)
        now_s, q = sample.arrival_s, sample.position
        if self._anchor is None:
            self._anchor = (now_s, q)
        since_s, before = self._anchor
        went = bool((np.abs(q - before) > self._way).any())
        if went:
            self._life_s = now_s
        if went or now_s - since_s >= _WAY_S:
            self._anchor = (now_s, q)

    def pushed(self, command: FloatArray, now_s: float) -> None:
        """The lever stands so now: commands (n,) [-]."""
        if (np.abs(command) > self._deadband).any():
            self._life_s = now_s

    def off(self, now_s: float) -> bool:
        """Whether the machine is switched off; to be asked as time goes by."""
        if not self._says_off(now_s):
            self._off_since_s = self._contradicted_s = None
            return False
        if self._off_since_s is None:
            self._off_since_s = now_s
        if self._life_s > self._off_since_s + _RUN_OUT_S:
            self._contradicted_s = self._life_s
        if self._contradicted_s is not None and now_s - self._contradicted_s < RECENT_S:
            return False
        return now_s - self._life_s >= _CALM_S

    def weaknesses(self, now_s: float) -> list[Reason]:
        """What is wrong with the key."""
        if self._timeout_s is None:
            return []
        found = []
        if now_s - max(self._said_s, self._start_s) > self._timeout_s:
            late = self._word is not None and now_s - self._word.arrival_s <= self._timeout_s
            text = (
                f"no {'' if late else 'good '}enabled message for more than {self._timeout_s:g} s"
            )
            text += " by the stamps of the actuators" if late else ""
            text += ": taken as on"
            found.append(Reason("enabled_silent", "enabled", text))
        elif self._word is not None and self._early_s is not None:
            text = (
                f"the enabled messages are {self._early_s:.1f} s ahead of the actuators by their"
                " stamps: taken as on; do both come from one clock?"
            )
            found.append(Reason("enabled_early", "enabled", text))
        if self._contradicted_s is not None and now_s - self._contradicted_s < RECENT_S:
            text = "the machine says that it is off, and moves or is steered: taken as on"
            found.append(Reason("enabled_contradicted", "enabled", text))
        return found

    def _says_off(self, now_s: float) -> bool:
        if self._word is None or self._word.enabled or self._timeout_s is None:
            return False
        return self._early_s is None and now_s - self._said_s <= self._timeout_s
