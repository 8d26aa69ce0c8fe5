"""Real processes for tests: started by us, logged to a file, ended by pid, never by name."""

from __future__ import annotations

import atexit
import contextlib
import functools
import io
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Self, TypeVar
from unittest import mock

from rampe_guard.cli import main
from rampe_guard.runtime.life import GUARD_NAME

T = TypeVar("T")

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "config" / "sites" / "bench.yaml"
DEMO = ROOT / "config" / "sites" / "demo.yaml"
START_S = 240.0
"""Two slow cores, meshes to load, and the first time the sweep is compiled: only a hang takes so
long."""


def free_endpoint() -> str:
    """A loopback endpoint that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def until(found: Callable[[], T | None], within_s: float, what: Callable[[], str] | str) -> T:
    """Poll until ``found()`` is truthy; AssertionError saying ``what`` after the deadline."""
    deadline = time.monotonic() + within_s
    while True:
        value = found()
        if value:
            return value
        if time.monotonic() > deadline:
            words = what if isinstance(what, str) else what()
            raise AssertionError(f"not within {within_s:g} s: {words}")
        time.sleep(0.01)


def environment(state: Path) -> dict[str, str]:
    """Of every process: one thread for the maths, and models kept below ``state``.

    So no test learns from another, nor from what is kept on this machine.
    """
    ours = {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "100", "STATE_DIRECTORY": str(state)}
    return {**os.environ, **ours}


class Process:
    """``python ARGS`` with stdout, stderr and kept models in files below ``folder``.

    ``talk`` lets `tell` write lines to its stdin.
    """

    def __init__(
        self, folder: Path, name: str, args: Sequence[str | Path], *, talk: bool = False
    ) -> None:
        self._out_path = folder / f"{name}-{time.monotonic_ns()}.out"
        self._err_path = self._out_path.with_suffix(".err")
        with self._out_path.open("wb") as out, self._err_path.open("wb") as err:
            self.popen = subprocess.Popen(
                [sys.executable, *map(str, args)],
                cwd=ROOT,
                stdin=subprocess.PIPE if talk else subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                env=environment(folder / "state"),
            )

    @property
    def pid(self) -> int:
        return self.popen.pid

    @property
    def out(self) -> str:
        """Standard output so far."""
        return self._out_path.read_text("utf-8", "replace")

    @property
    def err(self) -> str:
        """Standard error so far: the log."""
        return self._err_path.read_text("utf-8", "replace")

    @property
    def alive(self) -> bool:
        return self.popen.poll() is None

    def tell(self, line: str) -> None:
        """Write a line to its stdin."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(f"{line}\n".encode())
        self.popen.stdin.flush()

    def wait_for(self, text: str, within_s: float = START_S) -> None:
        """Wait until ``text`` is in its output or log; fails at once if it ends before."""

        def said() -> bool:
            if text in self.out or text in self.err:
                return True
            assert self.alive, f"ended with {self.popen.returncode} before {text!r}:\n{self.err}"
            return False

        until(said, within_s, lambda: f"{text!r} from pid {self.pid}; its log:\n{self.err}")

    def signal_and_wait(self, number: signal.Signals, within_s: float = 20.0) -> float:
        """Send a signal; returns how long it took to end [s]."""
        began_s = time.monotonic()
        self.popen.send_signal(number)
        self.popen.wait(within_s)
        return time.monotonic() - began_s

    def close(self) -> None:
        """End it, whatever it does."""
        if self.alive:
            self.popen.terminate()
            try:
                self.popen.wait(5.0)
            except subprocess.TimeoutExpired:
                self.popen.kill()
        self.popen.wait()
        if self.popen.stdin is not None:
            self.popen.stdin.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def started(process: Process, word: str, within_s: float = START_S) -> Process:
    """It, once it has said ``word``; if it does not, it is ended."""
    try:
        process.wait_for(word, within_s)
    except BaseException:
        process.close()
        raise
    return process


def router(folder: Path, endpoint: str) -> Process:
    """A router that listens when this returns."""
    args = ["-m", "rampe_guard.runtime.router", endpoint]
    return started(Process(folder, "router", args), "ready")


