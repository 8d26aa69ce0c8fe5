r"""A shape as a file: numbers as they lie in memory, a header in JSON, and a checksum over both.

::

    rampe-guard shape 1\n     magic and format
    32 bytes                  SHA-256 of all that follows
    8 bytes                   length of the header, little-endian
    header                    JSON: key, counts, notes, and the length of each array
    arrays                    little-endian; each, and the header, padded to 64 bytes

Nothing in it is run or unpickled. What is read is believed only if the checksum and the key
agree, every array has the type and shape it must have, and every number that points into
another array points inside it: compiled code follows them without asking.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import msgspec
import numpy as np
import numpy.typing as npt

from rampe_guard.collision.shape import Shape
from rampe_guard.core.bounding_tree import NONE, BoundingTree

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

MAGIC: Final = b"rampe-guard shape 1\n"
_LENGTH = 8
_ALIGN = 64
_TYPES: Final = {
    "vertices": ("<f8", (-1, 3)),
    "first": ("<i4", (-1,)),
    "count": ("<i4", (-1,)),
    "radius": ("<f8", (-1,)),
    "left": ("<i4", (-1,)),
    "right": ("<i4", (-1,)),
    "ball": ("<f8", (-1, 4)),
    "size": ("<f8", (-1,)),
    "triangle_first": ("<i4", (-1,)),
    "triangle_count": ("<i4", (-1,)),
    "corners": ("<f8", (-1, 3, 3)),
    "enclosing": ("|b1", (-1,)),
    "inner": ("<f8", (-1, 3)),
}
"""Type and shape of every array of a tree; -1: any length."""


class BrokenShapeError(ValueError):
    """A file is no shape, is damaged, or is of something else."""


class _Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    key: str
    triangles: int
    parts: int
    closed_parts: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    notes: tuple[str, ...]
    lengths: dict[str, int]


def write_shape(file: IO[bytes], key: str, shape: Shape) -> None:
    """Write a shape that can be found again by its key."""
    arrays = {
        name: np.ascontiguousarray(getattr(shape.tree, name), dtype=kind)
        for name, (kind, _) in _TYPES.items()
    }
    header = msgspec.json.encode(
        _Header(
            key=key,
            triangles=shape.triangles,
            parts=shape.parts,
            closed_parts=shape.closed_parts,
            low=_three(shape.low),
            high=_three(shape.high),
            notes=shape.notes,
            lengths={name: len(array) for name, array in arrays.items()},
        )
    )
    header += b" " * (-(_LENGTH + len(header)) % _ALIGN)
    chunks: list[bytes | memoryview] = [len(header).to_bytes(_LENGTH, "little"), header]
    for array in arrays.values():
        chunks += [_bytes_of(array), bytes(-array.nbytes % _ALIGN)]
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(chunk)
    file.write(MAGIC)
    file.write(digest.digest())
    for chunk in chunks:
        file.write(chunk)


def read_shape(path: Path, key: str) -> Shape:
    """Read the shape of this key.

    Raises:
        BrokenShapeError: the file is not, or no longer, what `write_shape` wrote for this key.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        begin = file.read(len(MAGIC) + hashlib.sha256().digest_size)
        body = np.fromfile(file, dtype=np.uint8)
    if not begin.startswith(MAGIC) or len(body) < _LENGTH:
        raise BrokenShapeError(f"{path}: no shape of this format")
    if hashlib.sha256(_bytes_of(body)).digest() != begin[len(MAGIC) :]:
        raise BrokenShapeError(f"{path}: damaged, its checksum differs")
    end = _LENGTH + int.from_bytes(body[:_LENGTH].tobytes(), "little")
    try:
        header = msgspec.json.decode(body[_LENGTH:end].tobytes(), type=_Header)
    except msgspec.MsgspecError as error:
        raise BrokenShapeError(f"{path}: {error}") from error
    if header.key != key:
        raise BrokenShapeError(f"{path}: is of {header.key}, not {key}")
    tree = BoundingTree(**_arrays(body[end:], header.lengths))
    _check(tree)
    return Shape(
        tree=tree,
        triangles=header.triangles,
        parts=header.parts,
        closed_parts=header.closed_parts,
        low=np.array(header.low),
        high=np.array(header.high),
        notes=header.notes,
    )


def _arrays(body: npt.NDArray[np.uint8], lengths: dict[str, int]) -> dict[str, Any]:
    if lengths.keys() != _TYPES.keys() or min(lengths.values()) < 0:
        raise BrokenShapeError(f"has arrays {sorted(lengths)}")
    result, at = {}, 0
    for name, (kind, dims) in _TYPES.items():
        rows, dtype = lengths[name], np.dtype(kind)
        size = rows * int(np.prod(dims[1:], dtype=np.int64)) * dtype.itemsize
        if at + size > len(body):
            raise BrokenShapeError(f"ends within {name}")
        # no copy: the arrays stay where they were read to, aligned thanks to the padding
        result[name] = body[at : at + size].view(dtype).reshape(rows, *dims[1:])
        at += size + -size % _ALIGN
    if at != len(body):
        raise BrokenShapeError(f"goes on for {len(body) - at} bytes after its end")
    return result


def _check(tree: BoundingTree) -> None:
    nodes, vertices, triangles = tree.nodes, len(tree.vertices), len(tree.corners)
    for name in ("count", "radius", "left", "right", "ball", "size"):
        _need(len(getattr(tree, name)) == nodes > 0, name)
    _need(len(tree.triangle_first) == len(tree.triangle_count) == nodes, "triangle_first")
    _need(len(tree.enclosing) == triangles, "enclosing")
    number = np.arange(nodes)
    leaf = tree.left == NONE
    _need(bool((leaf == (tree.right == NONE)).all()), "left")
    for child in (tree.left, tree.right):
        _need(bool((leaf | ((child > number) & (child < nodes))).all()), "children")
    _need(_inside(tree.first, tree.count, vertices) and bool((tree.count > 0).all()), "first")
    _need(_inside(tree.triangle_first, tree.triangle_count, triangles), "triangles")
    for name in ("vertices", "radius", "ball", "size", "corners", "inner"):
        _need(bool(np.isfinite(getattr(tree, name)).all()), name)
    _need(bool((tree.radius >= 0.0).all()), "radius")


def _inside(first: npt.NDArray[Any], count: npt.NDArray[Any], length: int) -> bool:
    fits = (first >= 0) & (count >= 0) & (first.astype(np.int64) + count <= length)
    return bool(fits.all())


def _need(fine: bool, what: str) -> None:
    if not fine:
        raise BrokenShapeError(f"its {what} cannot be")


def _bytes_of(array: npt.NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _three(values: FloatArray | Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
