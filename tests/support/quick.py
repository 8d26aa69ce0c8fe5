"""A ``rampe-guard`` that starts at once: a process that has loaded all forks for each command.

``python -m tests.support.quick SOCKET`` serves; `SHIM` is the program that stands on PATH in the
place of the real one. The command runs in the shim's folder, environment and network, with its
three streams, gets its signals, and ends it with its exit code. Loading takes seconds of
processor time, and pages of the documentation have many commands.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import pkgutil
import signal
import socket
import sys
import traceback
from pathlib import Path

SHIM = """#!{python} -SEs
import json, os, signal, socket, sys
asked = socket.socket(socket.AF_UNIX)
asked.connect("{socket}")
network = os.open("/proc/self/ns/net", os.O_RDONLY)
words = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
socket.send_fds(asked, [len(words).to_bytes(4, "big")], [0, 1, 2, network])
asked.sendall(words)
pid = int.from_bytes(asked.recv(4), "big")
for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(number, lambda number, frame: os.kill(pid, number))
code = asked.recv(1)
sys.exit(code[0] if code else 137)
"""
"""To be filled with ``python`` and ``socket``."""
_PRELOAD = (
    "rampe_guard.cli",
    "rampe_guard.runtime.daemon",
    "rampe_guard.programs",
)
_NEW_NETWORK = 0x40000000


def main() -> None:
    """Load, say ``ready``, and fork until told to stop."""
    for name in _PRELOAD:
        module = importlib.import_module(name)
        for inner in pkgutil.iter_modules(getattr(module, "__path__", ())):
            importlib.import_module(f"{name}.{inner.name}")
    threads = len(list(Path("/proc/self/task").iterdir()))
    if threads != 1:
        sys.exit(f"{threads} threads: this process cannot fork")
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    os.setpgrp()  # commands are of this group, and are ended with it
    signal.signal(signal.SIGTERM, _end)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(sys.argv[1])
        listener.listen(64)
        print("ready", flush=True)
        while True:
            asked, _ = listener.accept()
            if os.fork() == 0:
                listener.close()
                _serve(asked)
            asked.close()


def _end(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.killpg(0, signal.SIGTERM)
    os._exit(0)


def _serve(asked: socket.socket) -> None:
    """Be the command, and never return."""
    size, fds, _, _ = socket.recv_fds(asked, 4, 4)
    words = b""
    while len(words) < int.from_bytes(size, "big"):
        words += asked.recv(1 << 16)
    argv, folder, environment = json.loads(words)
    code = 70
    try:
        for number in (signal.SIGCHLD, signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
            signal.signal(number, usual)
        _join(fds[3])
        for fd, stream in zip(fds, range(3), strict=False):
            os.dup2(fd, stream)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        asked.sendall(os.getpid().to_bytes(4, "big"))
        code = _run(argv)
    except BaseException:  # noqa: BLE001 - as the interpreter would tell it
        traceback.print_exc()
        code = 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        asked.sendall(bytes([code & 0xFF]))
        os._exit(code & 0xFF)


def _join(network: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(network, _NEW_NETWORK) != 0:
        raise OSError(ctypes.get_errno(), "setns")


def _run(argv: list[str]) -> int:
    from rampe_guard.cli import main as command  # noqa: PLC0415 - loaded already

    try:
        return command(argv)
    except SystemExit as leaving:
        if isinstance(leaving.code, int) or leaving.code is None:
            return leaving.code or 0
        print(leaving.code, file=sys.stderr)
        return 1


if __name__ == "__main__":
    main()
