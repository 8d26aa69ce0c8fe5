"""``rampe-guard`` on a computer whose wall clock is set anew while it runs.

    python -m tests.support.clock_guard FILE run SITE ...

Everything is the shipped program, but the time of day, which is off by as many seconds as FILE
says. (The clock of Zenoh's own code is not changed: no message carries it.)
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from rampe_guard.cli import main

_true = time.time
_offset = Path(sys.argv.pop(1))


def _wrong() -> float:
    try:
        return _true() + float(_offset.read_text("utf-8") or 0.0)
    except OSError:
        return _true()


if __name__ == "__main__":
    time.time = _wrong
    sys.exit(main())
