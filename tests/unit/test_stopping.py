import os
import signal
import subprocess
import sys
import time

import pytest

from rampe_guard.runtime.stopping import StopFlag


def test_wait_sleeps_or_returns_at_once_when_set() -> None:
    flag = StopFlag()
    began = time.monotonic()
    assert not flag.wait(0.1)
    assert time.monotonic() - began >= 0.1
    flag.set()
    assert flag.wait(60.0)
    assert flag()


STORM = """
import sys
from rampe_guard.runtime.stopping import StopFlag
stop = StopFlag.on_signals()
print("ready", flush=True)
while not stop.wait(0.0002):
    pass
"""


def test_a_signal_at_any_moment_of_a_busy_loop_ends_it() -> None:
    """A lock taken in the handler would hang now and then: 20 tries at odd moments."""
    for k in range(20):
        process = subprocess.Popen([sys.executable, "-c", STORM], stdout=subprocess.PIPE)
        try:
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(0.003 * k)
            os.kill(process.pid, (signal.SIGTERM, signal.SIGHUP)[k % 2])
            assert process.wait(10.0) == 0
        finally:
            process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()


@pytest.mark.parametrize("swallowed", [True, False])
def test_a_library_that_swallows_the_break_makes_no_error_of_it(*, swallowed: bool) -> None:
    flag = StopFlag()

    def work() -> str:
        flag.set()
        if swallowed:
            return "half of it"
        raise TypeError("expected str, not BufferedReader")

    assert flag.unless_stopped(work) is None


def test_an_error_without_a_stop_is_an_error() -> None:
    def work() -> str:
        raise TypeError("broken")

    flag = StopFlag()
    assert flag.unless_stopped(lambda: "whole") == "whole"
    with pytest.raises(TypeError, match="broken"):
        flag.unless_stopped(work)
