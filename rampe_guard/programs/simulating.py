"""``rampe-guard simulate``: a machine where there is none, as a log or live on its keys.

The demo's machine does the demo's work. Any other, also one of which there is only a URDF, moves
each lever in turn, as who measures a machine would.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rampe_guard.collision import load_arm
from rampe_guard.collision.urdf import movable_joints, read_urdf
from rampe_guard.core.config import ActuatorConfig
from rampe_guard.errors import GeometryError, LogError, SettingsError
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.exercise import exercise
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.process import perform, quarry_work
from rampe_guard.simulate.run import Tick

LOG_HZ = 25.0
LIVE_HZ = 100.0
CYCLES = 3
"""Work cycles, or pushes of each lever each way, where nobody asks for another number."""
_SPEED, _LAG_S, _DEADBAND = 0.5, 0.12, 0.05
"""Of a joint whose URDF tells no speed [rad/s or m/s], and of every joint."""

Limits = list[tuple[float | None, float | None]]


@dataclass(frozen=True, slots=True)
class Wishes:
    """What is simulated.

    Attributes:
        arm: a site file, or a URDF.
        cycles: of the work, or pushes of each lever each way; None: endless where there is no end.
        seed: of the operator and of the noise.
    """

    arm: str
    cycles: int | None
    seed: int


def write_log(wishes: Wishes, out: str) -> str:
    """Write a CSV log of it, as fast as can be; what to tell of it.

    Raises:
        LogError: the file is there already, or cannot be written.
        RampeGuardError: the arm cannot be used.
    """
    actuators: Sequence[ActuatorConfig]
    if wishes.arm.endswith(".urdf"):
        actuators, limits = _joints(wishes.arm)
        ticks = _exercise(actuators, limits, wishes, LOG_HZ)
    else:
        site = load_site(wishes.arm)
        actuators = site.guard.actuators
        ticks = _work(site, wishes, LOG_HZ, CYCLES)
    names = [actuator.name for actuator in actuators]
    count, last_s = 0, 0.0
    try:
        with Path(out).open("x", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["t", *(f"u_{name}" for name in names), *names])
            for tick in ticks:
                levers = (tick.axes[actuator.axis] for actuator in actuators)
                row = (tick.time_s, *levers, *tick.position)
                rows.writerow([f"{value:.5g}" if value else "0" for value in row])
                count, last_s = count + 1, tick.time_s
    except FileExistsError:
        raise LogError(f"{out}: is there already; give another name, or move it away") from None
    except OSError as error:
        raise LogError(f"{out}: cannot be written: {error.strerror}") from None
    return f"{out}: {count} rows, {last_s:.0f} s; columns t, u_NAME and NAME of {', '.join(names)}"


def play(wishes: Wishes, endpoints: Sequence[str], stop: StopFlag) -> int:
    """Publish it on the keys of a site, from when its guard is there; returns the exit code.

    Raises:
        SettingsError: only a URDF is given, which names no keys.
        RampeGuardError: the arm cannot be used.
    """
    if wishes.arm.endswith(".urdf"):
        raise SettingsError(f"{wishes.arm}: a URDF names no keys; give a site file, or --out FILE")
    site = connect_to(load_site(wishes.arm), endpoints)
    perform(site, lambda: _work(site, wishes, LIVE_HZ, None), stop, Sayer("rampe_guard.simulate"))
    return 0


def _work(site: Site, wishes: Wishes, rate_hz: float, cycles: int | None) -> Iterator[Tick]:
    """What this machine does: the demo's its work, any other each lever in turn."""
    if Path(site.path).resolve() == shipped_site("demo").resolve():
        return quarry_work(site, wishes.cycles or cycles, wishes.seed, rate_hz)
    limits = load_arm(site.arm).limits.tolist()
    return _exercise(site.guard.actuators, limits, wishes, rate_hz)


def _exercise(
    actuators: Sequence[ActuatorConfig], limits: Limits, wishes: Wishes, rate_hz: float
) -> Iterator[Tick]:
    machine = build_machine(actuators, limits)
    pushes = wishes.cycles or CYCLES
    return exercise(actuators, machine, rate_hz=rate_hz, pushes=pushes, seed=wishes.seed)


def _joints(path: str) -> tuple[list[ActuatorConfig], Limits]:
    """Every joint of a URDF that somebody could drive."""
    actuators: list[ActuatorConfig] = []
    limits: Limits = []
    for place, joint in enumerate(movable_joints(read_urdf(Path(path)))):
        speed = joint.velocity or _SPEED
        unit = "m" if joint.kind == "prismatic" else "rad"
        actuators.append(
            ActuatorConfig(joint.name, place, 1, speed, 2.0 * speed, _LAG_S, _DEADBAND, unit)
        )
        limits.append((joint.lower, joint.upper))
    if not actuators:
        raise GeometryError(f"{path}: no joint that could be driven; nothing to simulate")
    return actuators, limits
