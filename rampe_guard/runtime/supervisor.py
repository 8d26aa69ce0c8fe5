"""A small parent that watches the guard's process, and starts it anew when it dies.

A crash in native code (FCL, Zenoh) takes the whole process with it, and so does a canary that
failed, on purpose. So ``rampe-guard run`` is two processes: the guard, and this one, which loads
nothing but the standard library. It

* starts the guard anew after a death by a signal or an exit code that no command ends with on
  purpose, says of what it died, and tells the new one, which raises it as an alert;
* kills it when its loop has not turned for ten seconds, which is a death like any other;
* keeps a spare guard with its imports behind it, which takes the place of one that died;
* passes on signals, waits for the end, and ends with the same code;
* takes the guard with it when it dies itself.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from types import FrameType

from rampe_guard.runtime.life import GRACE_S, LIFELINE, Life
from rampe_guard.runtime.log_lines import LogFormat, complaint
from rampe_guard.runtime.systemd import Watchdog
from rampe_guard.runtime.turning import PERIOD_S

UNTRUSTED = 3
"""Exit code of a guard whose canary failed."""
FINAL = (0, 2, 130)
"""Exit codes with which a guard ends on purpose: done, what a user must mend, interrupted."""
FIRST_DELAY_S, LONGEST_DELAY_S = 0.1, 10.0
SHORT_LIFE_S = 10.0
"""A guard that dies younger makes the next one wait twice as long."""
SPARE_AFTER_S = 5.0
"""A guard that has been at work for so long gets a spare one [s]: what begins needs the processor
for itself."""
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
        spare_after_s: how long a guard is without a spare, which must be a command that awaits its
            turn (`life.await_turn`) [s]; None: there never is one.
    """

    def __init__(
        self,
        command: Sequence[str],
        first_delay_s: float = FIRST_DELAY_S,
        longest_delay_s: float = LONGEST_DELAY_S,
        log_format: LogFormat = "text",
        look_s: float = PERIOD_S,
        spare_after_s: float | None = None,
    ) -> None:
        self._log_format: LogFormat = log_format
        self._command = list(command)
        self._first_delay_s, self._longest_delay_s = first_delay_s, longest_delay_s
        self._look_s, self._spare_after_s = look_s, spare_after_s
        self._life: Life | None = None
        self._spare: Life | None = None
        self._stopping = self._hung = False
        self._alone_s = 0.0
        self._manager = Watchdog()

    def run(self) -> int:
        """Until the guard ends on purpose or a signal ends both; returns the exit code."""
        for number in _PASSED_ON:
            # what nohup has switched off stays off
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._pass_on)
        try:
            return self._keep_running()
        finally:
            if self._spare is not None:
                self._spare.discard()

    def _keep_running(self) -> int:
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
        """Let a guard begin and wait for its end; its exit code, negative for a signal."""
        life, self._spare = self._spare, None
        if life is not None and (cause is None or not life.begin(cause)):
            life.discard()
            life = None
        if life is None:
            life = Life(self._command, self._look_s, cause, spare=False)
        try:
            self._life = life
            if self._stopping:  # a signal came before there was anyone to pass it on to
                life.end()
            self._hung = self._watch(life)
            return life.wait()
        finally:
            self._life = None
            life.close()

    def _watch(self, life: Life) -> bool:
        """Until the guard's end, or until it hangs and is killed for that; whether it did."""
        while (hangs := life.look()) is not None:
            if hangs and not self._stopping:
                life.kill_hung()
                return True
            self._mind_spare(life, time.monotonic())
        return False

    def _mind_spare(self, life: Life, now_s: float) -> None:
        """Start a spare for a guard that has been at work without one for a while."""
        if not life.guards:
            self._alone_s = now_s
        if self._spare is not None:
            if self._spare.alive:
                return
            self._spare.discard()  # it was killed: its memory was needed, say
            self._spare, self._alone_s = None, now_s
        due = self._spare_after_s is not None and now_s - self._alone_s >= self._spare_after_s
        if due and not self._stopping:
            self._spare = Life(self._command, self._look_s, spare=True)

    def _pass_on(self, _signal: int, _frame: FrameType | None) -> None:
        self._stopping = True
        if self._spare is not None:
            self._spare.kill()  # it may be loading: what ends needs the processor
        if self._life is not None:
            self._life.end()

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
