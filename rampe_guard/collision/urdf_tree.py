"""The tree of a URDF file, read once and kept beside the shapes (see `shape_cache`)."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import msgspec

from rampe_guard.collision.shape_cache import default_cache
from rampe_guard.collision.urdf_model import LAYOUT, Tree
from rampe_guard.collision.urdf_read import parse_urdf
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from pathlib import Path

MAX_BYTES: Final = 16 * 2**20


def read_tree(path: Path) -> Tree:
    """The tree of a URDF; meshes are named, not read.

    Raises:
        GeometryError: it is no URDF, or too large.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise GeometryError(f"{path}: is larger than {MAX_BYTES // 2**20} MB; give a smaller URDF")
    said = f"urdf {LAYOUT} {path.suffix.lower()} ".encode()
    key = hashlib.sha256(said + content).hexdigest()
    cache = default_cache()
    kept = cache.get_tree(key)
    if kept is not None:
        with suppress(msgspec.MsgspecError):  # else it is read anew
            return msgspec.msgpack.decode(kept, type=Tree)
    tree = parse_urdf(content, str(path))
    cache.put_tree(key, msgspec.msgpack.encode(tree))
    return tree
