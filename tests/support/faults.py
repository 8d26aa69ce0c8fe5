"""The faults that a site meets, each with what it may cost: done to a `Ground`, and measured.

A fault is a function that begins and ends it, and returns when it ended. Whatever it is, the
judge of the ground sees to it that nothing less than the alert, or that nobody watches, is shown
while the arm pushes; a fault that may not blind must not lose protection for a moment.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from tests.support.ground import STEADY_S, Ground

Act = Callable[[Ground, random.Random, float], float]
"""Do it for about so long [s]; the monotonic time at which it was over."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One of them.

    Attributes:
        name: of it.
        promise: what the guard keeps to.
        act: does it.
        seconds: how long it usually lasts [s].
        back_s: longest time until protection is back [s].
        blinds: whether protection may be lost meanwhile.
    """

    name: str
    promise: str
    act: Act
    seconds: float
    back_s: float
    blinds: bool = True


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one of them cost.

    Attributes:
        fault: which.
        held: whether the arm pushed against the crate all the while.
        lost_s: how long protection was lost [s].
        back_s: time from the end of the fault until protection was back [s].
        wrong_s: how long less than the alert was shown while the arm pushed [s].
        broken: what promise was broken, empty if none.
    """

    fault: Fault
    held: bool
    lost_s: float
    back_s: float
    wrong_s: float
    broken: str = ""


def suffer(
    ground: Ground,
    fault: Fault,
    rng: random.Random,
    *,
    held: bool,
    seconds: float | None = None,
    slow: float = 1.0,
) -> Outcome:
    """Do it, and wait until all is well again.

    Args:
        ground: calm, the machine at work.
        fault: which.
        rng: of what is left to chance.
        held: have the arm push against the crate all the while.
        seconds: how long, instead of the usual time [s].
        slow: how many times longer than promised it may take until protection is back.
    """
    if held:
        ground.hold()
    verdict = ground.verdict
    wrong_s, lost = verdict.wrong_s, len(verdict.lost)
    lasts_s = fault.seconds if seconds is None else seconds
    broken, back_s = "", float("inf")
    with ground.declared() if fault.blinds else contextlib.nullcontext():
        over_s = fault.act(ground, rng, lasts_s)
        try:
            steady_s = STEADY_S if fault.blinds else 0.2  # the others are judged all the time
            back_s = ground.back(over_s, slow * fault.back_s + 20.0, steady_s)
        except AssertionError as error:
            broken = str(error)
    ground.tell(task="work")
    lost_s = sum(b - a for a, b in verdict.lost[lost:])
    wrong_s = verdict.wrong_s - wrong_s
    if wrong_s > 0.0:
        broken = broken or f"for {wrong_s:.2f} s no alert was shown"
    if lost_s > 0.0 and not fault.blinds:
        broken = broken or f"protection was lost for {lost_s:.2f} s"
    if back_s > slow * fault.back_s:
        broken = broken or f"back only after {back_s:.2f} s, promised {fault.back_s:g} s"
    return Outcome(fault, held, lost_s, back_s, wrong_s, broken)


def router_killed(ground: Ground, rng: random.Random, seconds: float) -> float:
    """SIGKILL, away, and a new one at the same place."""
    boot = ground.witness.boot_id
    ground.router.popen.kill()
    ground.router.popen.wait()
    ground.pause(seconds * rng.uniform(0.1, 1.0))
    ground.restart_router()
    over_s = time.monotonic()
    assert ground.witness.boot_id == boot
    return over_s


