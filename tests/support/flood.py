"""Publishes far too much, as a process of its own, until its stdin ends.

    python -m tests.support.flood ENDPOINT SITE KIND [--rate 10000] [--swing 1.0]

KIND is an input of the site's machine (``joystick``, ``actuators`` or ``both``: a lever that is
pushed a little to the crate, and the arm standing), or ``state``: queries of the guard's state.
Messages have stamps that go on, and are sent in bursts of a millisecond. At the end it prints how
many it has sent, and in how many seconds, as JSON.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time

import zenoh

from rampe_guard.settings import Site, load_site
from tests.support.ears import open_session

_BURST_S = 0.001


def put(session: zenoh.Session, site: Site, kind: str, swing: float) -> None:
    """One message of each input that is flooded, or one query."""
    stamp_s = time.time()
    if kind == "state":
        session.get(f"{site.keys.base}/state", lambda _reply: None, timeout=1.0)
    if kind in ("joystick", "both"):
        axes = [-0.3, 0.0, 0.0, 0.0]
        _put(session, site.keys.joystick, {"stamp": stamp_s, "axes": axes})
    if kind in ("actuators", "both"):
        position = [swing, 0.065, 0.08, 0.03]
        _put(session, site.keys.actuators, {"stamp": stamp_s, "position": position})


def _put(session: zenoh.Session, key: str, message: dict[str, object]) -> None:
    # it waits for a link that is full: else the router would drop, and nothing would be flooded
    session.put(key, json.dumps(message).encode(), congestion_control=zenoh.CongestionControl.BLOCK)


def main() -> None:
    """Flood."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("endpoint")
    parser.add_argument("site")
    parser.add_argument("kind", choices=("joystick", "actuators", "both", "state"))
    parser.add_argument("--rate", type=float, default=10_000.0)
    parser.add_argument("--swing", type=float, default=1.0)
    args = parser.parse_args()
    site, session = load_site(args.site), open_session(args.endpoint)
    over = threading.Event()

    def wait() -> None:
        sys.stdin.read()
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    print("flooding", flush=True)
    start_s = time.monotonic()
    sent = 0
    while not over.is_set() and time.monotonic() - start_s < 120.0:
        due = int((time.monotonic() - start_s) * args.rate) - sent
        for _ in range(min(due, 1000)):
            put(session, site, args.kind, args.swing)
        sent += due  # what is not made in time is not made up for
        over.wait(_BURST_S)
    seconds = time.monotonic() - start_s
    session.close()
    print(json.dumps({"sent": sent, "seconds": seconds}))


if __name__ == "__main__":
    main()
