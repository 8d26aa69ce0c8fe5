"""The C library's own account of its pools, in a process with many threads."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

WORK = """
import ctypes, sys, threading
from rampe_guard.runtime.allocator import keep_level
libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
if "level" in sys.argv:
    assert keep_level()
ready = threading.Barrier(8)
def work():
    ready.wait()
    for _ in range(100):
        libc.malloc(50_000)
    ready.wait()
threads = [threading.Thread(target=work) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
libc.malloc_stats()
"""


def pools(*argv: str, **environment: str) -> int:
    done = subprocess.run(
        [sys.executable, "-c", WORK, *argv],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=60.0,
    )
    return done.stderr.count("Arena ")


pytestmark = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")


def test_many_threads_share_two_pools() -> None:
    assert pools() > 2
    assert pools("level") == 2


def test_what_the_environment_sets_stays() -> None:
    assert pools("level", MALLOC_ARENA_MAX="4") == 4
