"""Scene files → `rampe_guard.core.scene.Scene`."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rampe_guard.core.events import SYSTEM_ZONE
from rampe_guard.core.rotation import rotation_of_rpy
from rampe_guard.core.scene import (
    SELF_ZONE,
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    Mesh,
    Scene,
    SceneObject,
    Sphere,
)
from rampe_guard.core.types import FloatArray, Point
from rampe_guard.folders import Folders
from rampe_guard.settings import scene_model as models
from rampe_guard.settings.explain import validate
from rampe_guard.settings.model import Pose
from rampe_guard.settings.problems import KeyPath, Problems, did_you_mean, show
from rampe_guard.settings.scene_motion import Motions, refuse_fixed
from rampe_guard.settings.source import MAX_MESH_BYTES, Document, parse, read_bytes

_SHORTEST_NORMAL = 1e-9
_MESH_SUFFIXES = (".stl", ".obj", ".ply")


def load_scene(
    path: str | Path,
    *,
    actuators: Sequence[str] = (),
    taken: Mapping[str, str] | None = None,
    folders: Folders | None = None,
) -> Scene:
    """Read a scene file.

    Args:
        path: the YAML file; meshes are relative to it.
        actuators: names of the site's actuators, in order, for actuator limits.
        taken: keys that no object may have, and what each of them is.
        folders: where its meshes may lie; if left out, below its own.

    Raises:
        SettingsError: with file, line, key, value and remedy of every problem.
    """
    content = read_bytes(path, "scene file")
    document = parse(content, str(path))
    context = _context(actuators, taken, Path(path).parent, folders)
    return _scene(document, context, str(Path(path).absolute()))


def parse_scene(
    content: bytes | str,
    *,
    actuators: Sequence[str] = (),
    taken: Mapping[str, str] | None = None,
    directory: str | Path = ".",
    name: str = "<scene>",
    folders: Folders | None = None,
) -> Scene:
    """Read a scene from text, as it arrives in a query.

    Args:
        content: the YAML text, UTF-8 when bytes.
        actuators: names of the site's actuators, in order.
        taken: as in `load_scene`.
        directory: where the paths of meshes start.
        name: what messages call the text.
        folders: where its meshes may lie; if left out, below ``directory``.

    Raises:
        SettingsError: as `load_scene`.
    """
    context = _context(actuators, taken, Path(directory), folders)
    return _scene(parse(content, name), context, "")


@dataclass(frozen=True, slots=True)
class _Context:
    """What a scene is read against: the site's actuators and keys, and where its files are."""

    actuators: tuple[str, ...]
    taken: dict[str, str]
    directory: Path
    folders: Folders


def _context(
    actuators: Sequence[str],
    taken: Mapping[str, str] | None,
    directory: Path,
    folders: Folders | None,
) -> _Context:
    allowed = Folders.of(directory) if folders is None else folders
    return _Context(tuple(actuators), dict(taken or {}), directory, allowed)


