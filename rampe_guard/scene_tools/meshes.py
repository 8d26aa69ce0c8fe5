"""Mesh files (STL, OBJ, PLY, GLB, glTF and more) → one mesh object each."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal

import numpy as np

from rampe_guard.collision.mesh import ZONE_MOST_M, TriangleMesh, checked_mesh, load_mesh
from rampe_guard.errors import GeometryError
from rampe_guard.scene_tools.draft import Common, Draft, DraftObject, Names, placed
from rampe_guard.scene_tools.solid_mesh import IfOpen, solid_mesh

Up = Literal["y", "z"]
_UP_BY_FORMAT: Final[dict[str, Up]] = {".glb": "y", ".gltf": "y"}
"""What the format itself prescribes; the others leave it to whoever made the file."""
_Y_UP: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def import_mesh(
    file: Path,
    names: Names,
    common: Common,
    *,
    name: str | None = None,
    scale: float = 1.0,
    up: Up | None = None,
    if_open: IfOpen = "refuse",
) -> Draft:
    """One mesh object of a file.

    Args:
        file: the mesh.
        names: of the scene.
        common: pose, margin, links.
        name: of the object; the file's if left out.
        scale: factor from the file's unit to metres, where the file does not name it [-].
        up: which axis of the file points up; if left out, what its format prescribes, else z.
        if_open: what becomes of a mesh that has no inside.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    raw = load_mesh(file)
    upward = up or _UP_BY_FORMAT.get(file.suffix.lower(), "z")
    vertices = raw.vertices * scale
    notes = list(raw.notes)
    if upward == "y":
        vertices = vertices @ _Y_UP.T
        notes.append(f"{file}: its y axis points up (--up y): turned, so that z does")
    if not np.abs(vertices).max() < ZONE_MOST_M:
        far = float(np.abs(vertices).max())
        raise GeometryError(
            f"{file}: a coordinate of {far:.4g} m; give --scale (0.001 for millimetres), or move"
            " it near to the machine where it was drawn"
        )
    mesh, fields, said = solid_mesh(
        checked_mesh(vertices, raw.faces, str(file)), str(file), if_open
    )
    title = names.new(file.stem if name is None else name)
    item = mesh_object(title, mesh, common, fields)
    return Draft((item,), (*notes, *mesh.notes, *said))


def mesh_object(
    name: str, mesh: TriangleMesh, common: Common, fields: dict[str, object]
) -> DraftObject:
    """A mesh [m] of the file's frame as an object."""
    return DraftObject(
        name, {"type": "mesh", "pose": placed(common.pose), **fields, **common.fields()}, mesh
    )
