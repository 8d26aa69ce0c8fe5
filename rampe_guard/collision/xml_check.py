"""XML files before a reader gets them: plain elements and attributes, and not too many.

A document type may define entities that unfold without end, or that name files and hosts; neither
a URDF nor a COLLADA file needs one. The readers that we use would decide for themselves.
"""

from __future__ import annotations

from typing import BinaryIO, Final
from xml.parsers import expat

from rampe_guard.errors import GeometryError

MAX_DEPTH: Final = 200
MAX_ELEMENTS: Final = 1_000_000
_PIECE: Final = 2**20


def check_xml(file: BinaryIO, name: str) -> None:
    """Read an XML file to its end, and refuse what is no plain one.

    Args:
        file: open, from its beginning.
        name: what messages call it.

    Raises:
        GeometryError: it is not well-formed, has a document type, or is too large or too deep.
    """
    parser = expat.ParserCreate()
    depth = count = 0

    def begin(_name: str, _attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH:
            raise GeometryError(f"{name}: elements are nested deeper than {MAX_DEPTH} levels")
        if count > MAX_ELEMENTS:
            raise GeometryError(f"{name}: has more than {MAX_ELEMENTS} elements")

    def end(_name: str) -> None:
        nonlocal depth
        depth -= 1

    def refuse(*_: object) -> None:
        raise GeometryError(
            f"{name}:{parser.CurrentLineNumber}: has a document type (<!DOCTYPE…>), which may"
            " name other files or unfold without end; remove it"
        )

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        while piece := file.read(_PIECE):
            parser.Parse(piece, False)  # noqa: FBT003 - its name is isfinal
        parser.Parse(b"", True)  # noqa: FBT003
    except (expat.ExpatError, ValueError) as error:  # ValueError: an unknown encoding
        raise GeometryError(f"{name}: is not well-formed XML: {error}") from None
