"""A Zenoh router in a process of its own: ``python -m rampe_guard.runtime.router ENDPOINT…``.

For the demo and for tests; a site runs the official router (see deploy/).
"""

from __future__ import annotations

import sys

from rampe_guard.errors import RampeGuardError
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import router


def main() -> int:
    """Route until told to stop."""
    stop = StopFlag.on_signals()
    try:
        with router(sys.argv[1:]):
            print("ready", flush=True)  # noqa: T201 - whoever started it waits for this line
            while not stop.wait(1.0):
                pass
    except RampeGuardError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
