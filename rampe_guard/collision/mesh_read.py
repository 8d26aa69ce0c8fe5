"""Mesh files as they are: vertices and triangles, unchecked but for their number."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np

from rampe_guard.collision.mesh_dae import read_dae
from rampe_guard.collision.mesh_gltf import check_gltf, companions
from rampe_guard.collision.mesh_limits import MAX_BYTES, refuse_too_many
from rampe_guard.collision.mesh_topology import IntArray
from rampe_guard.collision.xml_check import check_xml
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    import trimesh

    from rampe_guard.core.types import FloatArray

FORMATS = (".stl", ".obj", ".ply", ".dae", ".off", ".glb", ".gltf")
"""Whole in one file, but for the buffers of glTF; none of their readers runs anything."""
_WITH_MATERIALS = ("obj", "ply", "glb", "gltf")
"""Their pictures and colours are no use here, and pictures may unfold to any size."""

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
        notes: remarks on how it was read.
    """

    vertices: FloatArray
    faces: IntArray
    unit_m: float | None = None
    notes: tuple[str, ...] = ()


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
    beside, size = _whole(path)
    if size > MAX_BYTES:
        raise GeometryError(
            f"{path}: {size / 2**20:.0f} MiB; more than {MAX_BYTES // 2**20} MiB are refused,"
            " simplify it"
        )
    try:
        raw = _binary_stl(path, size) if path.suffix.lower() == ".stl" else None
        if raw is not None:
            return raw
        return _dae(path) if path.suffix.lower() == ".dae" else _by_trimesh(path, beside)
    except GeometryError as error:
        said = str(error)
        if said.startswith(str(path)):
            raise
        raise GeometryError(f"{path}: {said}") from None
    except Exception as error:  # readers of foreign formats raise whatever they like
        raise GeometryError(f"{path}: cannot be read as a mesh: {error}") from error


def _whole(path: Path) -> tuple[tuple[Path, ...], int]:
    """The files beside it that it needs, and the size of all [bytes]."""
    try:
        beside = companions(path)
        return beside, sum(file.stat().st_size for file in (path, *beside))
    except OSError as error:
        which = error.filename or path
        raise GeometryError(f"{path}: {which} cannot be read: {error.strerror}") from None
    except (AttributeError, TypeError, ValueError) as error:
        raise GeometryError(f"{path}: is no glTF: {error}") from None


def _dae(path: Path) -> RawMesh:
    content = path.read_bytes()
    check_xml(io.BytesIO(content), str(path))
    vertices, faces, unit, notes = read_dae(content)
    good = unit is not None and np.isfinite(unit) and unit > 0.0
    return RawMesh(vertices, faces, unit if good else None, notes)


def _by_trimesh(path: Path, beside: tuple[Path, ...]) -> RawMesh:
    import trimesh  # noqa: PLC0415  # half a second, which our own formats need not wait for

    # trimesh cannot say how many there are before it has read them all
    kind = path.suffix.lower().removeprefix(".")
    if kind in ("glb", "gltf"):
        check_gltf(path)
    plain = {"skip_materials": True} if kind in _WITH_MATERIALS else {}
    with path.open("rb") as file:
        scene = trimesh.load_scene(
            file, file_type=kind, resolver=_NoOther(path, beside), process=False, **plain
        )
    loaded = scene.to_mesh()
    vertices, faces = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64)
    return RawMesh(vertices, faces, _unit(scene))


class _NoOther(dict[str, bytes]):
    """In the place of trimesh's resolvers, which would open files beside the mesh, or fetch.

    Args:
        path: the mesh file.
        beside: the only other files that are read.
    """

    def __init__(self, path: Path, beside: tuple[Path, ...]) -> None:
        super().__init__()
        self._folder, self._beside = path.parent, beside

    def __missing__(self, name: str) -> bytes:
        file = self._folder / unquote(name)
        if file in self._beside:
            return file.read_bytes()
        raise GeometryError(f"it names another file, {name[:80]!r}; export it whole in one file")

    def get(self, name: str, default: object = None) -> bytes:  # noqa: ARG002
        """As above: nothing else is there."""
        return self[name]


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
