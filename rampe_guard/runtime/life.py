"""One life of a guard's process, as its supervisor sees it; and the turn of a spare one.

Most of the time that a guard takes to begin goes into its imports. A spare has them behind it: it
waits for the word that it is its turn, with what the guard before it died of, and only then reads
the site and guards. It is called `SPARE_NAME` in lists of processes until then.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence

from rampe_guard.runtime.turning import Listener

RESTARTED = "RAMPE_GUARD_RESTARTED"
"""Environment: what the guard before this one died of."""
LIFELINE = "RAMPE_GUARD_LIFELINE"
"""Environment: process id of the parent, and a file descriptor that closes with it."""
TURN = "RAMPE_GUARD_TURN"
"""Environment: the file descriptor on which a spare is told that it is its turn."""
GRACE_S = 10.0
"""A guard that was told to end and has not by then is killed."""
LAST_WORDS_S = 1.0
"""In which a guard that hangs can still say where, before it is killed."""
SPARE_NAME, GUARD_NAME = "rampe-spare", "rampe-guard"
WAKES_S = 1.0
"""A spare that has not woken so long after its turn came is not waited for [s]."""
_AWAKE = b"!"
_LOOK_S = 0.5
_PR_SET_NAME = 15


class Life:
    """A guard's process, started.

    Args:
        command: program and arguments.
        look_s: ten looks of so long in a row without a turn of its loop are a hang [s].
        cause: what the guard before it died of, if any did.
        spare: it waits until `begin`.
    """

    def __init__(
        self, command: Sequence[str], look_s: float, cause: str | None = None, *, spare: bool
    ) -> None:
        self._near, self._far = os.pipe()
        hears, self._tells = socket.socketpair()
        self._listener = Listener(look_s)
        environment = {**os.environ, LIFELINE: f"{os.getpid()} {self._near}"}
        environment.pop(RESTARTED, None)
        if cause is not None:
            environment[RESTARTED] = cause
        if spare:
            environment[TURN] = str(hears.fileno())
        try:
            # a session of its own: what a terminal sends comes to this process alone, once
            self._child = subprocess.Popen(  # noqa: S603 - our own command line
                command,
                env=self._listener.environment(environment),
                pass_fds=(self._near, self._listener.far, hears.fileno()),
                start_new_session=True,
            )
        except BaseException:
            self.close()
            raise
        finally:
            hears.close()
        self._listener.started()

    @property
    def alive(self) -> bool:
        """It has not ended."""
        return self._child.poll() is None

    @property
    def guards(self) -> bool:
        """Its loop has turned: it neither loads nor looks for a router any more."""
        return self._listener.turning

    def begin(self, cause: str) -> bool:
        """It is a spare's turn: the guard before it died of ``cause``.

        Returns:
            Whether it woke: one that is dead, stopped or starved does not, and is of no use.
        """
        self._tells.settimeout(WAKES_S)
        with contextlib.suppress(OSError):
            self._tells.sendall(cause.encode() + b"\n")
            return self._tells.recv(1) == _AWAKE
        return False

    def look(self) -> bool | None:
        """Wait for a while: whether it hangs; None when it has ended, or ends."""
        return None if not self.alive else self._listener.hangs()

    def kill_hung(self) -> None:
        """End what hangs, which may still say where it stands."""
        self._child.send_signal(signal.SIGABRT)  # faulthandler does
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._child.wait(LAST_WORDS_S)
        self._child.kill()

    def end(self) -> None:
        """SIGTERM for each of them: a guard ends by it cleanly, even before it has a handler."""
        self._child.send_signal(signal.SIGTERM)
        timer = threading.Timer(GRACE_S, self._child.kill)
        timer.daemon = True
        timer.start()

    def wait(self) -> int:
        """Its exit code, negative for a signal."""
        return self._child.wait()

    def kill(self) -> None:
        """End a spare whose turn never came."""
        self._child.kill()

    def discard(self) -> None:
        """Kill it, and let go of it."""
        self.kill()
        self._child.wait()
        self.close()

    def close(self) -> None:
        """Let go of all pipes; a guard that still lives ends by that."""
        self._listener.close()
        self._tells.close()
        for descriptor in (self._near, self._far):
            with contextlib.suppress(OSError):
                os.close(descriptor)


def restarted_after() -> str | None:
    """In a guard: what the one before it died of."""
    return os.environ.get(RESTARTED)


def take_name() -> None:
    """In a guard or a spare: be told apart in lists of processes from the start."""
    _call(SPARE_NAME if TURN in os.environ else GUARD_NAME)


def await_turn(stopped: Callable[[], bool]) -> bool:
    """In a spare: wait for its turn; in any other guard there is nothing to wait for.

    Returns:
        Whether to guard; false if told to stop, or if nobody is there who could say so.
    """
    word = os.environ.pop(TURN, None)
    if word is None:
        return True
    descriptor = int(word)
    try:
        while not select.select([descriptor], [], [], _LOOK_S)[0]:
            if stopped():
                return False
        cause = os.read(descriptor, 4096).decode(errors="replace").strip()
        with contextlib.suppress(OSError):  # nobody waits for it any more
            os.write(descriptor, _AWAKE)
    finally:
        os.close(descriptor)
    if not cause:
        return False
    os.environ[RESTARTED] = cause
    _call(GUARD_NAME)
    return True


def _call(name: str) -> None:
    """What lists of processes call this one, where that can be said (Linux)."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode(), 0, 0, 0)
