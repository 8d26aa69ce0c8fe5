"""Shapes kept on disk, found by the content they were made from.

The folder is `$RAMPE_GUARD_CACHE` (empty: nothing is kept), else `$XDG_CACHE_HOME/rampe-guard`,
else `~/.cache/rampe-guard`. Nothing depends on it: a file that is missing, damaged or foreign is
built anew, and a folder that cannot be written is said once and costs only time.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import logging
import os
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from rampe_guard.collision import mesh as meshes
from rampe_guard.collision import tree_build, tree_split
from rampe_guard.collision.mesh import TriangleMesh, check_extent, load_mesh
from rampe_guard.collision.mesh_gltf import companions
from rampe_guard.collision.mesh_read import FORMATS
from rampe_guard.collision.shape import Shape, shape_of
from rampe_guard.collision.shape_file import MAGIC, BrokenShapeError, read_shape, write_shape
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import BinaryIO

    from rampe_guard.collision.tree_split import Progress
    from rampe_guard.core.types import FloatArray

ENVIRONMENT: Final = "RAMPE_GUARD_CACHE"
MOST_BYTES: Final = 2 * 2**30
"""When more is kept, what was not used for longest goes."""
SUFFIX: Final = ".shape"
TREE_SUFFIX: Final = ".urdf"
_KEPT: Final = {SUFFIX, TREE_SUFFIX}
_DIGEST: Final = hashlib.sha256().digest_size
_UNFINISHED: Final = ".unfinished-"
_MADE_BY: Final = (
    f"{MAGIC!r} tree {tree_build.VERSION} leaf {tree_split.LEAF} hulls {tree_build.HULLS}"
    f" trimesh {version('trimesh')}"
)
"""Whatever else decides what comes out; a change makes all that was kept before unfindable."""

_log = logging.getLogger(__name__)


class ShapeCache:
    """Shapes in one folder; None keeps nothing.

    Attributes:
        folder: as given.
        trouble: why nothing can be kept, once that was seen; None while all is well.
    """

    def __init__(self, folder: Path | None, most_bytes: int = MOST_BYTES) -> None:
        self.folder = folder
        self.trouble: str | None = None
        self._most_bytes = most_bytes

    def get(self, key: str) -> Shape | None:
        """The shape of this key, if it is here and whole."""
        if self.folder is None:
            return None
        path = self._path(key)
        try:
            shape = read_shape(path, key)
        except FileNotFoundError:
            return None
        except (BrokenShapeError, OSError, MemoryError) as error:
            _log.warning("%s cannot be used and is built anew: %s", path, error)
            return None
        with contextlib.suppress(OSError):  # used just now; a folder may be read-only
            os.utime(path)
        return shape

    def put(self, key: str, shape: Shape) -> None:
        """Keep a shape; the old file or the new one is there at any moment, whole."""
        try:
            self._keep(f"{key}{SUFFIX}", lambda file: write_shape(file, key, shape))
        except OSError as error:
            if self.trouble is None:
                self.trouble = (
                    f"shapes of meshes cannot be kept in {self.folder} ({error}): they are built"
                    f" anew at each start; make it writable, or name another in {ENVIRONMENT}"
                )
                _log.warning("%s", self.trouble)

    def get_tree(self, key: str) -> bytes | None:
        """What was read from the URDF of this key, if it is here and whole."""
        if self.folder is None:
            return None
        try:
            content = (self.folder / f"{key}{TREE_SUFFIX}").read_bytes()
        except OSError:
            return None
        digest, body = content[:_DIGEST], content[_DIGEST:]
        return body if hashlib.sha256(body).digest() == digest else None

    def put_tree(self, key: str, body: bytes) -> None:
        """Keep what was read from a URDF; where that cannot be, shapes cannot, and they say so."""
        content = hashlib.sha256(body).digest() + body
        with contextlib.suppress(OSError):
            self._keep(f"{key}{TREE_SUFFIX}", lambda file: file.write(content))

    def _keep(self, name: str, write: Callable[[BinaryIO], object]) -> None:
        if self.folder is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=_UNFINISHED, dir=self.folder)
        unfinished = Path(temporary)
        try:
            with os.fdopen(handle, "wb") as file:
                write(file)
            unfinished.replace(self.folder / name)
        except OSError:
            with contextlib.suppress(OSError):
                unfinished.unlink(missing_ok=True)
            raise
        self._clear()

    def _path(self, key: str) -> Path:
        assert self.folder is not None  # noqa: S101  # for the reader of types
        return self.folder / f"{key}{SUFFIX}"

    def _clear(self) -> None:
        """Delete what was not used for longest, and what others left unfinished for an hour."""
        assert self.folder is not None  # noqa: S101
        found = []
        for path in self.folder.iterdir():
            if path.suffix in _KEPT or path.name.startswith(_UNFINISHED):
                with contextlib.suppress(OSError):  # another process may be clearing too
                    state = path.stat()
                    found.append((state.st_mtime, state.st_size, path))
        newest = max((when for when, _, _ in found), default=0.0)
        total = 0
        for when, size, path in sorted(found, reverse=True):
            total += size
            forgotten = path.suffix not in _KEPT and when < newest - 3600.0
            if forgotten or (total > self._most_bytes and when < newest):
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)


def default_cache(environment: Mapping[str, str] = os.environ) -> ShapeCache:
    """The cache that the environment names."""
    given = environment.get(ENVIRONMENT)
    if given is not None:
        return ShapeCache(Path(given).expanduser() if given else None)
    base = environment.get("XDG_CACHE_HOME", "")
    if base and Path(base).is_absolute():
        return ShapeCache(Path(base) / "rampe-guard")
    try:
        return ShapeCache(Path.home() / ".cache" / "rampe-guard")
    except RuntimeError:  # a service without a home
        return ShapeCache(None)


def load_shape(
    file: str | Path,
    scale: FloatArray | float = 1.0,
    *,
    name: str | None = None,
    most_m: float = meshes.ZONE_MOST_M,
    cache: ShapeCache | None = None,
    progress: Progress | None = None,
) -> Shape:
    """The shape of a mesh file, from the cache if it is there.

    Args:
        file: mesh file.
        scale: what its coordinates are multiplied by, one or three factors.
        name: what errors call it; the file, if not given.
        most_m: longest side that is believed [m].
        cache: where it may be and will be kept; None for `default_cache`.
        progress: told what is done, and which share of it.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    path = Path(file)
    name = name or str(path)
    factors = np.array(np.broadcast_to(np.asarray(scale, dtype=float), 3))
    if not (np.isfinite(factors).all() and (factors != 0.0).all()):
        raise GeometryError(f"{name}: a scale of {factors.tolist()}; use finite numbers but 0")
    cache = default_cache() if cache is None else cache
    key = _file_key(path, factors)
    shape = None if key is None else cache.get(key)
    if shape is None:
        if progress is not None:
            progress("reading", 0.0)
        mesh = load_mesh(path, factors)
        check_extent(float(np.ptp(mesh.vertices, axis=0).max()), name, most_m)
        # the same content may come under another name next time: notes are kept without
        notes = tuple(note.removeprefix(f"{path}: ") for note in mesh.notes)
        shape = shape_of(dataclasses.replace(mesh, notes=notes), progress)
        # the file may have been replaced between the hash and the reading
        if key is not None and key == _file_key(path, factors):
            cache.put(key, shape)
    elif progress is not None:
        progress("kept from before", 1.0)
    words = check_extent(shape.extent_m, name, most_m)
    notes = (*(f"{name}: {note}" for note in shape.notes), *words)
    return dataclasses.replace(shape, notes=notes)


