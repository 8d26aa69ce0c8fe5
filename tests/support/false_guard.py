"""``rampe-guard`` on a machine that begins to compute wrongly once a file exists.

    python -m tests.support.false_guard FILE run SITE ...

Everything is the shipped program, but for the answers of FCL's `collide`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import fcl

from rampe_guard.cli import main

_true = fcl.collide
_spoilt = Path(sys.argv.pop(1))


def _collide(*args: Any) -> int:
    return 0 if _spoilt.exists() else int(_true(*args))


if __name__ == "__main__":
    fcl.collide = _collide
    sys.exit(main())
