"""The scripted machine of the fault tests, a process of its own: works, and pushes at a crate.

    python -m tests.support.pusher ENDPOINT SITE TRUTH [--rate 100] [--seed 1]

It swings about, lever patterns and ways chosen at random, and again and again pushes against the
crate of the bench site: it gets into the margin and stalls there with the lever still pushed, so
an imminent alert must stand for as long as it does. Each time that begins or ends, a line of JSON
says so in the file TRUTH. Lines of JSON on stdin change what it does:

``{"task": "work" | "hold" | "rest"}``   work on; push at the crate and stay there; let go
``{"stream": "sound" | "repeat" | "reorder" | "flood" | "silent"}``   what its messages are like
``{"offset_s": 3600}``   its clock is wrong by so much [s]
``{"rate_hz": 10000}``   of a flood
"""

from __future__ import annotations

import argparse
import json
import queue
import random
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import zenoh

from rampe_guard.settings import load_site
from tests.support.ears import open_session

REST = (1.0, 0.065, 0.08, 0.03)
"""Between the crate (from 0.75 rad down) and the slew limit (1.3 rad), bucket at crate height."""
CRATE = 0.745
"""Swing [rad] at which the arm stalls, 5 mm within the crate's margin (from 0.754 rad down)."""
_LONGEST_STEP_S = 0.05
"""A machine that was frozen goes on from where it stood."""
_SHUFFLED = 6

Axes = tuple[float, float, float, float]
OFF: Axes = (0.0, 0.0, 0.0, 0.0)


class Moment(NamedTuple):
    """What is done now: levers, and whether it is the pushing at the crate."""

    levers: Axes
    pressed: bool = False


class Driver:
    """The operator and the arm: position += lever · top speed · dt, and a stop at the crate."""

    def __init__(self, speed: list[float], seed: int) -> None:
        self.position = list(REST)
        self.task = "work"
        self._speed = speed
        self._rng = random.Random(seed)
        self._script = self._live()
        self._now_s = 0.0

    def step(self, dt: float) -> Moment:
        """One tick of ``dt`` [s]."""
        self._now_s += dt
        moment = next(self._script)
        if not moment.pressed:
            for i, lever in enumerate(moment.levers):
                self.position[i] += lever * self._speed[i] * dt
        return moment

    def _live(self) -> Iterator[Moment]:
        while True:
            if self.task == "hold":
                yield from self._press(0.0)
            elif self.task == "rest":
                yield Moment(OFF)
            else:
                yield from self._cycle()

    def _cycle(self) -> Iterator[Moment]:
        """To the dump, the boom up and back, and then too near to the crate."""
        rng = self._rng
        yield from self._swing(1.0 + rng.uniform(0.05, 0.2), rng.uniform(0.3, 0.8))
        yield from self._pause(rng.uniform(0.2, 1.0))
        if rng.random() < 0.5:
            yield from self._move(1, REST[1] + rng.uniform(0.004, 0.012), rng.uniform(0.4, 1.0))
            yield from self._pause(0.3)
            yield from self._move(1, REST[1], rng.uniform(0.4, 1.0))
        if self.task == "work":
            yield from self._press(rng.uniform(0.8, 2.0))
        yield from self._pause(rng.uniform(0.3, 1.5))

    def _press(self, seconds: float) -> Iterator[Moment]:
        """Against the crate for so long, or for as long as the task is to hold there."""
        yield from self._swing(CRATE, 0.3)
        end_s = self._now_s + seconds
        while self.task == "hold" or (self.task == "work" and self._now_s < end_s):
            yield Moment((-0.3, 0.0, 0.0, 0.0), pressed=True)
        yield from self._swing(REST[0], 0.5)

    def _swing(self, goal: float, lever: float) -> Iterator[Moment]:
        return self._move(0, goal, lever)

    def _move(self, which: int, goal: float, lever: float) -> Iterator[Moment]:
        """One actuator to ``goal`` with its lever so far out."""
        up = goal > self.position[which]
        levers = [0.0] * len(REST)
        levers[which] = lever if up else -lever
        while (self.position[which] < goal) is up and self.position[which] != goal:
            yield Moment((levers[0], levers[1], levers[2], levers[3]))

    def _pause(self, seconds: float) -> Iterator[Moment]:
        end_s = self._now_s + seconds
        while self._now_s < end_s and self.task == "work":
            yield Moment(OFF)


