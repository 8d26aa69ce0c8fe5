"""A guard that cannot keep up says so; a hiccup is none."""

from __future__ import annotations

from rampe_guard.core.config import InputConfig
from rampe_guard.core.monitor import InputMonitor
from rampe_guard.runtime.health import BUCKETS_MS, Durations, Pulse
from rampe_guard.runtime.pace import Pace
from rampe_guard.settings import load_site
from tests.support.processes import BENCH


def codes(pace: Pace, now_s: float) -> list[str]:
    return [reason.code for reason in pace.reasons(now_s)]


def test_a_hiccup_is_no_news() -> None:
    pace = Pace()
    for k in range(500):
        pace.step(0.01 * k, 300.0 if k % 100 == 0 else 5.0)
        pace.turn(0.01 * k)
    assert codes(pace, 5.0) == []


def test_a_tenth_of_the_steps_being_slow_is_until_it_is_over() -> None:
    pace = Pace()
    for k in range(500):
        pace.step(0.01 * k, 180.0 if k % 10 == 0 else 5.0)
    (reason,) = pace.reasons(5.0)
    assert reason.code == "slow"
    assert "50 of 500 steps in 5 s took 180 to 180 ms" in reason.text
    assert codes(pace, 10.5) == []


def test_few_steps_that_are_all_slow_are_seen() -> None:
    pace = Pace()
    for k in range(3):
        pace.step(1.0 + k, 1000.0)
    assert codes(pace, 4.0) == ["slow"]


def test_a_loop_that_stood_still_says_for_how_long() -> None:
    pace = Pace()
    pace.turn(1.0)
    pace.turn(1.9)
    assert codes(pace, 2.0) == []
    pace.turn(4.2)
    (reason,) = pace.reasons(4.2)
    assert reason.code == "stalled"
    assert "stood still for 2.3 s" in reason.text
    pace.turn(4.3)
    assert codes(pace, 9.0) == ["stalled"]
    assert codes(pace, 9.3) == []


def test_the_heartbeat_tells_it_and_is_degraded() -> None:
    pulse = Pulse(load_site(BENCH), "boot", 0.0, lambda now_s: now_s, "hash")
    monitor = InputMonitor(InputConfig(), 0.0)
    monitor.accept("joystick", 3.0)
    monitor.accept("actuators", 3.0)
    pulse.turn(0.0)
    pulse.turn(3.0)
    beat = pulse.beat(monitor.health(3.0), 3.0, 0, {})
    assert (beat.status, [r.code for r in beat.reasons]) == ("degraded", ["stalled"])
    assert (beat.tick, beat.steps) == (2, 0)
    assert beat.resources is not None
    assert beat.resources.rss_bytes > 10_000_000
    assert beat.resources.cpu_s > 0.0


def test_durations_are_counted_for_good() -> None:
    spent = Durations()
    for _ in range(3000):  # more than are kept for the quantiles
        spent.add(1.0)
    spent.add(5000.0)
    assert sum(spent.counts) == 3001
    assert spent.counts[BUCKETS_MS.index(1.0)] == 3000  # its upper end belongs to a bucket
    assert spent.counts[-1] == 1
    assert spent.total_ms == 8000.0
