"""Memory that is freed goes back: a guard that works for weeks must not creep.

The C library keeps a pool of freed memory for each of many threads, and raises by itself the size
from which blocks are given back whole. With the threads of Zenoh and of a dashboard's metrics each
pool fills with what another thread needs: some 10 MB in ten minutes of work, and more for hours.
Two pools and fixed sizes keep it level; time for a step is the same (`tests.benchmarks.soak`).
"""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Final

_OPTIONS: Final = (
    # name for whoever sets it by hand, number in malloc.h, value
    ("MALLOC_ARENA_MAX", -8, 2),
    ("MALLOC_TRIM_THRESHOLD_", -1, 128 * 1024),
    ("MALLOC_MMAP_THRESHOLD_", -3, 128 * 1024),
)


def keep_level() -> bool:
    """Tell the C library, before other threads are; whether it took it (glibc does).

    What the environment sets stays as it is.
    """
    if sys.platform != "linux":
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):  # another C library
        return False
    return all(mallopt(number, value) for name, number, value in _OPTIONS if name not in os.environ)
