"""``rampe-guard init``: from a URDF, and a look at the machine at work, to a site and a scene."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rampe_guard.collision.mesh_places import mesh_file
from rampe_guard.collision.urdf import read_urdf
from rampe_guard.core.identify import identify
from rampe_guard.errors import SettingsError
from rampe_guard.folders import Folders
from rampe_guard.programs.checkup import checkup
from rampe_guard.programs.initing_files import SiteText, relative, scene_text, site_text
from rampe_guard.programs.initing_ground import ground_of
from rampe_guard.programs.initing_plan import ActuatorPlan, Said, chosen_joints, joints_of, plan
from rampe_guard.programs.initing_questions import (
    Ask,
    cylinders,
    drives_asked,
    names_asked,
    source_asked,
)
from rampe_guard.programs.initing_ros2 import block_of, settled, speech
from rampe_guard.programs.initing_source import (
    MEASURED,
    heard_by,
    kept_log,
    tell_heard,
    timeout_of,
)
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.programs.measuring import Heard
from rampe_guard.programs.measuring_ros2 import in_strokes
from rampe_guard.programs.output import output_folder
from rampe_guard.runtime.stopping import StopFlag

SITE, SCENE = "site.yaml", "scene.yaml"
"""What is written into the folder."""


def init(wishes: Wishes, console: Console, stop: StopFlag, ask: Ask | None = None) -> int:
    """Write a site file and a scene file, then check them; the exit code of `check`.

    Args:
        wishes: what was asked for.
        console: for people.
        stop: ends listening early; what was heard by then counts.
        ask: asks whoever sits at the terminal; None: nobody does.

    Raises:
        SettingsError, GeometryError, LogError, ConnectionFailedError: what is wrong, and what to
            do.
    """
    urdf = Path(wishes.urdf)
    joints = joints_of(urdf)
    ground_m, standing = ground_of(urdf, wishes.package_dirs)  # which reads all meshes
    folder = output_folder(wishes.out)
    _refuse_overwriting(folder, wishes)
    wishes = replace(wishes, machine=wishes.machine or str(read_urdf(urdf).name) or "machine")
    if ask is not None:
        wishes = source_asked(wishes, ask)
    wishes = settled(wishes)
    heard = heard_by(wishes, [joint.name for joint in joints], console, stop)
    measured = () if heard is None else identify(heard.traces)
    if heard is not None:
        tell_heard(heard, measured, console)
    count = len(wishes.joints or joints) if heard is None else heard.traces.position.shape[1]
    spoken = None if heard is None or heard.ros2 else heard.traces.names
    hints = None if heard is None else heard.traces.names or heard.column_names
    mine, sure = chosen_joints(joints, count, wishes.joints, hints, wishes.urdf)
    names = list(wishes.names or spoken or [joint.name.removesuffix("_joint") for joint in mine])
    if len(names) != count:
        raise SettingsError(f"--names gives {len(names)} names for {count} actuators")
    drives = cylinders(wishes.cylinders)
    if ask is not None:
        names = names if spoken else names_asked(names, [joint.name for joint in mine], ask)
        drives = drives_asked(names, drives, ask)
    if heard is not None and heard.ros2 and drives:
        heard = in_strokes(heard, {i: drives[n] for i, n in enumerate(names) if n in drives})
        measured = identify(heard.traces)
    axes = 0 if heard is None else heard.traces.axes.shape[1]
    plans = plan(mine, names, measured, drives, axes)
    console.print(_table(plans))
    for one in plans:
        for problem in one.problems:
            console.print(Text(f"note: {one.name}: {problem}", "yellow"))
    said = _said(wishes, folder, plans, heard, sure=sure)
    text = site_text(said)
    scene = scene_text(said.site, ground_m, standing)
    _write(folder / SITE, text)
    _write(folder / SCENE, scene)
    console.print(Text(f"wrote {folder / SITE} and {folder / SCENE}", "bold"))
    for name, written in ((SITE, text), (SCENE, scene)):
        todo = sum("TODO" in line for line in written.splitlines() if not line.startswith("# "))
        if todo:
            lines = "line needs" if todo == 1 else "lines need"
            console.print(f"{todo} {lines} a look in {folder / name}: TODO", highlight=False)
    console.print()
    return checkup(str(folder / SITE), console)


def terminal() -> Ask | None:
    """Asks whoever sits at the terminal; None if nobody does."""
    return _asked if sys.stdin.isatty() and sys.stdout.isatty() else None


def _asked(question: str) -> str:
    try:
        return input(question)
    except EOFError:
        print()  # noqa: T201 - the line of the question
        raise SettingsError("no answer any more; nothing was written") from None


def _refuse_overwriting(folder: Path, wishes: Wishes) -> None:
    there = [name for name in (SITE, SCENE, MEASURED) if (folder / name).exists()]
    if there and not wishes.force:
        raise SettingsError(
            f"{folder} holds {', '.join(there)} already; give another folder with --out, or --force"
            " to write them anew"
        )


def _said(
    wishes: Wishes,
    folder: Path,
    plans: Sequence[ActuatorPlan],
    heard: Heard | None,
    *,
    sure: bool,
) -> SiteText:
    live = heard is not None and wishes.log is None
    base = f"rampe/{wishes.site}/{wishes.machine}".replace(" ", "-")
    keys = [f"{base}/joystick", f"{base}/actuators"]
    ros2 = block_of(wishes) if wishes.format == "ros2" else None
    if ros2 is not None:
        keys = list(speech(wishes).said.values())
    log: dict[str, Any] | None = None
    if heard is not None:
        log = kept_log(folder, heard, plans, live=live)
        if heard.columns is None:
            keys = [heard.joystick, heard.actuators]
    packages = tuple(relative(folder, Path(one)) for one in wishes.package_dirs)
    origin = f"{Path(wishes.urdf).name}" + ("" if heard is None else f" and {heard.origin}")
    return SiteText(
        ros2=ros2,
        site=wishes.site,
        machine=wishes.machine,
        joystick=keys[0],
        actuators=keys[1],
        origin=origin,
        urdf=relative(folder, Path(wishes.urdf)),
        package_dirs=packages,
        allow=_allowed(folder, Path(wishes.urdf), wishes.package_dirs),
        plans=plans,
        order_sure=sure,
        connect=wishes.connect,
        plain=wishes.plain_network,
        timeout_s=None if heard is None else timeout_of(heard),
        log=log,
    )


def _allowed(folder: Path, urdf: Path, package_dirs: tuple[str, ...]) -> tuple[str, ...]:
    """Folders of the URDF and its meshes that are not below the site's, none within another."""
    needed = {urdf.resolve().parent}
    for link in read_urdf(urdf).links:
        for shape in link.collisions or link.visuals:
            if shape.geometry.mesh is not None:
                file = mesh_file(shape.geometry.mesh.filename, urdf, None, package_dirs)
                needed.add(file.resolve().parent)
    home = Folders.of(folder)
    outside = [one for one in sorted(needed) if not home.hold(one)]
    least = [one for one in outside if not any(up in outside for up in one.parents)]
    return tuple(relative(folder, one) for one in least)


def _table(plans: Sequence[ActuatorPlan]) -> Table:
    table = Table(title="proposed; ? is not measured", title_justify="left", title_style="bold")
    table.box, table.pad_edge = None, False
    columns = ("name", "joint", "axis", "top speed", "braking", "lag", "deadband", "seen")
    for column in columns:
        table.add_column(column, header_style="dim", overflow="fold")
    for one in plans:
        axis = f"{'+' if one.sign.value > 0 else '-'}{one.axis.value}"
        table.add_row(
            one.name,
            one.joint.name,
            _shown(one.axis, axis),
            _shown(one.max_velocity, f"{one.max_velocity.value:g} {one.unit}/s"),
            _shown(one.max_deceleration, f"{one.max_deceleration.value:g} {one.unit}/s²"),
            _shown(one.lag_s, f"{one.lag_s.value:g} s"),
            _shown(one.deadband, f"{one.deadband.value:g}"),
            one.seen or "-",
        )
    return table


def _shown(said: Said, text: str) -> str:
    return f"{text} ?" if said.todo else text


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise SettingsError(f"{path}: cannot be written ({error.strerror})") from None
