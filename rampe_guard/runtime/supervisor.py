"""A small parent that watches the guard's process, and starts it anew when it dies.

A crash in native code (FCL, Zenoh) takes the whole process with it, and so does a canary that
failed, on purpose. So ``rampe-guard run`` is two processes: the guard, and this one, which loads
nothing but the standard library. It

* starts the guard anew after a death by a signal or an exit code that no command ends with on
  purpose, says of what it died, and tells the new one, which raises it as an alert;
* kills it when its loop has not turned for ten seconds, which is a death like any other;
* passes on signals, waits for the end, and ends with the same code;
* takes the guard with it when it dies itself.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from types import FrameType

from rampe_guard.runtime.log_lines import LogFormat, complaint
from rampe_guard.runtime.systemd import Watchdog
from rampe_guard.runtime.turning import PERIOD_S, Listener

UNTRUSTED = 3
"""Exit code of a guard whose canary failed."""
FINAL = (0, 2, 130)
"""Exit codes with which a guard ends on purpose: done, what a user must mend, interrupted."""
FIRST_DELAY_S, LONGEST_DELAY_S = 0.1, 10.0
SHORT_LIFE_S = 10.0
"""A guard that dies younger makes the next one wait twice as long."""
GRACE_S = 10.0
"""A guard that was told to end and has not by then is killed."""
LAST_WORDS_S = 1.0
"""In which a guard that hangs can still say where, before it is killed."""

RESTARTED = "RAMPE_GUARD_RESTARTED"
"""Environment: what the guard before this one died of."""
LIFELINE = "RAMPE_GUARD_LIFELINE"
"""Environment: process id of the parent, and a file descriptor that closes with it."""
_PASSED_ON = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
_PR_SET_PDEATHSIG = 1


class Supervisor:
    """Keeps one command running.

    Args:
        command: program and arguments.
        first_delay_s: wait before a guard is started anew [s].
        longest_delay_s: to which that is doubled after short lives [s].
        log_format: of what it says on stderr.
        look_s: ten looks of so long in a row without a turn of its loop are a hang [s].
    """

    def __init__(
        self,
        command: Sequence[str],
        first_delay_s: float = FIRST_DELAY_S,
        longest_delay_s: float = LONGEST_DELAY_S,
        log_format: LogFormat = "text",
        look_s: float = PERIOD_S,
    ) -> None:
        self._log_format: LogFormat = log_format
        self._command = list(command)
        self._first_delay_s, self._longest_delay_s = first_delay_s, longest_delay_s
        self._look_s = look_s
        self._child: subprocess.Popen[bytes] | None = None
        self._stopping = self._hung = False
        self._manager = Watchdog()

    def run(self) -> int:
        """Until the guard ends on purpose or a signal ends both; returns the exit code."""
        for number in _PASSED_ON:
            # what nohup has switched off stays off
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._pass_on)
        delay_s, cause = self._first_delay_s, None
        while not self._stopping:
            began_s = time.monotonic()
            code = self._live(cause)
            if code in FINAL:
                return code
            if self._stopping:
                return 0 if -code in _PASSED_ON else 128 - code if code < 0 else code
            cause, died = ("a hang", "hung and was killed") if self._hung else _words(code)
            if time.monotonic() - began_s >= SHORT_LIFE_S:
                delay_s = self._first_delay_s
            text = f"the guard {died}; it is started anew in {delay_s:g} s"
            _say(text, self._log_format)
            self._manager.status(text)
            self._wait(delay_s)
            delay_s = min(2.0 * delay_s, self._longest_delay_s)
        return 0

    def _live(self, cause: str | None) -> int:
        """Start a guard and wait for its end; its exit code, negative for a signal."""
        near, far = os.pipe()
        listener = Listener(self._look_s)
        environment = {**os.environ, LIFELINE: f"{os.getpid()} {near}"}
        environment.pop(RESTARTED, None)
        if cause is not None:
            environment[RESTARTED] = cause
        try:
            # a session of its own: what a terminal sends comes to this process alone, once
            child = subprocess.Popen(  # noqa: S603 - our own command line
                self._command,
                env=listener.environment(environment),
                pass_fds=(near, listener.far),
                start_new_session=True,
            )
            self._child = child
            listener.started()
            if self._stopping:  # a signal came before there was anyone to pass it on to
                self._end(child)
            self._hung = self._watch(child, listener)
            return child.wait()
        finally:
            self._child = None
            listener.close()
            os.close(near)
            os.close(far)

    def _watch(self, child: subprocess.Popen[bytes], listener: Listener) -> bool:
        """Until the guard's end, or until it hangs and is killed for that; whether it did."""
        while child.poll() is None:
            hangs = listener.hangs()
            if hangs is None:
                return False
            if hangs and not self._stopping:
                child.send_signal(signal.SIGABRT)  # faulthandler says where it stands
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(LAST_WORDS_S)
                child.kill()
                return True
        return False

    def _pass_on(self, _signal: int, _frame: FrameType | None) -> None:
        self._stopping = True
        if self._child is not None:
            self._end(self._child)

    def _end(self, child: subprocess.Popen[bytes]) -> None:
        """SIGTERM for each of them: a guard ends by it cleanly, even before it has a handler."""
        child.send_signal(signal.SIGTERM)
        timer = threading.Timer(GRACE_S, child.kill)
        timer.daemon = True
        timer.start()

    def _wait(self, seconds: float) -> None:
        until_s = time.monotonic() + seconds
        while not self._stopping and (left_s := until_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, 0.05))


def _words(code: int) -> tuple[str, str]:
    """For the next guard and for the log: of what a guard died."""
    if code >= 0:
        cause = "a failed canary" if code == UNTRUSTED else f"a fault (exit code {code})"
        return cause, f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:  # a real-time signal
        name = f"signal {-code}"
    return f"a crash ({name})", f"died of {name}"


def _say(text: str, log_format: LogFormat) -> None:
    with contextlib.suppress(OSError):  # nobody reads it any more: no reason to stop guarding
        print(complaint((text,), log_format), file=sys.stderr, flush=True)  # noqa: T201


def restarted_after() -> str | None:
    """In a guard: what the one before it died of."""
    return os.environ.get(RESTARTED)


def end_with_parent() -> None:
    """In a guard: end as by SIGTERM when the supervisor dies, however it dies.

    The kernel is asked to tell (Linux). A thread that waits for the end of a pipe does the same
    where it cannot, and kills after a while what does not end.
    """
    line = os.environ.pop(LIFELINE, None)
    if line is None:
        return
    parent, descriptor = (int(word) for word in line.split())
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGTERM), 0, 0, 0)
    threading.Thread(target=_outlive, args=(descriptor,), daemon=True).start()
    if os.getppid() != parent:  # it died before the kernel was asked
        os.kill(os.getpid(), signal.SIGTERM)


def _outlive(descriptor: int) -> None:
    with contextlib.suppress(OSError):
        while os.read(descriptor, 1):
            pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_S)
    os.kill(os.getpid(), signal.SIGKILL)
