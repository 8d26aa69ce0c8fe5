"""Two machines that move alike, in one process: one speaks as rmw_zenoh does, the other JSON.

    python -m tests.support.ros2_sender ENDPOINT ROS-SITE [JSON-SITE]

Both stand, swing at the crate with the lever pushed, stall at it, are let go, and swing back. Lines
of JSON on stdin then put single messages of ROS 2, ``{"key": KEY, "hex": BYTES}``, or let
numbers be left out, ``{"key": KEY, "lose": 3}``. It ends with stdin.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import zenoh

from rampe_guard.settings import Site, load_site
from tests.support.ears import open_session
from tests.support.ros2 import Sender, angles_of, joint_state, joy
from tests.support.station import REST

PERIOD_S = 0.02


def script() -> Iterator[tuple[tuple[float, ...], tuple[float, ...], bool]]:
    """Levers, position, and whether they are the last of the script."""
    swing, speed = REST[0], 0.475
    plan = [(0.0, 25), (-0.5, 22), (-0.5, 30), (0.0, 40), (0.5, 22), (0.0, 40)]
    for part, (lever, steps) in enumerate(plan):
        for _ in range(steps):
            stalled = part == 2
            if not stalled:
                swing += lever / 0.5 * speed * PERIOD_S
            yield (lever, 0.0, 0.0, 0.0), (swing, *REST[1:]), False
    while True:
        yield (0.0,) * 4, (swing, *REST[1:]), True


class Speaker:
    """Puts both inputs of one machine in the form of its site."""

    def __init__(self, session: zenoh.Session, site: Site) -> None:
        self._session, self._site = session, site
        self._senders = {
            site.keys.joystick: Sender(b"j" * 16),
            site.keys.actuators: Sender(b"a" * 16),
        }

    def say(self, levers: tuple[float, ...], position: tuple[float, ...], stamp_s: float) -> None:
        keys = self._site.keys
        if self._site.ros2 is None:
            self.put(keys.joystick, json.dumps({"stamp": stamp_s, "axes": levers}).encode())
            self.put(keys.actuators, json.dumps({"stamp": stamp_s, "position": position}).encode())
            return
        self.put(keys.joystick, joy(levers, stamp_s))
        self.put(keys.actuators, joint_state(angles_of(self._site, position), stamp_s))

    def put(self, key: str, payload: bytes) -> None:
        """Attached as rmw_zenoh does it on the site's own topics."""
        sender = self._senders.get(key)
        spoken = sender is not None and self._site.ros2 is not None
        self._session.put(
            key,
            payload,
            attachment=sender.attachment() if sender is not None and spoken else None,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def lose(self, key: str, count: int) -> None:
        """Number as if so many messages had been sent."""
        self._senders[key].sequence += count


def main(endpoint: str, *paths: str) -> None:
    """Play the script, and obey; single messages are of the first site."""
    session = open_session(endpoint)
    speakers = [Speaker(session, load_site(path)) for path in paths]
    ros = speakers[0]
    over, words = threading.Event(), queue.SimpleQueue[dict[str, Any]]()

    def hear() -> None:
        for line in sys.stdin:
            words.put(json.loads(line))
        over.set()

    threading.Thread(target=hear, daemon=True).start()
    start_s, start_unix_s, told = time.monotonic(), time.time(), False
    for number, (levers, position, done) in enumerate(script()):
        if over.wait(max(0.0, start_s + number * PERIOD_S - time.monotonic())):
            break
        stamp_s = start_unix_s + number * PERIOD_S
        for speaker in speakers:
            speaker.say(levers, position, stamp_s)
        while not words.empty():
            word = words.get()
            if "lose" in word:
                ros.lose(word["key"], word["lose"])
            else:
                ros.put(word["key"], bytes.fromhex(word["hex"]))
        if done and not told:
            told = True
            print("done", flush=True)
    session.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
