"""``rampe-guard scene export``: a scene, with the arm of its site, as a glTF model."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import trimesh

from rampe_guard.core.scene import Halfspace, Mesh, SceneObject
from rampe_guard.dashboard.model import Model, load_model
from rampe_guard.dashboard.solids import Solid, Triangles, solids
from rampe_guard.errors import RampeGuardError, SettingsError
from rampe_guard.programs.checkup import resting_pose
from rampe_guard.scene_tools.glb import ARM, MARGIN, Part, glb
from rampe_guard.scene_tools.scene_text import SceneText, read_either

_REACH_M: Final = 10.0
"""How far a halfspace is drawn, where no site says how far the arm reaches."""


def export_scene(path: str, out: str, allow: Sequence[str]) -> int:
    """Write the model; what is in it that one may not expect is said on stderr.

    Raises:
        SettingsError, GeometryError: what is wrong, with the file.
        RampeGuardError: it cannot be written.
    """
    if Path(out).suffix.lower() != ".glb":
        raise SettingsError(f"{out}: a model is written as .glb; give a name with that ending")
    text, site = read_either(path, tuple(allow))
    model = None if site is None else load_model(site)
    parts = list(_parts(text, model))
    if not parts:
        raise SettingsError(f"{path}: has nothing to draw, only actuator limits")
    content = glb(parts)
    try:
        Path(out).write_bytes(content)
    except OSError as error:
        raise RampeGuardError(f"{out}: cannot be written: {error.strerror}") from None
    for note in _notes(text.scene.objects, parts):
        sys.stderr.write(f"note: {note}\n")
    zones = sum(not part.is_margin and part.kind != "arm" for part in parts)
    with_arm = (
        ""
        if model is None
        else f" and the {sum(part.kind == 'arm' for part in parts)} links of the arm"
    )
    sys.stdout.write(f"{out}: {zones} objects{with_arm}, {len(content) / 1000:.0f} kB\n")
    return 0


def _parts(text: SceneText, model: Model | None) -> Iterator[Part]:
    found = solids(text.scene.objects, _reach(text)) if model is None else model.solids
    items = {item.name: item for item in text.scene.objects}
    for solid in found:
        yield from _of_zone(solid, items[solid.name])
    if model is not None:
        pose = resting_pose(model.arm.limits)
        poses = model.poses(pose[None])[0]
        for name, body, at in zip(model.arm.link_names, model.bodies, poses, strict=True):
            if body is not None:
                vertices = body.vertices @ at[:3, :3].T + at[:3, 3]
                yield Part(f"{ARM}{name}", "arm", vertices, body.faces)


def _of_zone(solid: Solid, item: SceneObject) -> Iterator[Part]:
    kind = type(item).__name__.lower()
    yield Part(solid.name, kind, solid.body.vertices, solid.body.faces)
    shell = solid.shell or _shell(solid.body, item)
    if shell is not None:
        yield Part(f"{solid.name}{MARGIN}", kind, shell.vertices, shell.faces, is_margin=True)


def _shell(body: Triangles, item: SceneObject) -> Triangles | None:
    """The margin round a halfspace or, along the normals at its corners, about that of a mesh."""
    match item:
        case Halfspace(margin_m=margin_m) if margin_m > 0.0:
            return Triangles(body.vertices + margin_m * np.asarray(item.normal), body.faces)
        case Mesh(margin_m=margin_m) if margin_m > 0.0:
            normals = trimesh.Trimesh(body.vertices, body.faces, process=False).vertex_normals
            return Triangles(body.vertices + margin_m * np.asarray(normals), body.faces)
    return None


def _reach(text: SceneText) -> float:
    """How far halfspaces are drawn: as far as anything else is [m]."""
    bodies = solids(text.scene.objects, _REACH_M)
    far = [float(np.abs(s.body.vertices).max()) for s in bodies if not s.sheer]
    return max([_REACH_M, *far])


def _notes(objects: Sequence[SceneObject], parts: Sequence[Part]) -> Iterator[str]:
    drawn = {part.name for part in parts}
    hidden = [item.name for item in objects if item.name not in drawn]
    if hidden:
        yield f"not drawn: {', '.join(hidden)} (limits of actuators have no place)"
    rough = [o.name for o in objects if isinstance(o, Mesh) and o.margin_m > 0.0]
    if rough:
        yield f"drawn with about its margin: {', '.join(rough)} (a mesh; what is swept is exact)"
    moving = [item.name for item in objects if getattr(item, "key", None) is not None]
    if moving:
        yield f"drawn in its own frame, not where it is: {', '.join(moving)} (it moves)"
