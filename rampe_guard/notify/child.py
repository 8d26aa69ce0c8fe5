"""A command of the user, run without a shell, ended with all its children."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import threading
from collections.abc import Collection, Mapping, Sequence

from rampe_guard.errors import SettingsError
from rampe_guard.notify.target import NotHeardError

_FIELD = re.compile(r"\{([a-z_]+)\}")


class Template:
    """Words of a command line with fields such as ``{text}`` in them.

    Args:
        line: as typed; split as a shell would split it, but never given to one.
        fields: names that may stand in braces.

    Raises:
        SettingsError: nothing to run, an unknown field, or no such program.
    """

    def __init__(self, line: str, fields: Collection[str]) -> None:
        try:
            self.words = shlex.split(line)
        except ValueError as error:
            raise SettingsError(f"command {line!r}: {error}") from None
        if not self.words:
            raise SettingsError("a command is empty")
        for name in _FIELD.findall(line):
            if name not in fields:
                raise SettingsError(
                    f"command {line!r}: no field {{{name}}}; there are {', '.join(sorted(fields))}"
                )
        if not _FIELD.search(self.words[0]) and shutil.which(self.words[0]) is None:
            raise SettingsError(f"command {line!r}: there is no program {self.words[0]!r}")

    def fill(self, values: Mapping[str, str]) -> list[str]:
        """The words with their fields replaced; a value never becomes two words."""
        return [_FIELD.sub(lambda m: values.get(m[1], ""), word) for word in self.words]


class Runner:
    """Runs one command at a time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._child: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def run(
        self,
        words: Sequence[str],
        timeout_s: float,
        stdin: bytes = b"",
        more: Mapping[str, str] | None = None,
    ) -> None:
        """Run it to its end; its output goes to our stderr.

        Args:
            words: program and arguments.
            timeout_s: then it is killed, with its children [s].
            stdin: what it can read.
            more: environment variables besides ours.

        Raises:
            NotHeardError: it could not be started, took too long, or ended with another code
                than 0.
        """
        with self._lock:
            if self._stopped:
                raise NotHeardError("we are stopping")
            try:
                child = subprocess.Popen(  # noqa: S603 - the user's own command, without a shell
                    list(words),
                    stdin=subprocess.PIPE,
                    stdout=2,
                    env={**os.environ, **(more or {})},
                    start_new_session=True,
                )
            except (OSError, ValueError) as error:
                raise NotHeardError(f"{words[0]}: {error}") from None
            self._child = child
        try:
            child.communicate(stdin, timeout_s)
        except subprocess.TimeoutExpired:
            raise NotHeardError(f"{words[0]}: not done within {timeout_s:g} s") from None
        finally:
            self._end(child)
        if child.returncode:
            raise NotHeardError(f"{words[0]} ended with {_code(child.returncode)}")

    def interrupt(self) -> None:
        """End what runs now."""
        with self._lock:
            if self._child is not None:
                _kill(self._child)

    def stop(self) -> None:
        """End what runs now, and run nothing any more."""
        with self._lock:
            self._stopped = True
        self.interrupt()

    def _end(self, child: subprocess.Popen[bytes]) -> None:
        with self._lock:
            if child.poll() is None:
                _kill(child)
                child.wait()
            self._child = None
        if child.stdin is not None:
            with contextlib.suppress(OSError):  # it read less than was written
                child.stdin.close()


def _kill(child: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)


def _code(code: int) -> str:
    return f"code {code}" if code > 0 else f"signal {-code}"
