"""Point cloud files (LAS, PLY, XYZ text) piece by piece, so that a large one needs no memory."""

from __future__ import annotations

import itertools
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError

MAX_POINTS: Final = 500_000_000
MAX_BYTES: Final = 16 * 2**30
PIECE: Final = 1_000_000
"""Points read at a time."""
FORMATS: Final = (".las", ".laz", ".ply", ".xyz", ".txt", ".csv", ".pts")

_PLY_TYPES: Final = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_HEADER_BYTES: Final = 64 * 1024
_HEADER_LINES: Final = 1000
_SEPARATOR: Final = re.compile(r"[;,]")


def read_points(file: Path) -> Iterator[FloatArray]:
    """The points of a file as pieces (n, 3), in the file's unit, unchecked.

    Raises:
        GeometryError: naming the file and why it cannot be read.
    """
    kind = file.suffix.lower()
    if kind not in FORMATS:
        raise GeometryError(f"{file}: is none of {', '.join(FORMATS)} by its ending; export it so")
    try:
        size = file.stat().st_size
        if size > MAX_BYTES:
            raise GeometryError(f"{file}: {size / 2**30:.0f} GiB; more than 16 are refused, crop")
        if kind in {".las", ".laz"}:
            yield from _las(file)
        elif kind == ".ply":
            yield from _ply(file)
        else:
            yield from _text(file)
    except OSError as error:
        raise GeometryError(f"{file}: cannot be read ({error.strerror or error})") from None


def has_faces(file: Path) -> bool:
    """Whether a PLY file holds triangles, so that it is a mesh and no cloud.

    Raises:
        GeometryError: it is no PLY file.
    """
    try:
        with file.open("rb") as stream:
            return any(name == "face" and count for name, count, _ in _ply_header(stream, file)[1])
    except OSError as error:
        raise GeometryError(f"{file}: cannot be read ({error.strerror or error})") from None


def _las(file: Path) -> Iterator[FloatArray]:
    try:
        import laspy  # noqa: PLC0415 - an extra
    except ImportError:
        raise GeometryError(
            f"{file}: LAS files need laspy: pip install 'rampe-guard[scene]'"
        ) from None
    _check_las(file)
    try:
        with laspy.open(file) as reader:
            _check_count(reader.header.point_count, file)
            for piece in reader.chunk_iterator(PIECE):
                yield np.column_stack([piece.x, piece.y, piece.z]).astype(float, copy=False)
    except (GeometryError, OSError):
        raise
    except Exception as error:  # noqa: BLE001 - it raises whatever it likes on what is no LAS
        packed = "backend" in str(error).lower() or file.suffix.lower() == ".laz"
        advice = "; expand it to LAS (laszip, PDAL), or pip install lazrs" if packed else ""
        raise GeometryError(f"{file}: cannot be read as LAS: {_words(error)}{advice}") from None


def _check_las(file: Path) -> None:
    """Refuse a header whose counts are more than the file can hold: laspy would follow them.

    Raises:
        GeometryError: it is no LAS file, is cut off, or lies about what is in it.
    """
    size = file.stat().st_size
    with file.open("rb") as stream:
        head = stream.read(375)
    if len(head) < _LAS_HEAD or head[:4] != b"LASF":
        raise GeometryError(f"{file}: cannot be read as LAS: it has no LAS header")
    own, start, records, form, width, count = struct.unpack_from("<HIIBHI", head, 94)
    extended = 0
    if head[25] >= 4 and len(head) >= 255:  # noqa: PLR2004 - LAS 1.4, whose header is longer
        extended, count = struct.unpack_from("<IQ", head, 243)
    held = start + (count * width if form < _LAS_COMPRESSED else 0)
    if not (own + 54 * records <= start and held + 60 * extended <= size):
        raise GeometryError(
            f"{file}: cannot be read as LAS: its header names {count} points and"
            f" {records + extended} records, more than its {size} bytes hold: it is cut off"
        )


_LAS_HEAD: Final = 227
_LAS_COMPRESSED: Final = 64
"""Point formats from here on are LAZ."""


