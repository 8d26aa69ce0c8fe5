"""COLLADA files: all triangles of the scene, or none.

What is not shape (pictures, colours, lights, movements) is taken out first; the rest is then read
strictly, so that a broken part of the geometry is an error and not a hole in the arm.

Axes are taken as they stand, whatever ``up_axis`` says, as the tools of ROS take them: robots are
drawn to look right there. The unit counts.
"""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rampe_guard.collision.mesh_limits import refuse_too_many
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rampe_guard.collision.mesh_topology import IntArray
    from rampe_guard.core.types import FloatArray

_SHAPELESS: Final = {
    "library_animations", "library_animation_clips", "library_cameras", "library_effects",
    "library_force_fields", "library_formulas", "library_images", "library_lights",
    "library_materials", "library_physics_materials", "library_physics_models",
    "library_physics_scenes", "library_kinematics_models", "library_kinematics_scenes",
    "library_articulated_systems", "library_joints", "instance_camera", "instance_light",
    "instance_physics_scene", "instance_kinematics_scene", "bind_material", "extra",
    "lines", "linestrips",
}  # fmt: skip
_REFUSED: Final = {
    "instance_controller": "a skin or a morph, whose shape depends on how it is posed",
    "ph": "polygons with holes",
    "convex_mesh": "a convex mesh",
    "spline": "a spline",
    "brep": "a boundary representation",
}
_CORNERS: Final = 3
MAX_NODES: Final = 100_000


def read_dae(content: bytes) -> tuple[FloatArray, IntArray, float | None, tuple[str, ...]]:
    """Triangles of a COLLADA file that `check_xml` has let pass.

    Returns:
        Vertices (v, 3) in the file's unit, faces (f, 3), that unit [m] (None if it names none),
        and remarks.

    Raises:
        GeometryError: what there is to see cannot be read whole.
    """
    import collada  # noqa: PLC0415  # a tenth of a second, and few arms need it

    root = ET.fromstring(content)  # noqa: S314  # without document type, by `check_xml`
    _strip(root)
    try:
        read = collada.Collada(io.BytesIO(ET.tostring(root)))
        soup = [] if read.scene is None else list(_parts(read.scene.nodes))
    except GeometryError:
        raise
    except Exception as error:  # it raises whatever it likes
        raise GeometryError(f"cannot be read whole: {error}; export it anew, or as STL") from error
    corners = np.concatenate([np.empty((0, _CORNERS, 3)), *soup])
    faces = np.arange(_CORNERS * len(corners), dtype=np.int64).reshape(-1, _CORNERS)
    unit = read.assetInfo.unitmeter
    return corners.reshape(-1, 3), faces, None if unit is None else float(unit), _axes(root)


def _parts(nodes: list[Any]) -> Iterator[FloatArray]:
    """Corners (f, 3, 3) of each set of polygons, where the scene has it."""
    todo = [(node, np.eye(4)) for node in reversed(nodes)]
    seen = triangles = 0
    while todo:
        node, pose = todo.pop()
        seen += 1
        if seen > MAX_NODES:  # few nodes that name each other may stand for any number
            raise GeometryError(f"has more than {MAX_NODES} nodes; simplify it")
        children = getattr(node, "children", None)
        if children:
            below = pose @ np.asarray(node.matrix, dtype=float)
            todo += [(child, below) for child in reversed(children)]
        for part in getattr(getattr(node, "geometry", None), "primitives", ()):
            corners = _triangles(part)
            triangles += len(corners)
            refuse_too_many(triangles, "its scene")
            yield corners @ pose[:3, :3].T + pose[:3, 3]


def _strip(root: ET.Element) -> None:
    """Take out all that has no shape; refuse shapes that would be lost."""
    for element in list(root.iter()):
        for child in list(element):
            tag = _plain(child.tag)
            if tag in _SHAPELESS:
                element.remove(child)
            elif tag in _REFUSED:
                raise GeometryError(
                    f"has {_REFUSED[tag]} (<{tag}>); export it as plain triangles, or as STL"
                )


def _triangles(part: Any) -> FloatArray:
    """Corners (f, 3, 3) of one set of polygons, in its own frame."""
    if hasattr(part, "triangleset"):
        part = part.triangleset()
    if part.vertex is None or len(part.vertex_index) == 0:
        return np.empty((0, _CORNERS, 3))
    index = np.asarray(part.vertex_index)  # within bounds: pycollada has looked
    vertices: FloatArray = np.asarray(part.vertex, dtype=float)
    corners: FloatArray = vertices[index].reshape(-1, _CORNERS, 3)
    return corners


def _axes(root: ET.Element) -> tuple[str, ...]:
    asset = next((child for child in root if _plain(child.tag) == "asset"), None)
    said = [
        (child.text or "").strip()
        for child in ([] if asset is None else asset)
        if _plain(child.tag) == "up_axis"
    ]
    if not said or said[0] == "Z_UP":
        return ()
    words = f"its axes are taken as they stand, as by the tools of ROS, not as its {said[0][:20]!r}"
    return (f"{words} says",)


def _plain(tag: object) -> str:
    return str(tag).rpartition("}")[2]