def cached_shape(
    mesh: TriangleMesh, *, cache: ShapeCache | None = None, progress: Progress | None = None
) -> Shape:
    """The shape of a mesh in hand, such as a link of several parts, from the cache if it is there.

    Notes are those of the mesh.
    """
    cache = default_cache() if cache is None else cache
    digest = hashlib.sha256(_MADE_BY.encode())
    for array in (mesh.vertices.astype("<f8"), mesh.faces.astype("<i8")):
        digest.update(f"{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    key = digest.hexdigest()
    shape = cache.get(key)
    if shape is None:
        shape = shape_of(mesh, progress)
        cache.put(key, shape)
    elif progress is not None:
        progress("kept from before", 1.0)
    return dataclasses.replace(shape, notes=mesh.notes)


def _file_key(path: Path, factors: FloatArray) -> str | None:
    """What names the shape of a file: all bytes of it, its kind, its scale and our version."""
    if path.suffix.lower() not in FORMATS:
        return None  # reading it will say why
    try:
        content = ""
        for part in (path, *companions(path)):
            with part.open("rb") as file:
                content += hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, GeometryError):  # reading it will say why
        return None
    scale = " ".join(factor.hex() for factor in factors.tolist())
    said = f"{_MADE_BY} file {content} {path.suffix.lower()} scale {scale}"
    return hashlib.sha256(said.encode()).hexdigest()
