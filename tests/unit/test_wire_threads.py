"""Messages are met by many threads at once: each of a hundred clients has its own."""

from __future__ import annotations

import subprocess
import sys

from tests.support.processes import ROOT

PROGRAM = """
import sys, threading
from rampe_guard import wire
from tests.support.messages import STATE
sys.setswitchinterval(1e-6)
payload = wire.encode(STATE)
start = threading.Barrier(32)
def meet():
    start.wait()
    assert wire.decode(payload, wire.State) == STATE
threads = [threading.Thread(target=meet) for _ in range(32)]
for thread in threads: thread.start()
for thread in threads: thread.join()
"""


def test_many_threads_may_meet_a_message_for_the_first_time_together() -> None:
    """msgspec 0.21 crashes if they may make what it knows of a type at the same time."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, b"")