@contextlib.contextmanager
def frozen(pid: int) -> Iterator[None]:
    """SIGSTOP, and SIGCONT in the end."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def router_frozen(ground: Ground, _: random.Random, seconds: float) -> float:
    """Stopped; its sockets stay open."""
    with frozen(ground.router.pid):
        ground.pause(seconds)
    return time.monotonic()


def guard_killed(ground: Ground, _: random.Random, seconds: float) -> float:
    """SIGKILL of the process that guards; over at once: the clock runs for its supervisor."""
    boot, killed_s = ground.witness.boot_id, time.monotonic()
    os.kill(ground.worker, signal.SIGKILL)
    ground.wait(lambda: ground.witness.boot_id != boot, 60.0 + seconds, "another guard")
    ground.wait(
        lambda: "guard restarted after a crash (SIGKILL)" in ground.witness.system_text(),
        10.0,
        "the restart told by an alert",
    )
    return killed_s


def guard_frozen(ground: Ground, _: random.Random, seconds: float) -> float:
    """SIGSTOP of the process that guards."""
    with frozen(ground.worker):
        ground.pause(seconds)
    return time.monotonic()


def machine_dies(ground: Ground, _: random.Random, seconds: float) -> float:
    """The publisher of both inputs is killed, and another comes later."""
    ground.machine.popen.kill()
    ground.machine.popen.wait()
    ground.pause(seconds)
    ground.restart_machine()
    return time.monotonic()


def machine_freezes(ground: Ground, _: random.Random, seconds: float) -> float:
    """It is stopped, and goes on as if nothing had been."""
    with frozen(ground.machine.pid):
        ground.pause(seconds)
    return time.monotonic()


def _stream(kind: str, **more: float) -> Act:
    def act(ground: Ground, _: random.Random, seconds: float) -> float:
        ground.tell(stream=kind, **more)
        ground.pause(seconds)
        ground.tell(stream="sound")
        return time.monotonic()

    return act


def clock_jumps(ground: Ground, rng: random.Random, seconds: float) -> float:
    """The machine's clock is an hour off, and right again later: two jumps."""
    ground.tell(offset_s=rng.choice((-3600.0, 3600.0)))
    ground.pause(seconds)
    ground.tell(offset_s=0.0)
    return time.monotonic()


def viewer_wedged(ground: Ground, _: random.Random, seconds: float) -> float:
    """A subscriber is stopped while alerts are sent to it."""
    with frozen(ground.viewer.pid):
        ground.pause(seconds)
    return time.monotonic()


FAULTS = (
    Fault(
        "router killed and restarted",
        "back within 2 s of the new router",
        router_killed,
        seconds=3.0,
        back_s=2.0,
    ),
    Fault(
        "router frozen for longer than its lease",
        "back within 2 s of its thaw",
        router_frozen,
        seconds=12.0,
        back_s=2.0,
    ),
    Fault(
        "guard killed (SIGKILL)",
        "guards again within 3 s; told by an alert that stays",
        guard_killed,
        seconds=0.0,
        back_s=3.0,
    ),
    Fault(
        "guard frozen",
        "not trusted after 1 s; back within 2 s of its thaw",
        guard_frozen,
        seconds=3.0,
        back_s=2.0,
    ),
    Fault(
        "input publisher dies",
        "not monitoring after its time-out; back 3 s after the next one speaks",
        machine_dies,
        seconds=2.0,
        back_s=3.0,
    ),
    Fault(
        "input publisher freezes",
        "not monitoring after its time-out; back within 2 s",
        machine_freezes,
        seconds=3.0,
        back_s=2.0,
    ),
    Fault(
        "inputs flood (10 kHz)",
        "guards on",
        _stream("flood", rate_hz=10_000.0),
        seconds=3.0,
        back_s=1.0,
        blinds=False,
    ),
    Fault(
        "the same message again and again",
        "not monitoring after 0.2 s; back within 1 s",
        _stream("repeat"),
        seconds=3.0,
        back_s=1.0,
    ),
    Fault(
        "messages out of order",
        "guards on",
        _stream("reorder"),
        seconds=3.0,
        back_s=1.0,
        blinds=False,
    ),
    Fault(
        "stamps jump by an hour and back",
        "not monitoring after 0.2 s; back within 2 s",
        clock_jumps,
        seconds=3.0,
        back_s=2.0,
    ),
    Fault(
        "subscriber wedged",
        "nobody else notices",
        viewer_wedged,
        seconds=5.0,
        back_s=1.0,
        blinds=False,
    ),
)
BY_NAME = {fault.name: fault for fault in FAULTS}
