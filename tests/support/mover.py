"""``python -m tests.support.mover ENDPOINT KEY FROM TO SPEED``: an object that tells its pose.

It stands at FROM (``x,y,z`` [m]) until anything is put on ``KEY/go``, drives straight to TO at
SPEED [m/s], and stands there; a pose every 50 ms, until it is killed.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from tests.support.ears import open_session

PERIOD_S = 0.05


def main(endpoint: str, key: str, start: str, end: str, speed: str) -> None:
    """Tell the pose for ever."""
    a, b = (np.array([float(x) for x in place.split(",")]) for place in (start, end))
    started: list[float] = []
    session = open_session(endpoint)
    session.declare_subscriber(f"{key}/go", lambda _: started.append(time.monotonic()))
    length = float(np.linalg.norm(b - a))
    print("ready", flush=True)
    while True:
        driven_s = time.monotonic() - started[0] if started else 0.0
        place = a + (b - a) * min(float(speed) * driven_s / length, 1.0)
        pose = {"stamp": time.time(), "xyz_m": place.tolist(), "rpy_rad": [0.0, 0.0, 0.0]}
        session.put(key, json.dumps(pose).encode())
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
