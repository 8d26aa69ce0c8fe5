"""``rampe-guard check``: can this site be guarded? Files, meshes, kinematics, scene, keys."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from rampe_guard.assembly import Machine
from rampe_guard.core.scene import ActuatorLimit, SceneObject
from rampe_guard.core.types import FloatArray, ZoneSweep
from rampe_guard.programs.checkup_gaps import gaps, suspects
from rampe_guard.programs.checkup_live import Findings, Live, live_check
from rampe_guard.programs.checkup_reach import Reach, reaches
from rampe_guard.programs.ros2_tools import topics
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.store import model_path
from rampe_guard.runtime.zenoh_io import check_configuration
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.network import shown


def checkup(
    site_path: str, console: Console, picture: str | None = None, live: Live | None = None
) -> int:
    """Load everything a guard would load and print what it is; 0 when all of it is usable.

    What may be meant but is mostly a mistake begins with "look:" and is counted in the last line,
    so that nobody reads only "ok".

    Args:
        site_path: the site file.
        console: for people.
        picture: file for a picture of the arm among its zones.
        live: how to hear the machine too, if it should be.

    Raises:
        SettingsError, GeometryError: what is wrong, and where.
    """
    site = load_site(site_path)
    check_configuration(site.zenoh)
    with _warnings_heard() as heard:
        machine = load_telling(site)
    pose = resting_pose(machine.arm.limits)
    console.print(Text(f"{site.machine} at {site.name}", "bold"), Text(f"  {site.path}", "dim"))
    reach = reaches(machine)
    zones = _zones(machine, pose, reach)
    for table in (_keys(site), _actuators(machine), _links(machine), zones):
        console.print()
        console.print(table)
    console.print()
    for remark in gaps(machine):
        console.print(Text(f"note: {remark}", "yellow"))
    looks = [*suspects(machine, reach), *heard]
    for remark in looks:
        console.print(Text(f"look: {remark}", "bold yellow"))
    if picture is not None:
        from rampe_guard.programs.checkup_picture import draw  # noqa: PLC0415 - it takes a second

        draw(machine, pose, picture)
        console.print(f"picture: {picture}", highlight=False)
    found = Findings()
    if live is not None:
        found = live_check(site, machine.arm.limits, live, console)
    code, words = verdict(len(looks), found)
    console.print(Text(words, "bold red" if code else "bold"))
    return code


def verdict(looks: int, found: Findings) -> tuple[int, str]:
    """The exit code, and the last words: the only ones that are read by many.

    Args:
        looks: lines on the files that begin with "look:".
        found: what was heard of the machine.
    """
    if found.deaf:
        return 2, "not ok: without these inputs nothing can be guarded"
    if found.wrong:
        lines = _count(len(found.wrong))
        return 2, f"not ok: machine and site file contradict each other: mend {lines} wrong:"
    looks += len(found.looks)
    if looks:
        return 0, f"ok: this site can be guarded, but look at {_count(looks)} look:"
    return 0, "ok: this site can be guarded"


def _count(lines: int) -> str:
    if lines == 1:
        return "the line above that begins with"
    return f"the {lines} lines above that begin with"


@contextmanager
def _warnings_heard() -> Iterator[list[str]]:
    """What is logged as a warning meanwhile, such as a cache that cannot be written."""
    words: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: words.append(record.getMessage())  # type: ignore[method-assign]
    log = logging.getLogger("rampe_guard")
    log.addHandler(handler)
    try:
        yield words
    finally:
        log.removeHandler(handler)


def resting_pose(limits: FloatArray) -> FloatArray:
    """Middle of every actuator's travel (n,); 0 where it is endless."""
    bounded = np.isfinite(limits).all(axis=1)
    pose = np.zeros(len(limits))
    pose[bounded] = limits[bounded].mean(axis=1)
    return pose


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, header_style="dim", overflow="fold")
    return table


def _keys(site: Site) -> Table:
    table = _table("keys and files", "what", "where")
    table.add_row("joystick", site.keys.joystick)
    table.add_row("actuators", site.keys.actuators)
    for direction, topic, kind, _ in () if site.ros2 is None else topics(site):
        table.add_row(f"ROS 2 {direction}", f"{topic} ({kind})")
    if site.keys.enabled is not None:
        table.add_row("switched on or off", site.keys.enabled)
    for item in site.scene.moving:
        table.add_row(f"poses of {item.name}", item.key)
    table.add_row("published under", site.keys.base)
    table.add_row(
        "zenoh",
        site.zenoh.config or f"{site.zenoh.mode} {' '.join(map(shown, site.zenoh.connect))}",
    )
    table.add_row("learned models", str(model_path(site)) if site.memory.enabled else "not kept")
    return table


def _actuators(machine: Machine) -> Table:
    table = _table("actuators", "name", "axis", "joint", "drive", "limits", "top speed", "lag")
    described = machine.site.arm.joints
    for j, actuator in enumerate(machine.site.guard.actuators):
        low, high = machine.arm.limits[j]
        travel = f"{low:.3g} … {high:.3g} {actuator.unit}" if np.isfinite(high - low) else "endless"
        joint = described[j]
        table.add_row(
            actuator.name,
            f"{'+' if actuator.sign > 0 else '-'}{actuator.axis}",
            joint.joint,
            type(joint.drive).__name__.removesuffix("Drive").lower(),
            travel,
            f"{actuator.max_velocity:g} {actuator.unit}/s",
            f"{actuator.lag_s:g} s",
        )
    return table


def _links(machine: Machine) -> Table:
    table = _table("links", "name", "triangles")
    for name, mesh in zip(machine.arm.link_names, machine.arm.meshes, strict=True):
        table.add_row(name, "-" if mesh is None else str(len(mesh.faces)))
    return table


def _zones(machine: Machine, pose: FloatArray, reach: Mapping[str, Reach]) -> Table:
    title = "zones, with the arm in the middle of its travel, and in postures at random"
    table = _table(title, "name", "type", "margin", "clearance", "met")
    swept = {z.zone: z for z in machine.sweeper.sweep(pose, np.zeros_like(pose)).zones}
    for zone in machine.site.scene.objects:
        where = _where(swept[zone.name], _unit(machine, zone))
        if not isinstance(zone, ActuatorLimit) and zone.key is not None:
            where = f"moves: unknown without a pose newer than {zone.timeout_s:g} s"
        margin = "" if isinstance(zone, ActuatorLimit) else f"{zone.margin_m:g} m"
        met = reach[zone.name].words
        table.add_row(zone.name, type(zone).__name__, margin, where, met)
    margin_m = machine.site.self_collision.margin_m
    for name in machine.sweeper.zones[len(machine.site.scene.objects) :]:
        where, met = _where(swept[name], "m"), reach[name].words
        table.add_row(name, "the arm itself", f"{margin_m:g} m", where, met)
    return table


def _where(found: ZoneSweep, unit: str) -> str:
    """How far the arm is from a zone, in words."""
    if found.inside:
        return f"the arm is inside ({found.link or 'actuator'})"
    near = found.clearance_now_m
    return "unknown" if near is None else f"{near:.2f} {unit} clear"


def _unit(machine: Machine, zone: SceneObject) -> str:
    if isinstance(zone, ActuatorLimit):
        return machine.site.guard.actuators[zone.actuator].unit
    return "m"
