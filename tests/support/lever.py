"""A joystick that speaks once and then lives on: ``lever.py ENDPOINT KEY ALIVE_KEY``."""

from __future__ import annotations

import json
import signal
import sys
import time

from tests.support.ears import open_session


def main() -> None:
    endpoint, key, alive_key = sys.argv[1:]
    session = open_session(endpoint)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        token = session.liveliness().declare_token(alive_key)
        session.put(key, json.dumps({"stamp": time.time(), "axes": [0.0] * 4}).encode())
        print("ready", flush=True)
        while True:
            time.sleep(1.0)
    finally:
        del token
        session.close()


if __name__ == "__main__":
    main()
