"""What foresight costs: a day of work in memory, and a whole step with all three forecasts.

    python -m tests.benchmarks.situations [--minutes 10]

The work is that of the demo's operator in the quarry, its meshes and terrain, at 50 Hz through
`Guard.step`, offline. For the day, his situations are remembered again and again, each time a
little elsewhere, until the memory is full.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rampe_guard.core.guard import Guard
from rampe_guard.core.situation import Likeness
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, JoystickSample
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.loading import load_telling
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.quarry import START, quarry_operator
from rampe_guard.simulate.run import Tick, simulate

RATE_HZ = 50.0
_ASKED = 1000


def main(minutes: float) -> None:
    """Print both tables."""
    site = load_site(str(shipped_site("demo")))
    machine = load_telling(site)
    guard = machine.guard(0.0, "benchmark")
    took_ms, work = [], []
    for tick in _work(site, machine.arm.limits, minutes):
        begin = time.perf_counter()
        _step(guard, tick)
        took_ms.append((time.perf_counter() - begin) * 1e3)
        work.append(tick)
    late = np.array(took_ms[len(took_ms) // 4 :])  # once there is something to remember
    print(f"step at {RATE_HZ:g} Hz, {len(late)} of {minutes:g} min: {_told(late)} ms")
    print(f"situations remembered: {guard.situations.count}")
    _day(site, work)


def _work(site: Site, limits: FloatArray, minutes: float) -> Iterator[Tick]:
    actuators = site.guard.actuators
    return simulate(
        actuators,
        quarry_operator(actuators, 7),
        build_machine(actuators, limits),
        START,
        rate_hz=RATE_HZ,
        duration_s=60.0 * minutes,
    )


def _step(guard: Guard, tick: Tick) -> None:
    t = tick.time_s
    stick = JoystickSample(t, tick.axes, t)
    guard.step(Inputs((stick,), (ActuatorSample(t, tick.position, tick.velocity, t),)), t)


def _day(site: Site, work: list[Tick]) -> None:
    config = site.guard
    top = np.array([a.max_velocity for a in config.actuators])
    sign = np.array([a.sign for a in config.actuators])
    axis = [a.axis for a in config.actuators]
    likeness = Likeness(top)
    n, most = len(top), config.next.situations
    memory = SituationMemory(likeness, n, config.next.horizon_s, most)
    rng = np.random.default_rng(5)
    stamp_s, query_ms, add_ms = 0.0, [], []
    points: list[FloatArray] = []
    before = _resident()
    while memory.count < most * 0.97:
        aside = rng.normal(0.0, 0.05, n) * top
        memory.interrupt()
        for tick in work[::5]:
            stamp_s += 5.0 / RATE_HZ
            place = tick.position + aside
            point = likeness.point(place, tick.velocity, sign * tick.axes[axis])
            begin = time.perf_counter()
            memory.see(stamp_s, place, point)
            add_ms.append((time.perf_counter() - begin) * 1e3)
            points.append(point)
        points = points[-len(work) // 5 :]
    for point in rng.permutation(np.array(points))[:_ASKED]:
        begin = time.perf_counter()
        memory.similar(point, config.next.analogues)
        query_ms.append((time.perf_counter() - begin) * 1e3)
    kept = sum(values.nbytes for values in memory.snapshot().values())
    print(
        f"a day: {memory.count} situations of {memory.hours:.1f} h of work,"
        f" {(_resident() - before) / 1e6:.0f} MB in memory, {kept / 1e6:.0f} MB as it is kept"
    )
    print(f"query: {_told(np.array(query_ms))} ms; remembering: {_told(np.array(add_ms))} ms")


def _resident() -> int:
    """Memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * resource.getpagesize()


def _told(took_ms: FloatArray) -> str:
    p50, p99 = np.quantile(took_ms, [0.5, 0.99])
    return f"{p50:.2f} p50, {p99:.2f} p99, {took_ms.max():.1f} most"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    main(parser.parse_args().minutes)