def _ply(file: Path) -> Iterator[FloatArray]:
    with file.open("rb") as stream:
        form, elements = _ply_header(stream, file)
        name, count, properties = elements[0]
        if name != "vertex":
            raise GeometryError(f"{file}: its first element is {name[:40]!r}, need vertex")
        _check_count(count, file)
        missing = [axis for axis in "xyz" if axis not in dict(properties)]
        if missing:
            raise GeometryError(f"{file}: its vertices have no {', '.join(missing)}")
        if form == "ascii":
            columns = [[word for word, _ in properties].index(axis) for axis in "xyz"]
            lines = (line.decode("ascii", "replace") for line in stream)
            read = 0
            for points in _rows(itertools.islice(lines, count), file, columns, None):
                read += len(points)
                yield points
            _check_whole(read, count, file)
            return
        order = "<" if form == "binary_little_endian" else ">"
        row = np.dtype([(word, order + kind) for word, kind in properties])
        left = count
        while left:
            content = stream.read(row.itemsize * min(left, PIECE))
            piece: Any = np.frombuffer(content, row, len(content) // row.itemsize)
            if not len(piece):
                _check_whole(count - left, count, file)
            left -= len(piece)
            yield np.column_stack([piece[axis].astype(float) for axis in "xyz"])


def _ply_header(
    stream: IO[bytes], file: Path
) -> tuple[str, list[tuple[str, int, list[tuple[str, str]]]]]:
    """Format, and each element with its count and its properties of fixed size."""
    lines = []
    for _ in range(_HEADER_LINES):
        line = stream.readline(_HEADER_BYTES)
        lines.append(line.decode("ascii", "replace").split())
        if lines[-1] == ["end_header"] or not line:
            break
    form = ""
    elements: list[tuple[str, int, list[tuple[str, str]]]] = []
    if lines[0] != ["ply"] or lines[-1] != ["end_header"]:
        raise GeometryError(f"{file}: is no PLY file (its header is missing or has no end)")
    for words in lines:
        match words:
            case ["format", "ascii" | "binary_little_endian" | "binary_big_endian" as found, _]:
                form = found
            case ["element", name, count] if count.isdecimal() and len(count) < 12:  # noqa: PLR2004
                elements.append((name, int(count), []))
            case ["property", "list", *_] if elements and elements[-1][0] == "vertex":
                raise GeometryError(f"{file}: its vertices hold lists; export plain points")
            case ["property", kind, name] if elements and kind in _PLY_TYPES:
                elements[-1][2].append((name, _PLY_TYPES[kind]))
    if not form or not elements:
        raise GeometryError(f"{file}: is no PLY file that can be read (no format, or no element)")
    return form, elements


def _text(file: Path) -> Iterator[FloatArray]:
    """Lines of x y z and whatever follows, by spaces, tabs, commas or semicolons."""
    with file.open(encoding="ascii", errors="replace") as stream:
        separator, first = None, ""
        for first in stream:
            if _is_data(first):
                break
        else:
            return
        if found := _SEPARATOR.search(first):
            separator = found.group()
        yield from _rows(itertools.chain([first], stream), file, [0, 1, 2], separator)


def _is_data(line: str) -> bool:
    """Whether a line begins with a number: comments, headings and counts of PTS files do not."""
    words = _SEPARATOR.sub(" ", line).split()
    try:
        return len([float(word) for word in words[:3]]) == 3  # noqa: PLR2004 - x, y, z
    except ValueError:
        return False


def _rows(
    lines: Iterator[str], file: Path, columns: list[int], separator: str | None
) -> Iterator[FloatArray]:
    read = 0
    full = (line for line in lines if line.strip())
    while piece := list(itertools.islice(full, PIECE)):
        try:
            points = np.loadtxt(piece, float, usecols=columns, delimiter=separator, ndmin=2)
        except ValueError as error:
            what = str(error).split(";")[0]
            raise GeometryError(
                f"{file}: beyond point {read}: {what}; give lines of x y z"
            ) from None
        read += len(points)
        _check_count(read, file)
        yield points


def _check_count(count: int, file: Path) -> None:
    if count > MAX_POINTS:
        raise GeometryError(f"{file}: {count} points; more than {MAX_POINTS} are refused, thin it")


def _check_whole(read: int, count: int, file: Path) -> None:
    if read != count:
        raise GeometryError(f"{file}: names {count} points and ends after {read}: it is cut off")


def _words(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
