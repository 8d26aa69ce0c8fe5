"""MoveIt ``.scene`` files → boxes, spheres, cylinders, halfspaces and meshes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from rampe_guard.collision.mesh import TriangleMesh, checked_mesh
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError
from rampe_guard.scene_tools.draft import Common, Draft, DraftObject, Names, placed, plain
from rampe_guard.scene_tools.moveit_text import Item, Shape, read_text
from rampe_guard.scene_tools.solid_mesh import IfOpen, solid_mesh
from rampe_guard.settings.source import read_bytes

_MOST_BYTES: Final = 256 * 2**20
_THIN_M: Final = 1e-3
"""A side of 0 is made so thick: a sheet can be touched, too [m]."""
_SIDES: Final = 48


def import_moveit(
    file: Path, names: Names, common: Common, *, prefix: str = "", if_open: IfOpen = "refuse"
) -> Draft:
    """All collision objects of a MoveIt scene.

    Args:
        file: as MoveIt's RViz panel exports it.
        names: of the scene.
        common: pose, margin, links.
        prefix: before the name of each object.
        if_open: what becomes of meshes that have no inside.

    Raises:
        GeometryError: with file and line, what is wrong with it.
        SettingsError: it cannot be read.
    """
    content = read_bytes(file, "MoveIt scene", limit=_MOST_BYTES)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise GeometryError(f"{file}: is not UTF-8 text, so no MoveIt scene") from None
    maker = _Maker(str(file), names, common, if_open)
    for item in read_text(text, str(file)):
        maker.add(item, prefix)
    maker.notes.append(
        f"{file}: such a file holds neither the octomap of a planning scene nor what is attached"
        " to the robot; import these in another way"
    )
    return Draft(tuple(maker.objects), tuple(maker.notes))


class _Maker:
    """Turns shapes into objects."""

    def __init__(self, file: str, names: Names, common: Common, if_open: IfOpen) -> None:
        self._file, self._names, self._common, self._if_open = file, names, common, if_open
        self.objects: list[DraftObject] = []
        self.notes: list[str] = []

    def add(self, item: Item, prefix: str) -> None:
        if not item.shapes:
            self.notes.append(f"{self._file}: {item.name!r} has no shapes: nothing to keep clear")
        if item.subframes:
            self.notes.append(f"{self._file}: {item.name!r}: its subframes have no shape: left out")
        for shape in item.shapes:
            name = self._names.new(prefix + item.name)
            if name != prefix + item.name and len(item.shapes) == 1:
                self.notes.append(f"{self._file}: {item.name[:80]!r} is called {name!r} here")
            fields, mesh = self._shape(shape, name)
            self.objects.append(DraftObject(name, {**fields, **self._common.fields()}, mesh))

    def _shape(self, shape: Shape, name: str) -> tuple[dict[str, Any], TriangleMesh | None]:
        where = f"{self._file}:{shape.line}: {name!r}"
        pose = self._common.pose @ shape.pose
        if shape.kind == "plane":
            return self._plane(shape, pose, where), None
        if shape.kind == "mesh":
            mesh = checked_mesh(shape.vertices, shape.faces.astype(np.int64), where)
            mesh, said, notes = solid_mesh(mesh, where, self._if_open)
            self.notes += [*mesh.notes, *notes]
            return {"type": "mesh", "pose": placed(pose), **said}, mesh
        sizes = [self._side(side, where) for side in shape.sizes]
        match shape.kind:
            case "box":
                return {"type": "box", "size": sizes, "pose": placed(pose)}, None
            case "sphere":
                center = [plain(v) for v in pose[:3, 3]]
                return {"type": "sphere", "radius_m": sizes[0], "center": center}, None
            case "cylinder":
                round_it = {"radius_m": sizes[0], "height_m": sizes[1]}
                return {"type": "cylinder", **round_it, "pose": placed(pose)}, None
        self.notes.append(f"{where}: a cone, as a pyramid of {_SIDES} sides round it")
        return {"type": "mesh", "pose": placed(pose)}, cone(sizes[0], sizes[1])

    def _side(self, side: float, where: str) -> float:
        if side < 0.0:
            raise GeometryError(f"{where}: a size of {side:g} m; give 0 or more")
        if side < _THIN_M:
            self.notes.append(f"{where}: a size of {side:g} m is made {_THIN_M:g} m")
        return plain(max(side, _THIN_M))

    def _plane(self, shape: Shape, pose: FloatArray, where: str) -> dict[str, Any]:
        """A plane as the halfspace behind it.

        MoveIt calls it ax + by + cz + d = 0, and hands it to its collision checker as
        ax + by + cz = d; the halfspace that holds both is taken.
        """
        *abc, d = shape.sizes
        length = math.hypot(*abc)
        if not length > 0.0:
            raise GeometryError(f"{where}: a plane without a normal")
        normal = pose[:3, :3] @ (np.array(abc) / length)
        offset = abs(d) / length + float(normal @ pose[:3, 3])
        self.notes.append(
            f"{where}: a plane has two sides, and is taken as solid on the one that its normal"
            " leaves; turn 'normal' and 'offset_m' round if the arm works there"
        )
        turned = [plain(v) for v in normal]
        return {"type": "halfspace", "normal": turned, "offset_m": plain(offset)}


def cone(radius_m: float, height_m: float) -> TriangleMesh:
    """Pyramid round a cone along z, its tip at +height/2: it contains the cone."""
    angle = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * (radius_m / np.cos(np.pi / _SIDES))
    base = np.column_stack([ring, np.full(_SIDES, -0.5 * height_m)])
    tip, middle = [0.0, 0.0, 0.5 * height_m], [0.0, 0.0, -0.5 * height_m]
    i = np.arange(_SIDES)
    j = (i + 1) % _SIDES
    walls = np.column_stack([i, j, np.full(_SIDES, _SIDES)])
    floor = np.column_stack([j, i, np.full(_SIDES, _SIDES + 1)])
    return TriangleMesh(
        np.concatenate([base, [tip, middle]]), np.concatenate([walls, floor]).astype(np.int64)
    )