def pose_matrix(pose: Pose) -> FloatArray:
    """Homogeneous matrix (4, 4) [m] of a pose, read-only."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_of_rpy(pose.rpy)
    matrix[:3, 3] = pose.xyz
    matrix.flags.writeable = False
    return matrix


def existing_file(
    problems: Problems, path: KeyPath, directory: Path, file: str, what: str, folders: Folders
) -> str | None:
    """Normal path of ``file`` seen from ``directory``, or None and a problem.

    Outside of ``folders`` it is not even looked for.
    """
    full = os.path.normpath(directory / file)
    try:
        if not folders.hold(full):
            wrong, remedy = folders.refusal(full)
            problems.add(path, f"{show(file)} {wrong}", remedy)
            return None
        if Path(full).is_file():
            return full
        reason = "is a directory" if Path(full).is_dir() else "does not exist"
    except (OSError, ValueError) as error:
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
    problems.add(
        path, f"{show(file)} {reason}", f"give the path of a {what}, relative to this file"
    )
    return None


def _scene(document: Document, context: _Context, path: str) -> Scene:
    refuse_fixed(document)
    model = validate(models.SceneModel, document)
    problems = Problems(document)
    builder = _Builder(problems, context, model.margin_m)
    objects: list[SceneObject] = []
    first: dict[str, int] = {}
    for index, item in enumerate(model.objects):
        where: KeyPath = ("objects", index)
        if item.name in first:
            there = document.line(("objects", first[item.name]))
            what = f"{show(item.name)} is the name of another object (line {there})"
            problems.add((*where, "name"), what, "give every object a name of its own")
        first.setdefault(item.name, index)
        if item.name == SYSTEM_ZONE:
            what = f"{show(item.name)} is the zone of the guard's own alerts"
            problems.add((*where, "name"), what, "give another name")
        if item.name.startswith(SELF_ZONE):
            what = f"{show(item.name)} begins with {SELF_ZONE!r}, as self-collision zones do"
            problems.add((*where, "name"), what, "give another name")
        value = builder.build(item, where)
        if value is not None:
            objects.append(value)
    problems.raise_if_any()
    digest = hashlib.sha256(document.content)
    left = MAX_MESH_BYTES
    for index, value in enumerate(objects):
        if isinstance(value, Mesh):
            content = read_bytes(value.file, "mesh file", limit=MAX_MESH_BYTES)
            left -= len(content)
            if left < 0:  # a thousand objects may name the same file
                what = f"with it the meshes are larger than {MAX_MESH_BYTES // 2**20} MB together"
                problems.add(("objects", index, "file"), what, "simplify them, or give fewer")
                problems.raise_if_any()
            digest.update(content)
    return Scene(tuple(objects), path, digest.hexdigest(), document.content.decode("utf-8"))


class _Builder:
    """Turns object models into core values; None, and a problem, where it cannot."""

    def __init__(self, problems: Problems, context: _Context, margin_m: float) -> None:
        self._problems = problems
        self._actuators = context.actuators
        self._directory = context.directory
        self._folders = context.folders
        self._motions = Motions(problems, context.taken)
        self._margin_m = margin_m

    def build(  # noqa: PLR0911 - one return for each kind
        self, item: models.ObjectModel, where: KeyPath
    ) -> SceneObject | None:
        if isinstance(item, models.ActuatorLimitModel):
            return self._limit(item, where)
        common: dict[str, Any] = {
            "name": item.name,
            "margin_m": self._margin_m if item.margin_m is None else item.margin_m,
            "ignore_links": item.ignore_links,
        }
        if isinstance(item, models.MovableModel):
            common |= self._motions.of(item, where)
        match item:
            case models.BoxModel():
                return Box(**common, size_m=_point(item.size), pose=pose_matrix(item.pose))
            case models.SphereModel():
                return Sphere(**common, radius_m=item.radius_m, center_m=_point(item.center))
            case models.CylinderModel():
                pose = pose_matrix(item.pose)
                return Cylinder(**common, radius_m=item.radius_m, height_m=item.height_m, pose=pose)
            case models.CapsuleModel():
                start, end = _point(item.start), _point(item.end)
                return Capsule(**common, radius_m=item.radius_m, start_m=start, end_m=end)
            case models.HalfspaceModel():
                return self._halfspace(item, where, common)
            case models.MeshModel():
                return self._mesh(item, where, common)

    def _halfspace(
        self, item: models.HalfspaceModel, where: KeyPath, common: dict[str, Any]
    ) -> Halfspace | None:
        length = math.hypot(*item.normal)
        if length < _SHORTEST_NORMAL:
            what = f"{list(item.normal)} has no direction"
            self._problems.add((*where, "normal"), what, "give a vector of any length but 0")
            return None
        x, y, z = (v / length for v in item.normal)
        return Halfspace(**common, normal=(x, y, z), offset_m=item.offset_m / length)

    def _mesh(self, item: models.MeshModel, where: KeyPath, common: dict[str, Any]) -> Mesh | None:
        key = (*where, "file")
        if not item.file.lower().endswith(_MESH_SUFFIXES):
            what = f"{show(item.file)} is not a mesh by its ending"
            self._problems.add(key, what, f"give a file in {', '.join(_MESH_SUFFIXES)}")
            return None
        file = existing_file(
            self._problems, key, self._directory, item.file, "mesh file", self._folders
        )
        if file is None:
            return None
        pose = pose_matrix(item.pose)
        return Mesh(**common, file=file, scale=item.scale, pose=pose, open=item.open)

    def _limit(self, item: models.ActuatorLimitModel, where: KeyPath) -> ActuatorLimit | None:
        if item.actuator not in self._actuators:
            what = f"{show(item.actuator)} is not an actuator of the site"
            self._problems.add(
                (*where, "actuator"), what, did_you_mean(item.actuator, self._actuators)
            )
            return None
        above, below = item.above, item.below
        if above is None and below is None:
            self._problems.add(where, "has neither above nor below", "give at least one of them")
            return None
        if above is not None and below is not None and below >= above:
            what = f"below {below:g} and above {above:g} leave no room"
            self._problems.add(where, what, "give below less than above: the arm may be between")
            return None
        index = self._actuators.index(item.actuator)
        return ActuatorLimit(name=item.name, actuator=index, above=above, below=below)


def _point(values: tuple[float, ...]) -> Point:
    x, y, z = (float(v) for v in values)
    return x, y, z
