"""A Zenoh router in a process of its own.

::

    python -m rampe_guard.runtime.router ENDPOINT...
    python -m rampe_guard.runtime.router --config FILE.json5

For the demo and for tests; a site runs the official router (see deploy/), which takes the same
file. With RUST_LOG set, Zenoh's own log goes to stdout, as the official router's does.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from rampe_guard.errors import RampeGuardError
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import log_as_told, router


def main() -> int:
    """Route until told to stop."""
    parser = argparse.ArgumentParser(prog="router", description="A Zenoh router.")
    parser.add_argument("endpoints", nargs="*", help="to listen on, such as tcp/127.0.0.1:7447")
    parser.add_argument("--config", help="its configuration (json5) instead")
    args = parser.parse_args()
    if bool(args.endpoints) is (args.config is not None):
        parser.error("give endpoints, or --config FILE")
    try:
        return route(args.endpoints, args.config, StopFlag.on_signals())
    except RampeGuardError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2


def route(endpoints: Sequence[str], config: str | None, stop: StopFlag) -> int:
    """Route until told to stop; says ``ready`` once it listens.

    Raises:
        RampeGuardError: it cannot listen there, or the file cannot be used.
    """
    log_as_told()
    with router(endpoints, config):
        print("ready", flush=True)  # noqa: T201 - whoever started it waits for this line
        while not stop.wait(1.0):
            pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
