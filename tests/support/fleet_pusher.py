"""Many scripted machines in one process: ``python -m tests.support.fleet_pusher ENDPOINT SITE...``.

Each works as `tests.support.pusher` does, spread evenly in time. A number on stdin is the rate of
each from now on [Hz]; 0 is silence. It ends with stdin.
"""

from __future__ import annotations

import queue
import sys
import threading
import time

from rampe_guard.settings import load_site
from tests.support.ears import open_session
from tests.support.pusher import Driver, Sender


def main(endpoint: str, paths: list[str]) -> None:
    """Move them all."""
    sites = [load_site(path) for path in paths]
    words: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            words.put(line)
        words.put("")

    session = open_session(endpoint)
    try:
        machines = [
            (
                Driver([a.max_velocity for a in site.guard.actuators], seed),
                Sender(session, (site.keys.joystick, site.keys.actuators), seed),
            )
            for seed, site in enumerate(sites)
        ]
        threading.Thread(target=read, daemon=True).start()
        print("ready", flush=True)
        rate_hz, due_s, number = 0.0, time.monotonic(), 0
        while True:
            while not words.empty():
                line = words.get()
                if not line:
                    return
                rate_hz, due_s = float(line), time.monotonic()
            if not rate_hz:
                time.sleep(0.01)
                continue
            driver, sender = machines[number]
            number = (number + 1) % len(machines)
            moment = driver.step(1.0 / rate_hz)
            sender.send(moment.levers, driver.position)
            due_s = max(due_s + 1.0 / rate_hz / len(machines), time.monotonic() - 0.1)
            time.sleep(max(due_s - time.monotonic(), 0.0))
    finally:
        session.close()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