def guard(folder: Path, site: Path, endpoint: str, *more: str) -> Process:
    """A guard that works when this returns; ``more`` are options of ``run``."""
    args = ["-m", "rampe_guard", "run", str(site), "--connect", endpoint, *more]
    return started(Process(folder, "guard", args), "guarding on")


def guarding(process: Process) -> int:
    """Pid of the process that guards, below the supervisor that ``run`` is; not of a spare."""

    def found() -> list[int]:
        return [pid for pid in children(process) if _name(pid) == GUARD_NAME]

    (pid,) = until(found, 5.0, f"a guard below pid {process.pid}")
    return pid


def _name(pid: int) -> str:
    """What lists of processes call it; empty if it is gone."""
    try:
        return Path(f"/proc/{pid}/comm").read_text("utf-8").strip()
    except OSError:
        return ""


def kill_guard(process: Process) -> None:
    """Supervisor and guard die at once, and neither can do anything about it."""
    worker = guarding(process)
    os.kill(process.pid, signal.SIGSTOP)  # it must not start another
    os.kill(worker, signal.SIGKILL)
    process.popen.kill()
    process.popen.wait()


@functools.cache
def _nowhere() -> Path:
    """A folder for commands that keep nothing."""
    folder = Path(tempfile.mkdtemp(prefix="rampe-guard-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def command(
    *args: str | Path, stdin: str = "", state: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run ``rampe-guard ARGS`` to its end; models are kept below ``state``."""
    return subprocess.run(
        [sys.executable, "-m", "rampe_guard", *map(str, args)],
        cwd=ROOT,
        input=stdin,
        capture_output=True,
        encoding="utf-8",
        timeout=120,
        check=False,
        env=environment(state or _nowhere()),
    )


def called(*args: str | Path, state: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The same within this process, for commands that end by themselves and start nothing."""
    out, err = io.StringIO(), io.StringIO()
    given = [str(arg) for arg in args]
    with (
        mock.patch.dict(os.environ, {} if state is None else environment(state)),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        code = main(given)
    return subprocess.CompletedProcess(given, code, out.getvalue(), err.getvalue())


Identity = tuple[int, str]
"""Pid and start time: a pid alone may be given to another process."""


def descendants(pid: int) -> set[Identity]:
    """Every process below ``pid`` that lives now, itself included."""
    parents = {int(p.name): s for p in Path("/proc").iterdir() if (s := _stat(p))}
    family = {pid} & parents.keys()
    while True:
        more = {child for child, (parent, _) in parents.items() if parent in family} - family
        if not more:
            return {(member, parents[member][1]) for member in family}
        family |= more


def children(process: Process) -> set[int]:
    """Pids of all processes below one."""
    return {pid for pid, _ in descendants(process.pid)} - {process.pid}


def living_pid(pid: int) -> bool:
    """Whether there is such a process that is no zombie."""
    return _stat(Path(f"/proc/{pid}")) is not None


def living(family: set[Identity]) -> set[int]:
    """Those of ``family`` that still run (a zombie does not)."""
    found = {(pid, _stat(Path(f"/proc/{pid}"))) for pid, _ in family}
    return {pid for pid, stat in found if stat and (pid, stat[1]) in family}


def _stat(folder: Path) -> tuple[int, str] | None:
    """Parent and start time of a process, None if it is none or gone."""
    if not folder.name.isdigit():
        return None
    with contextlib.suppress(OSError):
        fields = (folder / "stat").read_text().rpartition(")")[2].split()
        return None if fields[0] == "Z" else (int(fields[1]), fields[19])
    return None


@contextlib.contextmanager
def watched_family(process: Process) -> Iterator[Callable[[], set[Identity]]]:
    """A function that notes the descendants of ``process``; in the end all must be gone."""
    family: set[Identity] = set()

    def note() -> set[Identity]:
        family.update(descendants(process.pid))
        return family

    try:
        yield note
    finally:
        for pid in living(family) - {process.pid}:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
