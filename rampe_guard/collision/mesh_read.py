"""Mesh files as they are: vertices and triangles, unchecked but for their number."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.mesh_topology import IntArray
from rampe_guard.collision.xml_check import check_xml
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    import trimesh

    from rampe_guard.core.types import FloatArray

FORMATS = (".stl", ".obj", ".ply", ".dae", ".off", ".glb")
"""All whole in one file; none of their readers runs anything."""
_WITH_MATERIALS = ("obj", "ply", "glb")
"""Their pictures and colours are no use here, and pictures may unfold to any size."""
MAX_TRIANGLES = 2_000_000
MAX_BYTES = 2**30
"""Larger files are refused unread: two million triangles need half of it in the wordiest format."""

_STL_HEADER = 84
_STL_TRIANGLE = np.dtype(
    [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
)
_UNITS_M = {
    "micron": 1e-6, "microns": 1e-6, "millimeter": 1e-3, "millimeters": 1e-3, "mm": 1e-3,
    "centimeter": 1e-2, "centimeters": 1e-2, "cm": 1e-2, "inch": 0.0254, "inches": 0.0254,
    "in": 0.0254, "foot": 0.3048, "feet": 0.3048, "ft": 0.3048, "meter": 1.0, "meters": 1.0,
    "m": 1.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class RawMesh:
    """What a file says.

    Attributes:
        vertices: (v, 3) in the file's unit.
        faces: (f, 3), as they stand there.
        unit_m: the file's unit [m]; None where the format or the file does not name one.
    """

    vertices: FloatArray
    faces: IntArray
    unit_m: float | None = None


def read_mesh(path: Path) -> RawMesh:
    """Read a mesh file of one of `FORMATS`, and no other file that it may name.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    if not path.is_file():
        raise GeometryError(f"{path}: no such mesh file")
    if path.suffix.lower() not in FORMATS:
        raise GeometryError(
            f"{path}: is none of {', '.join(FORMATS)} by its ending; export it as one of them"
        )
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise GeometryError(
            f"{path}: {size / 2**20:.0f} MiB; more than {MAX_BYTES // 2**20} MiB are refused,"
            " simplify it"
        )
    try:
        if path.suffix.lower() == ".stl":
            raw = _binary_stl(path, size)
            if raw is not None:
                return raw
        import trimesh  # noqa: PLC0415  # half a second, which our own formats need not wait for

        # trimesh cannot say how many there are before it has read them all
        kind = path.suffix.lower().removeprefix(".")
        plain = {"skip_materials": True} if kind in _WITH_MATERIALS else {}
        with path.open("rb") as file:
            if kind == "dae":
                check_xml(file, str(path))
                file.seek(0)
            scene = trimesh.load_scene(
                file, file_type=kind, resolver=_NoOther(), process=False, **plain
            )
        loaded = scene.to_mesh()
        vertices, faces = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64)
        return RawMesh(vertices, faces, _unit(scene))
    except GeometryError as error:
        said = str(error)
        if said.startswith(str(path)):
            raise
        raise GeometryError(f"{path}: {said}") from None
    except Exception as error:  # readers of foreign formats raise whatever they like
        raise GeometryError(f"{path}: cannot be read as a mesh: {error}") from error


class _NoOther(dict[str, bytes]):
    """In the place of trimesh's resolvers, which would open files beside the mesh, or fetch."""

    def __missing__(self, name: str) -> bytes:
        raise GeometryError(f"it names another file, {name[:80]!r}; export it whole in one file")

    def get(self, name: str, default: object = None) -> bytes:  # noqa: ARG002
        """As above: nothing is there."""
        return self[name]


def refuse_too_many(triangles: int, name: str) -> None:
    """Refuse a mesh of more than MAX_TRIANGLES.

    Raises:
        GeometryError: naming ``name`` and the number.
    """
    if triangles > MAX_TRIANGLES:
        raise GeometryError(
            f"{name}: {triangles} triangles; more than {MAX_TRIANGLES} are refused, simplify it"
        )


def _binary_stl(path: Path, size: int) -> RawMesh | None:
    """The triangles of a binary STL; None for another kind of STL.

    Read here, not by trimesh, for a fifth of the memory.
    """
    with path.open("rb") as file:
        header = file.read(_STL_HEADER)
        if len(header) < _STL_HEADER:
            return None
        count = int.from_bytes(header[80:], "little")
        if size != _STL_HEADER + count * _STL_TRIANGLE.itemsize:
            return None
        refuse_too_many(count, str(path))
        data = np.fromfile(file, dtype=_STL_TRIANGLE, count=count)
    vertices = data["corners"].reshape(-1, 3).astype(float)
    return RawMesh(vertices, np.arange(3 * count, dtype=np.int64).reshape(-1, 3))


def _unit(scene: trimesh.Scene) -> float | None:
    """The unit of a scene [m], from words such as "millimeters" or "0.0254 * meters"."""
    said = {scene.units, *(part.units for part in scene.geometry.values())} - {None}
    if len(said) != 1:
        return None
    factor, _, word = str(said.pop()).strip().lower().rpartition("*")
    try:
        unit = _UNITS_M[word.strip()] * (float(factor) if factor else 1.0)
    except (KeyError, ValueError):
        return None
    return unit if np.isfinite(unit) and unit > 0.0 else None
