"""A random walk over the table of one alarm: what must hold whatever comes, in any order."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable
from functools import partial

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from rampe_guard.core.alarm import TABLE, Alarm, Inhibit, Level, Mode, State, Trigger
from rampe_guard.core.config import AlertConfig
from rampe_guard.errors import RefusedError

CONFIG = AlertConfig(realarm_s=5.0, shelve_max_s=3.0)  # short, so that a walk meets them
SHOWN = {State.UNACKED, State.ACKED}
QUIET = {State.NORMAL, State.PENDING}


class Walk(RuleBasedStateMachine):
    """The alarm beside a model of what it owes to people.

    ``machine_s`` passes with the evidence, ``now_s`` always: as `Annunciator` does it.
    """

    def __init__(self) -> None:
        super().__init__()
        self.alarm = Alarm(CONFIG)
        self.now_s = self.machine_s = 0.0
        self.asked_s = self.shelved_s = -math.inf

    @initialize(latched=st.booleans())
    def begin(self, *, latched: bool) -> None:
        self.alarm.latched = latched

    @rule(level=st.sampled_from(Level), times=st.integers(1, 12), dt=st.floats(0.005, 0.4))
    def evidence(self, level: Level, times: int, dt: float) -> None:
        for _ in range(times):
            self._pass(dt)
            self.machine_s += dt
            self._step(level)

    def _step(self, found: Level) -> None:
        alarm = self.alarm
        before, number, state, inhibit = alarm.level, alarm.number, alarm.state, alarm.inhibit
        changed = alarm.step(found, self.machine_s)
        if alarm.level > before:
            assert alarm.state is State.UNACKED, "every rise asks for attention"
            assert alarm.inhibit is Inhibit.NONE, "and ends the silence"
        assert alarm.number == number + (state in QUIET and alarm.state in SHOWN)
        if found is Level.IMMINENT:
            assert (alarm.level, alarm.inhibit) == (Level.IMMINENT, Inhibit.NONE), "told at once"
        assert alarm.level >= min(before, found), "never lower than both"
        if changed and alarm.state is State.UNACKED and alarm.level >= before:
            self.asked_s = self.machine_s
        elif found and alarm.inhibit is Inhibit.NONE and alarm.state in SHOWN and not changed:
            assert self.machine_s - self.asked_s < CONFIG.realarm_s, "it asks again"
        if (alarm.level, alarm.state, alarm.inhibit) != (before, state, inhibit):
            assert changed or {state, alarm.state} <= QUIET, "no change goes untold"

    @rule(dt=st.floats(0.0, 100.0))
    def nothing_comes(self, dt: float) -> None:
        before = self.alarm.level, self.alarm.state
        self._pass(dt)
        assert (self.alarm.level, self.alarm.state) == before, "missing data change nothing"

    def _pass(self, dt: float) -> None:
        shelved = self.alarm.inhibit is Inhibit.SHELVED
        self.now_s += dt
        told = self.alarm.lapse(self.now_s)
        assert told == (shelved and self.alarm.inhibit is Inhibit.NONE), "the end is told"

    @rule()
    def someone_acknowledges(self) -> None:
        alarm = self.alarm
        shown, level = alarm.state, alarm.level
        assert alarm.acknowledge("ann") == (shown in {State.UNACKED, State.RTN_UNACKED})
        assert alarm.level is level
        if shown is State.UNACKED:
            assert (alarm.state, alarm.acked_by) == (State.ACKED, "ann")

    @rule(duration_s=st.floats(0.01, 4.0))
    def someone_shelves(self, duration_s: float) -> None:
        alarm = self.alarm
        fresh = alarm.inhibit is Inhibit.NONE
        may = Level.CLEAR < alarm.level < Level.IMMINENT and duration_s <= CONFIG.shelve_max_s
        try:
            alarm.shelve("bob", duration_s, self.now_s)
        except RefusedError:
            assert not may or not fresh
            return
        assert may
        assert (alarm.inhibit, alarm.shelved_by) == (Inhibit.SHELVED, "bob")
        if fresh:
            self.shelved_s = self.now_s

    @rule()
    def someone_ends_the_silence(self) -> None:
        shelved = self.alarm.inhibit is Inhibit.SHELVED
        assert self.alarm.unshelve() == shelved
        assert self.alarm.inhibit is Inhibit.NONE

    @rule()
    def the_machine_is_switched_off_and_on(self) -> None:
        alarm = self.alarm
        shown, latched = alarm.state, alarm.latched
        assert alarm.switch_off(self.machine_s) == (shown not in QUIET)
        waits = shown is State.RTN_UNACKED or (shown is State.UNACKED and latched)
        assert alarm.state is (State.RTN_UNACKED if waits else State.NORMAL)
        assert (alarm.level, alarm.inhibit) == (Level.CLEAR, Inhibit.MACHINE_OFF)
        assert not alarm.switch_off(self.machine_s), "told once"
        visits[alarm.inhibit] += 1
        alarm.switch_on()

    @invariant()
    def what_is_always_so(self) -> None:
        alarm = self.alarm
        visits[alarm.state] += 1
        visits[alarm.inhibit] += 1
        assert (alarm.level > Level.CLEAR) == (alarm.state in SHOWN)
        assert alarm.acked_by is None or alarm.state in {State.ACKED, *QUIET}
        shelved = alarm.inhibit is Inhibit.SHELVED
        assert shelved == (alarm.shelved_by is not None) == (alarm.shelved_until_s is not None)
        if shelved:
            assert Level.CLEAR < alarm.level < Level.IMMINENT
            assert self.now_s - self.shelved_s < CONFIG.shelve_max_s


visits: Counter[Mode] = Counter()


def test_whatever_comes_the_alarm_keeps_its_promises() -> None:
    run_state_machine_as_test(
        Walk, settings=settings(max_examples=25, stateful_step_count=40, deadline=None)
    )


def test_a_long_walk_keeps_them_too_and_reaches_every_state() -> None:
    """Hypothesis shrinks what fails; this one goes on for long enough to meet the rare."""
    visits.clear()
    rng = random.Random(17)
    for latched in (False, True):
        walk = Walk()
        walk.begin(latched=latched)
        for _ in range(4000):
            level, times = rng.choice([*Level]), rng.randint(1, 12)
            requests: list[Callable[[], None]] = [
                walk.someone_acknowledges,
                walk.someone_ends_the_silence,
                walk.the_machine_is_switched_off_and_on,
                partial(walk.nothing_comes, rng.expovariate(1.0)),
                *[partial(walk.someone_shelves, rng.uniform(0.01, 4.0))] * 3,
                *[partial(walk.evidence, level, times, rng.uniform(0.005, 0.4))] * 12,
            ]
            rng.choice(requests)()
            walk.what_is_always_so()
    assert set(visits) == {*State, *Inhibit}
    assert min(visits.values()) > 20, f"hardly met: {visits}"


def test_the_table_leads_everywhere_from_the_start_and_back() -> None:
    for start, region in ((State.NORMAL, set(State)), (Inhibit.NONE, set(Inhibit))):
        reached: set[Mode] = {start}
        for _ in region:
            reached |= {to for (mode, _), to in TABLE.items() if mode in reached}
        assert reached == region
        for mode in region:
            back: set[Mode] = {mode}
            for _ in region:
                back |= {to for (at, _), to in TABLE.items() if at in back}
            assert start in back, f"no way back from {mode}"


def test_every_trigger_moves_something() -> None:
    assert {trigger for _, trigger in TABLE} == set(Trigger)
