"""``rampe-guard init``: from a URDF, and a look at the machine at work, to a site and a scene."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from rampe_guard.collision.mesh_places import mesh_file
from rampe_guard.collision.urdf import read_urdf
from rampe_guard.collision.urdf_joints import MovableJoint
from rampe_guard.core.identify import identify
from rampe_guard.errors import SettingsError
from rampe_guard.folders import Folders
from rampe_guard.programs.checkup import checkup
from rampe_guard.programs.initing_files import SiteText, relative, scene_text, site_text
from rampe_guard.programs.initing_ground import ground_of
from rampe_guard.programs.initing_plan import ActuatorPlan, chosen_joints, joints_of, plan
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
from rampe_guard.programs.initing_table import show
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.programs.initing_writing import to_do, written
from rampe_guard.programs.measuring import Heard
from rampe_guard.programs.measuring_ros2 import in_strokes
from rampe_guard.programs.output import output_folder
from rampe_guard.runtime.stopping import StopFlag

SITE, SCENE = "site.yaml", "scene.yaml"
"""What is written into the folder."""
_STOPPED = 130
"""Exit code of a command that was told to stop, as shells have it."""


@dataclass(frozen=True, slots=True)
class _Ready:
    """What is known before anything is heard.

    Attributes:
        wishes: settled.
        joints: of the URDF.
        folder: for what is written.
        ground_m: lowest point of what stands [m].
        standing: links that stand on the ground.
        drives: cylinders, by the name of the actuator.
    """

    wishes: Wishes
    joints: list[MovableJoint]
    folder: Path
    ground_m: float
    standing: list[str]
    drives: dict[str, dict[str, Any]]


def init(wishes: Wishes, console: Console, stop: StopFlag, ask: Ask | None = None) -> int:
    """Write a site file and a scene file that can be guarded; the exit code of `check`.

    Args:
        wishes: what was asked for.
        console: for people.
        stop: ends listening early; what was heard by then counts. Else it ends everything.
        ask: asks whoever sits at the terminal; None: nobody does.

    Raises:
        SettingsError, GeometryError, LogError, ConnectionFailedError: what is wrong, and what to
            do.
    """
    ready = stop.unless_stopped(lambda: _prepared(wishes, ask))
    heard: Heard | None = None
    if ready is not None and ready.wishes.live:
        heard = heard_by(ready.wishes, [joint.name for joint in ready.joints], console, stop)
        if stop():  # which has ended the listening; whoever wants more than that says so again
            stop = StopFlag.on_signals()
    code = None if ready is None else stop.unless_stopped(lambda: _made(ready, heard, console, ask))
    if code is None:
        print("rampe-guard: stopped before it was done", file=sys.stderr)  # noqa: T201
        return _STOPPED
    return code


def _prepared(wishes: Wishes, ask: Ask | None) -> _Ready:
    """All that can be known, and be wrong, before anything is heard."""
    urdf = Path(wishes.urdf)
    joints = joints_of(urdf)
    drives = cylinders(wishes.cylinders)
    ground_m, standing = ground_of(urdf, wishes.package_dirs)  # which reads all meshes
    folder = output_folder(wishes.out)
    _refuse_overwriting(folder, wishes, SITE, SCENE)
    named = wishes.machine or str(read_urdf(urdf).name).strip() or "machine"
    wishes = replace(wishes, machine=named)
    if ask is not None:
        wishes = source_asked(wishes, ask)
    wishes = settled(wishes)
    _check_names(wishes)
    if wishes.live:
        _refuse_overwriting(folder, wishes, MEASURED)
    return _Ready(wishes, joints, folder, ground_m, standing, drives)


def _made(ready: _Ready, heard: Heard | None, console: Console, ask: Ask | None) -> int:
    """Measure, propose, write and check."""
    wishes, joints, folder = ready.wishes, ready.joints, ready.folder
    if not wishes.live:
        heard = heard_by(wishes, [joint.name for joint in joints], console, StopFlag())
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
    drives = ready.drives
    if ask is not None:
        names = names if spoken else names_asked(names, [joint.name for joint in mine], ask)
        drives = drives_asked(names, drives, ask)
    if heard is not None and heard.ros2 and drives:
        heard = in_strokes(heard, {i: drives[n] for i, n in enumerate(names) if n in drives})
        measured = identify(heard.traces)
    axes = 0 if heard is None else heard.traces.axes.shape[1]
    plans = plan(mine, names, measured, drives, axes)
    show(plans, console)
    said = _said(wishes, folder, plans, heard, sure=sure)
    texts = {
        folder / SITE: site_text(said),
        folder / SCENE: scene_text(said.site, ready.ground_m, ready.standing),
    }
    kept = f"; what was heard is in {folder / MEASURED}: give it with --log" if wishes.live else ""
    with written(texts, kept):
        console.print()
        code = checkup(str(folder / SITE), console)
    console.print(Text(f"wrote {folder / SITE} and {folder / SCENE}", "bold"))
    if first := ", ".join(filter(None, (to_do(path, text) for path, text in texts.items()))):
        measured_ = "" if measured else "; nothing was measured"
        console.print(Text(f"first look at {first}{measured_}", "bold yellow"))
    return code


def terminal() -> Ask | None:
    """Asks whoever sits at the terminal; None if nobody does."""
    return _asked if sys.stdin.isatty() and sys.stdout.isatty() else None


def _asked(question: str) -> str:
    try:
        return input(question)
    except EOFError:
        print()  # noqa: T201 - the line of the question
        raise SettingsError("no answer any more; nothing was written") from None


def _refuse_overwriting(folder: Path, wishes: Wishes, *names: str) -> None:
    there = [name for name in names if (folder / name).exists()]
    if there and not wishes.force:
        raise SettingsError(
            f"{folder} holds {', '.join(there)} already; give another folder with --out, or --force"
            " to write them anew"
        )


def _check_names(wishes: Wishes) -> None:
    """Names that no site file may have are told before anybody moves a machine for it."""
    for option, name in (("--site", wishes.site), ("--machine", wishes.machine)):
        if not name or name != name.strip() or not name.isprintable():
            raise SettingsError(f"{option} {name!r} is no name; give letters, digits and hyphens")
    if twice := [name for name in wishes.names if wishes.names.count(name) > 1]:
        raise SettingsError(f"--names: {twice[0]} is there twice; each actuator has its own")


def _said(
    wishes: Wishes,
    folder: Path,
    plans: Sequence[ActuatorPlan],
    heard: Heard | None,
    *,
    sure: bool,
) -> SiteText:
    live = heard is not None and wishes.log is None
    keys = [f"{wishes.base}/joystick", f"{wishes.base}/actuators"]
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
        base=wishes.base,
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
