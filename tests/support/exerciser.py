"""The machine of `small_arm`, live, a process of its own: all levers at work without end.

    python -m tests.support.exerciser ENDPOINT JOYSTICK ACTUATORS [ros2]

With ``ros2`` it speaks as drivers of ROS 2 do, on these Zenoh keys. Each lever in turn is pushed
one way, and then the other. Lines of JSON on stdin change what is sent:

``{"joystick": false}``   the levers are not sent any more
``{"skew_s": 2.0}``       the stamps of the levers are so much ahead [s]
``{"flip": true}``        the levers are sent with the other sign
``{"rubbish": true}``     every tenth message of the actuators is cut short
"""

from __future__ import annotations

import json
import math
import queue
import sys
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import zenoh

from rampe_guard.simulate.machine import at_rest, measure, step
from tests.support import small_arm
from tests.support.ears import open_session
from tests.support.ros2 import Sender, joint_state, joy

_RATE_HZ = 50.0
_SLOT, _PUSH = 35, 16
"""Ticks for each lever in turn, and how many of them it is pushed."""


class Json:
    """Puts both inputs as rampe-guard's own messages."""

    def __init__(self, session: zenoh.Session, joystick: str, actuators: str) -> None:
        self._session, self._keys = session, (joystick, actuators)

    def levers(self, axes: Sequence[float], stamp_s: float) -> None:
        self._session.put(self._keys[0], json.dumps({"stamp": stamp_s, "axes": list(axes)}))

    def positions(self, position: Sequence[float], stamp_s: float, *, cut: bool) -> None:
        said = json.dumps({"stamp": stamp_s, "position": list(position)})
        self._session.put(self._keys[1], "{" if cut else said)


class Ros2:
    """Puts both as drivers of ROS 2 do: the joints in another order, and among others."""

    def __init__(self, session: zenoh.Session, joystick: str, actuators: str) -> None:
        self._session, self._keys = session, (joystick, actuators)
        self._senders = Sender(b"j" * 16), Sender(b"a" * 16)

    def levers(self, axes: Sequence[float], stamp_s: float) -> None:
        self._put(0, joy(axes, stamp_s))

    def positions(self, position: Sequence[float], stamp_s: float, *, cut: bool) -> None:
        turn, lift, reach = position
        angles = {"camera": math.nan, "reach": reach, "lift": lift, "turn": turn}
        said = joint_state(angles, stamp_s)
        self._put(1, said[:40] if cut else said)

    def _put(self, which: int, payload: bytes) -> None:
        """Numbered as rmw_zenoh does it."""
        attachment = self._senders[which].attachment()
        self._session.put(self._keys[which], payload, attachment=attachment)


def work(voice: Json | Ros2) -> None:
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
            voice.levers(axes.tolist(), now_s + told["skew_s"])
        cut = bool(told["rubbish"]) and count % 10 == 0
        voice.positions(position.tolist(), now_s, cut=cut)
        state = step(machine, state, lever, 1.0 / _RATE_HZ)
        count += 1
        # a process that was kept waiting stood still: no machine makes up for lost time
        due_s = max(due_s + 1.0 / _RATE_HZ, time.monotonic())
        time.sleep(max(0.0, due_s - time.monotonic()))


if __name__ == "__main__":
    with open_session(sys.argv[1]) as opened:
        print("ready", flush=True)
        speaks = Ros2 if sys.argv[4:] == ["ros2"] else Json
        work(speaks(opened, sys.argv[2], sys.argv[3]))