class Sender:
    """Puts both messages of a tick, well or badly."""

    def __init__(self, session: zenoh.Session, keys: tuple[str, str], seed: int) -> None:
        self._session, self._keys = session, keys
        self._rng = random.Random(seed)
        self._last: list[tuple[str, str]] = []
        self._held: list[tuple[str, str]] = []
        self._stamp_s = 0.0
        self.stream, self.offset_s, self.rate_hz = "sound", 0.0, 10_000.0

    def send(self, levers: Axes, position: list[float]) -> None:
        """Tell of now."""
        stamp_s = time.time() + self.offset_s
        if self.stream == "silent":
            return
        if self.stream == "repeat" and self._last:
            self._put(self._last)
            return
        if self.stream == "flood":
            span_s = min(max(stamp_s - self._stamp_s, 1e-4), _LONGEST_STEP_S)
            self._stamp_s = stamp_s
            count = max(1, round(self.rate_hz * span_s))
            for i in range(count):
                self._put(self._pair(stamp_s - span_s * (count - 1 - i) / count, levers, position))
            return
        self._stamp_s = stamp_s
        self._last = self._pair(stamp_s, levers, position)
        if self.stream == "reorder":
            self._held += self._last
            if len(self._held) < _SHUFFLED:
                return
            self._rng.shuffle(self._held)
            self._put(self._held)
            self._held.clear()
            return
        self._put(self._last)

    def _pair(self, stamp_s: float, levers: Axes, position: list[float]) -> list[tuple[str, str]]:
        joystick, actuators = self._keys
        return [
            (joystick, f'{{"stamp": {stamp_s:.6f}, "axes": {list(levers)}}}'),
            (actuators, f'{{"stamp": {stamp_s:.6f}, "position": {position}}}'),
        ]

    def _put(self, messages: list[tuple[str, str]]) -> None:
        for key, payload in messages:
            self._session.put(key, payload, congestion_control=zenoh.CongestionControl.DROP)


def obey(word: dict[str, Any], driver: Driver, sender: Sender) -> None:
    """Change what is done."""
    driver.task = word.get("task", driver.task)
    sender.stream = word.get("stream", sender.stream)
    sender.offset_s = word.get("offset_s", sender.offset_s)
    sender.rate_hz = word.get("rate_hz", sender.rate_hz)


def work(driver: Driver, sender: Sender, truth: Path, period_s: float) -> None:
    """Until stdin ends."""
    words: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            words.put(line)
        words.put("")

    threading.Thread(target=read, daemon=True).start()
    pressed = False
    last_s = due_s = time.monotonic()
    with truth.open("a", encoding="utf-8", buffering=1) as told:
        print(json.dumps({"at_s": last_s, "pressed": False}), file=told)
        while True:
            while not words.empty():
                line = words.get()
                if not line:
                    return
                obey(json.loads(line), driver, sender)
            now_s = time.monotonic()
            moment = driver.step(min(now_s - last_s, _LONGEST_STEP_S))
            last_s = now_s
            if moment.pressed is not pressed:
                pressed = moment.pressed
                print(json.dumps({"at_s": now_s, "pressed": pressed}), file=told)
            sender.send(moment.levers, driver.position)
            due_s = max(due_s + period_s, time.monotonic() - _LONGEST_STEP_S)
            time.sleep(max(due_s - time.monotonic(), 0.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("endpoint", help="or several, with commas")
    parser.add_argument("site")
    parser.add_argument("truth", type=Path)
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    site = load_site(args.site)
    session = open_session(args.endpoint.split(","))
    try:
        keys = site.keys.joystick, site.keys.actuators
        driver = Driver([a.max_velocity for a in site.guard.actuators], args.seed)
        sender = Sender(session, keys, args.seed)
        print("ready", flush=True)
        work(driver, sender, args.truth, 1.0 / args.rate)
    finally:
        session.close()


if __name__ == "__main__":
    main()
