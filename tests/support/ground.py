"""The proving ground: router, supervised guard, scripted machine, viewer, and a judge.

All are processes of their own, so each can be killed, frozen and started anew. The judge
compares, twenty times a second, what the machine does with what a consumer of the alerts would
show. While the arm pushes against the crate, that must be an imminent alert, or that nobody
watches: anything else is *wrong*. Protection may be lost only within a declared fault; if it
is lost otherwise, that is *unexplained*.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.processes import Process
from tests.support.witness import LOST, Witness

ZONE = "crate"
TICK_S = 0.05
STEADY_S = 1.3
"""Protection that is lost again sooner was never back: longer than a time-out of the inputs."""
NOTES = 20
GRACE_S = 0.3
"""How long the arm may push before the alert must be shown: it should have stood long before."""


@dataclass
class Verdict:
    """What the judge saw.

    Attributes:
        pushes: how often the arm pushed against the crate.
        warned: of these, how often the imminent alert stood in time.
        unwatched: how often protection was known to be lost instead.
        missed: neither of both, with when [s].
        wrong_s: time for which less than imminent was shown while it pushed, after the grace [s].
        notes: what was shown then, and by which alert, for whoever looks into it.
        leads_s: how long before the push the alert stood [s].
        lost: intervals of lost protection (from, to) [s].
        unexplained: those that no declared fault explains.
    """

    pushes: int = 0
    warned: int = 0
    unwatched: int = 0
    missed: list[float] = field(default_factory=list)
    wrong_s: float = 0.0
    notes: list[str] = field(default_factory=list)
    leads_s: list[float] = field(default_factory=list)
    lost: list[tuple[float, float]] = field(default_factory=list)
    unexplained: list[tuple[float, float]] = field(default_factory=list)


class Ground:
    """Everything that runs; use `proving_ground`."""

    def __init__(
        self,
        folder: Path,
        site_path: Path,
        *,
        rate_hz: float,
        seed: int,
        clock: Path | None,
        routers: int,
    ) -> None:
        self.folder, self.site_path, self.clock = folder, site_path, clock
        self.site = load_site(site_path)
        self.endpoints = [processes.free_endpoint() for _ in range(routers)]
        self.endpoint = self.endpoints[0]
        self.rate_hz, self._seed = rate_hz, seed
        self.verdict = Verdict()
        self._truth = folder / "truth.jsonl"
        self._read = 0
        self._pressed_s: float | None = None
        self._judged = True
        self._last_s = time.monotonic()
        self._lost_s: float | None = None
        self._windows: list[tuple[float, float | None]] = []
        self._stack = contextlib.ExitStack()
        try:
            self._start()
        except BaseException:
            self._stack.close()
            raise

    def _start(self) -> None:
        self.routers = [self._keep(self._new_router(n)) for n in range(len(self.endpoints))]
        self.machine = self._keep(self._new_machine())
        # it prefers the last: what it hears has gone from one router to the other
        witness = Witness(self.endpoints[::-1], self.site.keys.base)
        self.witness = self._stack.enter_context(witness)
        self.viewer = self._keep(self._new_viewer())
        self.guard = self._keep(self._new_guard())
        self._worker = processes.guarding(self.guard)

    def _keep(self, process: Process) -> Process:
        self._stack.callback(self._end, process)
        return process

    @staticmethod
    def _end(process: Process) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGCONT)
        process.close()

    def _new_machine(self) -> Process:
        words = ["-m", "tests.support.pusher", ",".join(self.endpoints), str(self.site_path)]
        more = [str(self._truth), "--rate", str(self.rate_hz), "--seed", str(self._seed)]
        process = Process(self.folder, "machine", [*words, *more], talk=True)
        return processes.started(process, "ready")

    def _new_guard(self) -> Process:
        if self.clock is None:
            more = self._connect()[2:]
            return processes.guard(self.folder, self.site_path, self.endpoint, *more)
        words = ["-m", "tests.support.clock_guard", str(self.clock), "run", str(self.site_path)]
        process = Process(self.folder, "guard", [*words, *self._connect()])
        return processes.started(process, "guarding on")

    def _new_viewer(self) -> Process:
        words = ["-m", "rampe_guard", "watch", str(self.site_path), "--json"]
        return Process(self.folder, "viewer", [*words, *self._connect()])

    def _connect(self) -> list[str]:
        return [word for endpoint in self.endpoints for word in ("--connect", endpoint)]

    def _new_router(self, number: int) -> Process:
        """One of several is linked to the one behind it, and links itself again and again."""
        if len(self.endpoints) == 1:
            return processes.router(self.folder, self.endpoint)
        retry = {"period_init_ms": 100, "period_max_ms": 500}
        others = self.endpoints[number + 1 :]
        config = {
            "mode": "router",
            "listen": {"endpoints": [self.endpoints[number]]},
            "connect": {"endpoints": others, "exit_on_failure": False, "retry": retry},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        }
        path = self.folder / f"router-{number}.json5"
        path.write_text(json.dumps(config), "utf-8")
        words = ["-m", "rampe_guard.runtime.router", "--config", str(path)]
        process = Process(self.folder, f"router-{number}", words)
        return processes.started(process, "ready")

    # What is done to it.

    def tell(self, **words: object) -> None:
        """Change what the machine does; see `tests.support.pusher`."""
        self.machine.tell(json.dumps(words))

    @property
    def router(self) -> Process:
        """The first of them."""
        return self.routers[0]

    def restart_router(self, number: int = 0) -> None:
        """A new router at the same place; returns when it listens."""
        self.routers[number] = self._keep(self._new_router(number))

    def restart_machine(self) -> None:
        """A new process that moves the machine, at rest."""
        self._seed += 1
        self.machine = self._keep(self._new_machine())

    @property
    def worker(self) -> int:
        """Pid of the process that guards; it changes when the guard is started anew."""
        if not processes.living_pid(self._worker):
            self._worker = processes.guarding(self.guard)
        return self._worker

    @contextlib.contextmanager
    def declared(self) -> Iterator[None]:
        """A fault: protection may be lost meanwhile."""
        self._windows.append((time.monotonic(), None))
        try:
            yield
        finally:
            self.tick()
            self._windows[-1] = (self._windows[-1][0], time.monotonic())

    def ask(self, word: str, payload: bytes | None = None) -> list[dict[str, Any]]:
        """Query the guard, and go on judging meanwhile; the answers."""
        key = f"{self.site.keys.base}/{word}"
        with ThreadPoolExecutor(1) as pool:
            answers = pool.submit(self.witness.ask, key, payload)
            while not answers.done():
                self.tick()
                time.sleep(TICK_S / 10)
            return answers.result()

    # What is seen.

    @property
    def pressed(self) -> bool:
        """The arm pushes against the crate now, as far as the machine has told."""
        return self._pressed_s is not None

    def shown(self) -> str:
        """What a consumer shows of the crate."""
        return self.witness.shown(ZONE)

    def tick(self) -> None:
        """Judge the present moment."""
        now_s = time.monotonic()
        passed_s, self._last_s = now_s - self._last_s, now_s
        self._follow_truth()
        self.witness.refresh()
        shown = self.shown()
        self._note_lost(now_s, lost=shown == LOST)
        since_s = self._pressed_s
        if since_s is None or now_s - since_s <= GRACE_S:
            return
        verdict = self.verdict
        if shown not in ("imminent", LOST):
            verdict.wrong_s += min(passed_s, now_s - since_s - GRACE_S)
            if len(verdict.notes) < NOTES:
                newest = self.witness.newest(ZONE)
                verdict.notes.append(f"{now_s - since_s:.2f} s after a push: {shown}: {newest}")
        if self._judged:
            return
        self._judged = True
        verdict.pushes += 1
        if shown == "imminent":
            verdict.warned += 1
            raised_s = self.witness.raised_s(ZONE)
            if raised_s is not None:
                verdict.leads_s.append(since_s - raised_s)
        elif shown == LOST:
            verdict.unwatched += 1
        else:
            verdict.missed.append(since_s)

    def wait(self, found: Callable[[], bool], within_s: float, what: str) -> float:
        """Go on judging until ``found``; when that was [s].

        Raises:
            AssertionError: not within the time.
        """
        deadline_s = time.monotonic() + within_s
        while True:
            self.tick()
            if found():
                return time.monotonic()
            if time.monotonic() > deadline_s:
                raise AssertionError(
                    f"not within {within_s:g} s: {what}; shown {self.shown()},"
                    f" heartbeat {json.dumps(self.witness.beats.newest)[:1500]}"
                )
            time.sleep(TICK_S / 5)

    def pause(self, seconds: float) -> None:
        """Go on judging for a while."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self.tick()
            time.sleep(min(TICK_S, left_s))

    def hold(self) -> None:
        """Have the arm push against the crate and stay there."""
        self.tell(task="hold")
        self.wait(
            lambda: self.pressed and self.shown() == "imminent", 20.0, "an alert at the crate"
        )

    def back(self, since_s: float, within_s: float, steady_s: float = STEADY_S) -> float:
        """Wait until the guard watches again, and goes on so; how long that took [s].

        Args:
            since_s: when the fault was over [s].
            within_s: fail after this time [s].
            steady_s: for how long it must go on so [s].
        """

        def watches() -> bool:
            if self.witness.status(since_s) not in ("ok", "degraded"):
                return False
            shown = self.shown()
            return shown == "imminent" if self.pressed else shown != LOST

        deadline_s = time.monotonic() + within_s
        while True:
            left_s = max(deadline_s - time.monotonic(), 0.0)
            back_s = self.wait(watches, left_s, "protection back")
            while watches() and time.monotonic() - back_s < steady_s:
                self.pause(TICK_S)
            if watches():
                return max(back_s - since_s, 0.0)

    def _follow_truth(self) -> None:
        with self._truth.open("rb") as told:
            told.seek(self._read)
            lines = told.read()
        whole = lines.rpartition(b"\n")[0]
        if not whole:
            return
        self._read += len(whole) + 1
        for line in whole.splitlines():
            word = json.loads(line)
            self._pressed_s = word["at_s"] if word["pressed"] else None
            self._judged = not word["pressed"]

    def _note_lost(self, now_s: float, *, lost: bool) -> None:
        if lost and self._lost_s is None:
            self._lost_s = now_s
        elif not lost and self._lost_s is not None:
            span = self._lost_s, now_s
            self._lost_s = None
            self.verdict.lost.append(span)
            if not any(
                a - 0.1 <= span[1] and (b is None or span[0] <= b) for a, b in self._windows
            ):
                self.verdict.unexplained.append(span)

    def close(self) -> None:
        """End all that was started."""
        self._note_lost(time.monotonic(), lost=False)
        self._stack.close()


@contextlib.contextmanager
def proving_ground(
    folder: Path,
    site_path: Path,
    *,
    rate_hz: float = 100.0,
    seed: int = 1,
    clock: Path | None = None,
    routers: int = 1,
) -> Iterator[Ground]:
    """Start all and wait until the guard watches; end all.

    Args:
        folder: for logs and all that is kept.
        site_path: of the bench site or a copy of it.
        rate_hz: of the machine's messages.
        seed: of what the machine does.
        clock: a file that says by how much the guard's wall clock is off [s]; without it the guard
            is the shipped program.
        routers: how many; everybody knows all of them.
    """
    ground = Ground(folder, site_path, rate_hz=rate_hz, seed=seed, clock=clock, routers=routers)
    try:
        ground.wait(lambda: ground.witness.status(0.0) == "ok", 30.0, "status ok")
        ground.verdict = Verdict()
        yield ground
    finally:
        ground.close()
