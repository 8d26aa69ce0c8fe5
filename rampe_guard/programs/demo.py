"""``rampe-guard demo``: everything on this machine, each part a process of its own.

A router, a simulated excavator with its operator, and the guard talk over loopback; this
process only watches, like any dashboard would, and keeps the score with the true motion.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from rampe_guard import wire
from rampe_guard.core.alarm import Level
from rampe_guard.errors import ConnectionFailedError
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.dashboarding import need_viser
from rampe_guard.programs.scoring import closing_table
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.process import quarry_work
from rampe_guard.view.observer import Heard, Observer
from rampe_guard.view.watch import watch

_END_S = 3.0
_SCORE_S = 0.035
_TRUSTED_S = 1.0
"""A guard without a heartbeat for longer does not monitor [s]."""
_AFTERMATH_S = 0.3
"""How long the guard may still speak after the operator has gone home [s]."""


def demo(
    cycles: int,
    seed: int,
    console: Console,
    stop: StopFlag,
    port: int | None = None,
    *,
    obey: bool = False,
) -> int:
    """Run the demo; returns the exit code.

    Args:
        cycles: work cycles of the simulated operator.
        seed: of his day.
        console: where the screen and the summary go.
        stop: ends it early, with a summary of what there was.
        port: of a dashboard, which takes the place of the screen: events are lines then; None
            for none.
        obey: the machine follows the guard's speed advice.

    Raises:
        SettingsError: a dashboard is wanted whose extra is not installed.
    """
    if port is not None:
        need_viser()
    endpoint = f"tcp/127.0.0.1:{_free_port()}"
    site_path = str(shipped_site("demo"))
    site = connect_to(load_site(site_path), [endpoint])
    with contextlib.ExitStack() as stack:
        # what a simulated operator taught is nobody's way of working: it goes with the demo
        state = stack.enter_context(tempfile.TemporaryDirectory(prefix="rampe-guard-demo-"))
        start = stack.enter_context(_children(state))
        router = start("router", ["-m", "rampe_guard.runtime.router", endpoint])
        guard = start("guard", ["-m", "rampe_guard", "run", site_path, "--connect", endpoint])
        # the operator waits for the guard before he begins to work
        work = ["-m", "rampe_guard.simulate.process", "--connect", endpoint]
        work += ["--cycles", str(cycles), "--seed", str(seed), *(["--obey"] if obey else [])]
        operator = start("operator", work)
        needed = [router, guard]
        if port is not None:
            args = ["dashboard", site_path, "--connect", endpoint, "--port", str(port)]
            needed.append(start("dashboard", ["-m", "rampe_guard", *args]))
            console.print(f"dashboard on http://127.0.0.1:{port}", highlight=False)
        console.print("router, guard and operator are starting; the quarry is being loaded …")
        console.print(f"anyone may listen: --connect {endpoint}", highlight=False, soft_wrap=True)
        machine = stop.unless_stopped(lambda: load_telling(site, console.print))
        if machine is None:
            return 0
        bus = Bus.open_retrying(site.zenoh, stop, Sayer("rampe_guard.demo").info, stop.wait)
        if bus is None:
            return 0
        stack.enter_context(bus)
        observer = Observer(bus, site, machine.arm.limits)
        score = _Score(Tally(machine.sweeper, machine.sweeper.zones), operator, needed)
        console.print("watching; Ctrl-C ends the demo with a summary")
        lines = console if port is None else Console(file=console.file, force_terminal=False)
        watch(observer, stop, lines, score.take)
    done = None if stop() else cycles
    console.print(closing_table(score.tally, done, score.loop_ms))
    if obey and done:
        console.print(_price(site, score.tally, cycles, seed), highlight=False)
    return 0


def _price(site: Site, tally: Tally, cycles: int, seed: int) -> str:
    """What following the advice cost, against the same day with free levers, simulated offline."""
    free_s = list(quarry_work(site, cycles, seed))[-1].time_s / cycles
    took_s = tally.duration_s / cycles
    contacts = sum(score.contacts for score in tally.scores(Level.WARNING).values())
    return (
        f"followed the advice: {contacts} contacts; a cycle took {took_s:.1f} s, with free levers"
        f" {free_s:.1f} s ({more_words(took_s, free_s)})"
    )


def more_words(took_s: float, free_s: float) -> str:
    """How much more time one took than the other, in whole percent."""
    percent = round(100.0 * (took_s / free_s - 1.0))
    return f"{percent:+d} %" if percent else "0 %"


@dataclass
class _Score:
    """Takes what was heard to the tally, and knows when the work is over."""

    tally: Tally
    operator: subprocess.Popen[bytes]
    needed: Sequence[subprocess.Popen[bytes]]
    loop_ms: wire.Quantiles | None = None
    _last_s: float = float("-inf")
    _trusted_s: float = float("inf")
    _over_s: float | None = None

    def take(self, heard: list[Heard]) -> bool:
        """Score what was heard; True when the operator has gone and all is said."""
        for message in heard:
            if isinstance(message, wire.ActuatorsMessage) and message.stamp is not None:
                self._position(message.stamp, message.position)
            elif isinstance(message, wire.Alert) and message.zone is not None:
                level = Level[message.level.upper()]
                self.tally.alert(message.published_unix_s, message.zone, level)
            elif isinstance(message, wire.Heartbeat):
                self.loop_ms = message.loop_ms or self.loop_ms
                self._beat(message)
        if self._last_s > self._trusted_s:
            self.tally.status(self._trusted_s, monitoring=False)
        _check_alive(self.needed)
        if self._over_s is None and _gone_home(self.operator):
            self._over_s = time.monotonic()
        return self._over_s is not None and time.monotonic() - self._over_s > _AFTERMATH_S

    def _beat(self, beat: wire.Heartbeat) -> None:
        """Whether the guard watches; who keeps silent longer than he may does not."""
        told_s = beat.published_unix_s
        if told_s > self._trusted_s:
            self.tally.status(self._trusted_s, monitoring=False)
        self.tally.status(told_s, monitoring=beat.status != "not_monitoring")
        self._trusted_s = told_s + _TRUSTED_S

    def _position(self, stamp_s: float, position: Sequence[float]) -> None:
        # swept from sample to sample, so a coarser step misses nothing
        if stamp_s - self._last_s >= _SCORE_S:
            self._last_s = stamp_s
            self.tally.position(stamp_s, np.array(position))


@contextlib.contextmanager
def _children(state: str) -> Iterator[_Starter]:
    """Start processes, which keep models below ``state``; all are ended, by pid, on leaving."""
    starter = _Starter(state)
    try:
        yield starter
    finally:
        for process in reversed(starter.processes):
            process.terminate()
        for process in starter.processes:
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdout is not None:
                process.stdout.close()


def _gone_home(operator: subprocess.Popen[bytes]) -> bool:
    """The operator has said that he is done, or is no more."""
    if operator.poll() is not None:
        return True
    if operator.stdout is None:
        return False
    os.set_blocking(operator.stdout.fileno(), False)
    return bool(operator.stdout.read())


class _Starter:
    def __init__(self, state: str) -> None:
        self._state = state
        self.processes: list[subprocess.Popen[bytes]] = []

    def __call__(self, name: str, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
        # one thread each: the maths is small, and the cores are shared
        ours = {"OPENBLAS_NUM_THREADS": "1", "STATE_DIRECTORY": self._state}
        process = subprocess.Popen(  # noqa: S603 - our own modules
            [sys.executable, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if name == "operator" else subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **ours},
            start_new_session=True,  # Ctrl-C is for this process, which then ends the others
        )
        self.processes.append(process)
        return process


def _check_alive(needed: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in needed:
        if process.poll() is not None:
            raise ConnectionFailedError(
                f"process {process.pid} of the demo ended with code {process.returncode};"
                f" start it by hand to see why: {' '.join(map(str, process.args))}"  # type: ignore[arg-type]
            )


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
