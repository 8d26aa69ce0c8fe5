"""glTF files, in one file (GLB) or with buffers beside: what trimesh would leave out is refused.

A reader that skips what it does not know leaves holes in the arm. So everything that changes shape
and that it does not read is looked for first. Coordinates are metres, and axes are taken as they
stand: glTF calls y up, the tools of ROS do not turn it.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import unquote

from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterator

SUFFIX: Final = ".gltf"
MAX_HEADER: Final = 64 * 2**20
"""The JSON of a file is no longer, unless its buffers are written into it [bytes]."""
_INLINE: Final = "data:"
_HEAD: Final = struct.Struct("<4sIII4s")
_FLOAT: Final = 5126
_MODES: Final = {0, 1, 2, 3, 4, 5}
"""Points and lines, which have no surface; triangles and strips of them."""
_FAN: Final = 6
_HARMLESS: Final = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")


def companions(path: Path) -> tuple[Path, ...]:
    """The files beside a glTF file in which its numbers are; none for any other kind of mesh.

    Raises:
        GeometryError: it is no glTF file, or names a file that is not below its own folder.
        OSError: it cannot be read.
    """
    if path.suffix.lower() != SUFFIX:
        return ()
    home = path.resolve().parent
    found: dict[Path, None] = {}
    for name in _buffer_names(_header(path)):
        place = path.parent / unquote(name)
        inside = ":" not in name and "\0" not in name and not name.startswith(("/", "\\"))
        if not (inside and place.resolve().is_relative_to(home)):
            raise GeometryError(
                f"{path}: names a file {name[:80]!r}, which is not below its own folder; move it"
                " there, or export all in one file (GLB)"
            )
        found[place] = None
    return tuple(found)


def check_gltf(path: Path) -> None:
    """Refuse a glTF or GLB file with shapes that would not be read as they are.

    Raises:
        GeometryError: naming the file, what it has and what to do.
    """
    for words in _wrongs(_header(path)):
        raise GeometryError(f"{path}: has {words}; export it as plain triangles")


def _header(path: Path) -> dict[str, Any]:
    """The JSON of a file."""
    with path.open("rb") as file:
        if path.suffix.lower() == SUFFIX:
            text = file.read()
        else:
            head = file.read(_HEAD.size)
            if len(head) < _HEAD.size:
                raise GeometryError(f"{path}: is no GLB file")
            magic, _, _, length, kind = _HEAD.unpack(head)
            if magic != b"glTF" or kind != b"JSON" or length > MAX_HEADER:
                raise GeometryError(f"{path}: is no GLB file of version 2")
            text = file.read(length)
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise GeometryError(f"{path}: is no glTF: {error}") from None
    if not isinstance(header, dict):
        raise GeometryError(f"{path}: is no glTF: its JSON is no object")
    return header


def _buffer_names(header: dict[str, Any]) -> Iterator[str]:
    for buffer in header.get("buffers", []):
        uri = buffer.get("uri")
        if uri is not None and not str(uri).startswith(_INLINE):
            yield str(uri)


def _wrongs(header: dict[str, Any]) -> Iterator[str]:
    """What is in it that changes shapes and is not read."""
    for name in header.get("extensionsRequired", []):
        if not str(name).startswith(_HARMLESS):
            yield f"the extension {str(name)[:80]!r}"
    nodes, accessors = header.get("nodes", []), header.get("accessors", [])
    for node in nodes:
        yield from _node_wrongs(node)
    skinned = {node.get("mesh") for node in nodes if "skin" in node}
    for number, mesh in enumerate(header.get("meshes", [])):
        if number in skinned:
            yield "a skinned mesh, whose shape depends on how it is posed"
        if any(mesh.get("weights", [])):
            yield "a morphed mesh"
        for part in mesh.get("primitives", []):
            yield from _part_wrongs(part, accessors)


def _node_wrongs(node: dict[str, Any]) -> Iterator[str]:
    if "EXT_mesh_gpu_instancing" in node.get("extensions", {}):
        yield "copies of a mesh by EXT_mesh_gpu_instancing"
    if "camera" in node and ("mesh" in node or "children" in node):
        yield "a mesh below a camera"
    if any(node.get("weights", [])):
        yield "a morphed mesh"


def _part_wrongs(part: dict[str, Any], accessors: list[dict[str, Any]]) -> Iterator[str]:
    mode = part.get("mode", 4)
    if mode not in _MODES:
        yield "triangle fans" if mode == _FAN else f"primitives of mode {mode}"
    where = part.get("attributes", {}).get("POSITION")
    if where is None:
        yield "a primitive without positions"
        return
    for index in (where, part.get("indices")):
        if index is None:
            continue
        accessor = accessors[index]
        if "sparse" in accessor or "bufferView" not in accessor:
            yield "numbers that are stored sparsely or by an extension"
    if accessors[where].get("componentType") != _FLOAT:
        yield "quantized positions"
