"""A small arm of primitives, of which nothing but the URDF is known; and its machine."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Iterable
from pathlib import Path

from rampe_guard.core.config import ActuatorConfig
from rampe_guard.simulate.exercise import exercise
from rampe_guard.simulate.machine import Machine, build_machine
from rampe_guard.simulate.run import Tick

URDF = Path(__file__).with_name("small_arm.urdf")

ACTUATORS = (
    ActuatorConfig("turn", 2, 1, 0.9, 1.8, 0.12, 0.08, "rad"),
    ActuatorConfig("lift", 0, -1, 0.5, 1.0, 0.16, 0.12, "rad"),
    ActuatorConfig("reach", 1, 1, 0.3, 0.6, 0.2, 0.05, "m"),
)
"""What the machine is like; the levers stand in another order than the actuators."""
LIMITS = ((-2.5, 2.5), (-0.5, 1.2), (0.0, 0.5))


LEVERS = {a.name: (a.axis, a.sign) for a in ACTUATORS}


def told_levers(site: Path) -> dict[str, tuple[int, int]]:
    """Axis and sign of each actuator of which a site file says that they were measured."""
    told = {}
    for block in site.read_text("utf-8").split("    - name: ")[1:]:
        lines = dict(re.findall(r"^ +(axis|sign): (.*)$", block, re.MULTILINE))
        if "TODO" not in lines["axis"] + lines["sign"]:
            axis, sign = (int(lines[name].split()[0]) for name in ("axis", "sign"))
            told[block.split()[0]] = axis, sign
    return told


def machine() -> Machine:
    """The machine of `ACTUATORS`."""
    return build_machine(ACTUATORS, LIMITS)


def ticks(rate_hz: float = 50.0, pushes: int = 2) -> list[Tick]:
    """Each lever moved in turn."""
    return list(exercise(ACTUATORS, machine(), rate_hz=rate_hz, pushes=pushes))


def write_urdf(folder: Path) -> Path:
    """The URDF, copied there."""
    return Path(shutil.copy(URDF, folder))


def write_log(path: Path, moments: Iterable[Tick]) -> Path:
    """A CSV log with columns t, a0, a1, a2, turn, lift, reach."""
    with path.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["t", "a0", "a1", "a2", *(a.name for a in ACTUATORS)])
        for tick in moments:
            out.writerow([f"{v:.6f}" for v in (tick.time_s, *tick.axes, *tick.position)])
    return path
