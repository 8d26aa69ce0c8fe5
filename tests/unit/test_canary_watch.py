"""The canary is asked in time, and its failure is for good."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rampe_guard import wire
from rampe_guard.core.alarm import Level, State
from rampe_guard.core.config import InputConfig
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent, Event
from rampe_guard.core.guard import Guard
from rampe_guard.core.monitor import InputMonitor, Status
from rampe_guard.core.types import ActuatorSample, Inputs, JoystickSample
from rampe_guard.runtime.canary_watch import PERIOD_S, TELL_S, CanaryWatch
from rampe_guard.runtime.health import Pulse
from rampe_guard.runtime.worker import arrived
from rampe_guard.settings import load_site
from tests.support.core_rig import CONFIG, LIMITS, Wall
from tests.support.processes import BENCH

DT = 0.05


@dataclass
class Script:
    """Answers one after the other, the last one for ever."""

    answers: list[str | None] = field(default_factory=lambda: [None])
    asked: int = 0

    def check(self) -> str | None:
        self.asked += 1
        return self.answers[min(self.asked, len(self.answers)) - 1]


def test_it_is_asked_at_once_and_then_every_period() -> None:
    script = Script()
    watch = CanaryWatch(script)
    assert watch.trial(0.0) is None
    times = np.arange(0.0, 3.0 * PERIOD_S, 0.01)
    assert all(watch.look(float(now_s)) is None for now_s in times)
    assert script.asked == 3
    assert watch.trial(2.0 * PERIOD_S + 0.5) == wire.CanaryTrial(result="ok", age_s=0.5)
    assert not watch.told(1e6)


def test_a_failure_is_told_once_lasts_and_ends_the_guard() -> None:
    script = Script([None, "2 + 2 is 5", None])
    watch = CanaryWatch(script)
    assert watch.look(0.0) is None
    assert watch.look(PERIOD_S) == "2 + 2 is 5"
    assert watch.look(9.0 * PERIOD_S) is None
    assert script.asked == 2
    assert watch.trial(PERIOD_S + 1.0) == wire.CanaryTrial(result="failed", age_s=1.0)
    assert not watch.told(PERIOD_S + 0.9 * TELL_S)
    assert watch.told(PERIOD_S + TELL_S)


def test_what_the_machine_says_of_itself_asks_for_a_step() -> None:
    assert not arrived(Inputs())
    assert arrived(Inputs(canary="wrong"))
    assert arrived(Inputs(restarted="a crash (SIGSEGV)"))


def test_the_monitor_never_trusts_again() -> None:
    monitor = InputMonitor(InputConfig(), start_s=0.0)
    monitor.distrust("2 + 2 is 5")
    monitor.distrust("2 + 2 is 6")
    health = monitor.health(0.01)
    assert not health.starting  # a fault to be told at once, not samples on their way
    for now_s in (1.0, 100.0):
        monitor.accept("joystick", now_s)
        monitor.accept("actuators", now_s)
        health = monitor.health(now_s)
        assert health.status is Status.NOT_MONITORING
        (reason,) = health.reasons
        assert (reason.code, reason.input) == ("canary_failed", None)
        assert reason.text == "canary failed: 2 + 2 is 5"


def test_the_heartbeat_tells_the_newest_trial() -> None:
    pulse = Pulse(load_site(BENCH), "boot", 0.0, lambda now_s: now_s, "hash")
    monitor = InputMonitor(InputConfig(), 0.0)
    assert pulse.beat(monitor.health(0.0), 0.0, 0, {}).canary is None
    monitor.distrust("2 + 2 is 5")
    trial = wire.CanaryTrial(result="failed", age_s=0.5)
    beat = pulse.beat(monitor.health(0.0), 0.0, 0, {}, canary=trial)
    assert (beat.status, beat.canary) == ("not_monitoring", trial)
    assert beat.reasons[0].code == "canary_failed"


class Bench:
    """A guard with a lever pushed towards a wall, at its margin: imminent for as long as it is."""

    def __init__(self) -> None:
        self.guard = Guard(CONFIG, LIMITS, Wall(), start_s=0.0)
        self.now_s = 0.0

    def step(self, seconds: float, **more: str) -> list[Event]:
        events: list[Event] = []
        for _ in range(round(seconds / DT)):
            self.now_s += DT
            stick = JoystickSample(self.now_s, np.array([0.5]), self.now_s)
            arm = ActuatorSample(self.now_s, np.array([0.98]), None, self.now_s)
            events += self.guard.step(Inputs((stick,), (arm,), **more), self.now_s)  # type: ignore[arg-type]
            more = {}
        return events

    def system(self) -> AlertEvent | None:
        alerts = self.guard.snapshot(self.now_s).alerts
        return next((a for a in alerts if a.zone == SYSTEM_ZONE), None)

    def status(self) -> Status:
        return self.guard.snapshot(self.now_s).health.status


def test_a_failed_canary_freezes_all_alerts_for_good() -> None:
    bench = Bench()
    bench.step(1.0)
    assert bench.status() is Status.OK
    events = bench.step(3.0, canary="2 + 2 is 5")
    assert bench.status() is Status.NOT_MONITORING
    alerts = [e for e in events if isinstance(e, AlertEvent)]
    zone = [e for e in alerts if e.zone == "wall"]
    assert len(zone) > 5
    assert {(e.kind, e.level, e.quality) for e in zone} == {("repeat", Level.IMMINENT, "stale")}
    system = bench.system()
    assert system is not None
    assert (system.level, system.state) == (Level.WARNING, State.UNACKED)
    assert system.evidence.note == "canary failed: 2 + 2 is 5"
    bench.guard.acknowledge(system.alert_id, "anna", bench.now_s)
    bench.step(2.0)
    assert bench.status() is Status.NOT_MONITORING  # acknowledging mends nothing


def test_a_restart_is_shown_until_acknowledged_while_the_guard_works() -> None:
    bench = Bench()
    bench.step(5.0, restarted="a crash (SIGSEGV)")
    assert bench.status() is Status.OK
    system = bench.system()
    assert system is not None
    assert (system.level, system.state) == (Level.CAUTION, State.UNACKED)
    assert system.evidence.note == "guard restarted after a crash (SIGSEGV)"
    assert bench.guard.acknowledge("another", "anna", bench.now_s) == ()
    assert bench.system() is not None
    (acked,) = bench.guard.acknowledge(system.alert_id, "anna", bench.now_s)
    assert isinstance(acked, AlertEvent)
    assert (acked.state, acked.acked_by) == (State.ACKED, "anna")
    events = bench.step(2.0)
    assert bench.system() is None
    last = [e for e in events if isinstance(e, AlertEvent) and e.zone == SYSTEM_ZONE][-1]
    assert (last.level, last.state) == (Level.CLEAR, State.NORMAL)


def test_a_restart_is_not_forgotten_by_a_blind_spell() -> None:
    bench = Bench()
    bench.step(1.0, restarted="a crash (SIGSEGV)")
    bench.now_s += 5.0
    bench.guard.step(Inputs(), bench.now_s)
    system = bench.system()
    assert system is not None
    assert system.evidence.note.endswith("; guard restarted after a crash (SIGSEGV)")
    bench.step(5.0)
    system = bench.system()
    assert system is not None
    assert (system.level, system.state) == (Level.CAUTION, State.UNACKED)
    assert system.evidence.note == "guard restarted after a crash (SIGSEGV)"
