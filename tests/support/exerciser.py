"""The machine of `small_arm`, live, a process of its own: all levers at work without end.

    python -m tests.support.exerciser ENDPOINT JOYSTICK ACTUATORS

Each lever in turn is pushed one way, and then the other. Lines of JSON on stdin change what is
sent:

``{"joystick": false}``   the levers are not sent any more
``{"skew_s": 2.0}``       the stamps of the levers are so much ahead [s]
``{"flip": true}``        the levers are sent with the other sign
``{"rubbish": true}``     every tenth message of the actuators is no JSON
"""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from typing import Any

import numpy as np
import zenoh

from rampe_guard.simulate.machine import at_rest, measure, step
from tests.support import small_arm
from tests.support.ears import open_session

_RATE_HZ = 50.0
_SLOT, _PUSH = 35, 16
"""Ticks for each lever in turn, and how many of them it is pushed."""


def work(session: zenoh.Session, joystick: str, actuators: str) -> None:
    """Until stdin ends."""
    words: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            words.put(line)
        words.put("")

    threading.Thread(target=read, daemon=True).start()
    told: dict[str, Any] = {"joystick": True, "skew_s": 0.0, "flip": False, "rubbish": False}
    machine, rng = small_arm.machine(), np.random.default_rng(1)
    state = at_rest(machine, 0.5 * (machine.lower + machine.upper))
    sign = np.array([a.sign for a in small_arm.ACTUATORS])
    axis = [a.axis for a in small_arm.ACTUATORS]
    due_s, count = time.monotonic(), 0
    while True:
        while not words.empty():
            line = words.get()
            if not line:
                return
            told.update(json.loads(line))
        turn, tick = divmod(count, _SLOT)
        way = 1.0 if turn // 3 % 2 else -1.0
        lever = np.zeros(3)
        lever[turn % 3] = 0.95 * way if tick < _PUSH else 0.0
        axes = np.zeros(3)
        axes[axis] = sign * lever * (-1.0 if told["flip"] else 1.0)
        position, _ = measure(machine, state, rng)
        now_s = time.time()
        if told["joystick"]:
            message = {"stamp": now_s + told["skew_s"], "axes": axes.tolist()}
            session.put(joystick, json.dumps(message))
        message = {"stamp": now_s, "position": position.tolist()}
        bad = told["rubbish"] and count % 10 == 0
        session.put(actuators, "{" if bad else json.dumps(message))
        state = step(machine, state, lever, 1.0 / _RATE_HZ)
        count += 1
        due_s += 1.0 / _RATE_HZ
        time.sleep(max(0.0, due_s - time.monotonic()))


if __name__ == "__main__":
    with open_session(sys.argv[1]) as opened:
        print("ready", flush=True)
        work(opened, sys.argv[2], sys.argv[3])
