"""``rampe-guard scene import``: what a site has already, as keep-out objects of a scene file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from rampe_guard.core.rotation import rotation_of_rpy
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import SettingsError
from rampe_guard.runtime.loading import StatusLine, say_to_stderr
from rampe_guard.scene_tools.cloud import CloudWishes, Tell, import_cloud
from rampe_guard.scene_tools.cloud_read import has_faces
from rampe_guard.scene_tools.draft import Common, Draft, Names
from rampe_guard.scene_tools.meshes import Up, import_mesh
from rampe_guard.scene_tools.moveit import import_moveit
from rampe_guard.scene_tools.plan import import_plan
from rampe_guard.scene_tools.scene_text import SceneText, folders_of
from rampe_guard.scene_tools.solid_mesh import IfOpen
from rampe_guard.scene_tools.write import Target, write_scene
from rampe_guard.settings import load_site
from rampe_guard.settings.scene_model import MAX_OBJECTS

KINDS: Final = ("moveit", "mesh", "cloud", "plan")
_BY_ENDING: Final = {
    ".scene": "moveit",
    **dict.fromkeys((".stl", ".obj", ".glb", ".gltf", ".dae", ".off"), "mesh"),
    **dict.fromkeys((".las", ".laz", ".xyz", ".txt", ".csv", ".pts"), "cloud"),
    **dict.fromkeys((".geojson", ".json"), "plan"),
}
_MEANT_FOR: Final = {
    "scale": ("mesh", "cloud"),
    "up": ("mesh",),
    "if_open": ("moveit", "mesh"),
    "origin": ("plan",),
    "metres": ("plan",),
    **dict.fromkeys(
        ("voxel", "max_objects", "crop", "ground", "min_points", "skip_invalid", "without_arm",
         "at", "arm_margin_m"), ("cloud",)
    ),
}  # fmt: skip
"""Options that mean nothing elsewhere; whoever gives one there expects what does not happen."""
DEFAULT_VOXEL_M: Final = 0.1
DEFAULT_OBJECTS: Final = 300
_ARM_STEP: Final = 0.25
_TOLD_AGAIN_S: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """The command line of an import; None or False where an option was not given."""

    file: str
    out: str
    append: bool = False
    replace: bool = False
    kind: str | None = None
    name: str | None = None
    xyz: Sequence[float] = (0.0, 0.0, 0.0)
    rpy: Sequence[float] = (0.0, 0.0, 0.0)
    margin_m: float | None = None
    ignore_link: Sequence[str] = ()
    allow: Sequence[str] = ()
    scale: float | None = None
    up: Up | None = None
    if_open: IfOpen | None = None
    voxel: float | None = None
    max_objects: int | None = None
    crop: Sequence[float] | None = None
    ground: float | None = None
    min_points: int | None = None
    skip_invalid: bool = False
    without_arm: str | None = None
    at: Sequence[float] | None = None
    arm_margin_m: float | None = None
    origin: Sequence[float] | None = None
    metres: bool = False

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Wishes:
        """Those among the options of a command line."""
        return cls(**{part.name: options[part.name] for part in fields(cls)})


def import_scene(wishes: Wishes) -> int:
    """Import a file; what was found is said on stderr, what was written on stdout.

    Raises:
        SettingsError, GeometryError: what is wrong, with the file; nothing is written then.
        RampeGuardError: it cannot be written.
    """
    kind = _kind(wishes)
    target = _target(wishes)
    old = () if target.before is None else target.before.scene.objects
    names = Names(item.name for item in old)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation_of_rpy(wishes.rpy), wishes.xyz
    own = wishes.margin_m if wishes.append else None  # else the whole scene has it
    common = Common(pose, own, tuple(wishes.ignore_link))
    margin_m = wishes.margin_m or 0.0
    line = StatusLine(sys.stderr, say_to_stderr, again_s=_TOLD_AGAIN_S)
    line.show(f"{wishes.file}: reading", at_once=True)
    try:
        draft = _draft(kind, wishes, names, common, MAX_OBJECTS - len(old), line.show)
        line.clear()  # what was found is worth knowing before it is written, and if it cannot be
        for note in draft.notes:
            sys.stderr.write(f"note: {note}\n")
        line.show(f"{wishes.out}: checking and writing", at_once=True)
        scene = write_scene(draft, target, source=Path(wishes.file).name, margin_m=margin_m)
    finally:
        line.clear()
    if not wishes.append and not margin_m:
        sys.stderr.write("note: margin_m is 0, so only touching is contact; give --margin-m\n")
    added = f", {len(scene.objects)} in all" if old else ""
    count = "1 object" if len(draft.objects) == 1 else f"{len(draft.objects)} objects"
    sys.stdout.write(f"{wishes.out}: {count} from {wishes.file}{added}\n")
    return 0


def _kind(wishes: Wishes) -> str:
    ending = Path(wishes.file).suffix.lower()
    kind = wishes.kind or _BY_ENDING.get(ending)
    if kind is None and ending == ".ply":
        kind = "mesh" if has_faces(Path(wishes.file)) else "cloud"
    if kind is None:
        known = ", ".join([*_BY_ENDING, ".ply"])
        raise SettingsError(
            f"{wishes.file}: its ending is none of {known}; say what it is with --kind"
        )
    for option, kinds in _MEANT_FOR.items():
        given = getattr(wishes, option)
        if given is not None and given is not False and kind not in kinds:
            flag = "--" + option.replace("_", "-")
            raise SettingsError(
                f"{wishes.file}: {flag} means nothing for a {kind}, only for a"
                f" {' or '.join(kinds)}; leave it out, or correct --kind"
            )
    return kind


def _target(wishes: Wishes) -> Target:
    path = Path(wishes.out)
    folders = folders_of(path, tuple(wishes.allow))
    if wishes.append:
        return Target(path, SceneText.read(path, folders), folders)
    if path.exists() and not wishes.replace:
        raise SettingsError(f"{path}: is there already; say --append or --replace")
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: there is no folder {str(path.parent)!r}; make it first")
    return Target(path, None, folders)


def _draft(kind: str, wishes: Wishes, names: Names, common: Common, room: int, tell: Tell) -> Draft:
    file, name = Path(wishes.file), wishes.name
    prefix = f"{name}-" if name else ""
    match kind:
        case "moveit":
            if_open = wishes.if_open or "refuse"
            return import_moveit(file, names, common, prefix=prefix, if_open=if_open)
        case "mesh":
            return import_mesh(
                file, names, common, name=name, scale=wishes.scale or 1.0, up=wishes.up,
                if_open=wishes.if_open or "refuse",
            )  # fmt: skip
        case "plan":
            origin = None if wishes.origin is None else (wishes.origin[0], wishes.origin[1])
            return import_plan(
                file, names, common, prefix=prefix, origin=origin, metres=wishes.metres
            )
    wanted = _cloud_wishes(wishes, room)
    return import_cloud(file, names, common, wanted, name=name, tell=tell)


def _cloud_wishes(wishes: Wishes, room: int) -> CloudWishes:
    crop = None if wishes.crop is None else np.asarray(wishes.crop).reshape(2, 3)
    if crop is not None and not (crop[0] < crop[1]).all():
        raise SettingsError(
            f"--crop: {crop[0].tolist()} is not below {crop[1].tolist()}; give the low corner first"
        )
    margin_m = 0.1 if wishes.arm_margin_m is None else wishes.arm_margin_m
    arm = None
    if wishes.without_arm is not None:
        arm = _arm_points(wishes.without_arm, wishes.at, margin_m * _ARM_STEP)
    elif wishes.at is not None or wishes.arm_margin_m is not None:
        raise SettingsError("--at and --arm-margin-m are for --without-arm SITE; give that, too")
    return CloudWishes(
        voxel_m=wishes.voxel or DEFAULT_VOXEL_M,
        most=min(wishes.max_objects or DEFAULT_OBJECTS, room),
        scale=wishes.scale or 1.0,
        crop=crop,
        ground_z_m=wishes.ground,
        min_points=wishes.min_points or 0,
        skip_invalid=wishes.skip_invalid,
        arm=arm,
        arm_margin_m=margin_m,
    )


def _arm_points(site_path: str, at: Sequence[float] | None, step_m: float) -> FloatArray:
    """Points (n, 3) [m], not farther than ``step_m`` from each other, on the arm's surface."""
    import trimesh  # noqa: PLC0415 - half a second

    from rampe_guard.dashboard.model import load_model  # noqa: PLC0415

    site = load_site(site_path)
    count = len(site.actuator_names)
    if at is None or len(at) != count:
        given = "nothing" if at is None else f"{len(at)} numbers"
        raise SettingsError(
            f"--at: {given}; give where the {count} actuators of {site_path} stood"
            f" ({', '.join(site.actuator_names)})"
        )
    model = load_model(site)
    poses = model.poses(np.asarray(at, float)[None])[0]
    points = []
    for body, pose in zip(model.bodies, poses, strict=True):
        if body is not None:
            fine, _ = trimesh.remesh.subdivide_to_size(
                body.vertices, body.faces, step_m, max_iter=30
            )
            points.append(fine @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(points)
