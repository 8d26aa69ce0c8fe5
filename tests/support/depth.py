"""How deep tests search: as long as a change can wait for, or for a night.

    RAMPE_GUARD_TESTS=nightly .venv/bin/python -m pytest -q -n 2 --dist loadfile

Only where a search costs many seconds. What both do is the same, and seeded.
"""

from __future__ import annotations

import os

NIGHTLY = os.environ.get("RAMPE_GUARD_TESTS") == "nightly"


def depth(usual: int, nightly: int) -> int:
    """So many examples."""
    return nightly if NIGHTLY else usual
