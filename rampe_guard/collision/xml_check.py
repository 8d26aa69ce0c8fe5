"""XML files before a reader gets them: plain elements and attributes, and not too many.

A document type may define entities that unfold without end, or that name files and hosts; neither
a URDF nor a COLLADA file needs one. The readers that we use would decide for themselves.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO, Final
from xml.parsers import expat

from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

MAX_DEPTH: Final = 200
MAX_ELEMENTS: Final = 1_000_000
_PIECE: Final = 2**20


@dataclass(slots=True)
class Element:
    """An element as it stands in the file.

    Attributes:
        tag: with its prefix, if it has one.
        line: on which it begins.
        attributes: by their names.
        children: in the order of the file.
        text: between its tags, that of its children left out.
    """

    tag: str
    line: int
    attributes: Mapping[str, str]
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def get(self, name: str) -> str | None:
        """An attribute; None if it is not there."""
        return self.attributes.get(name)

    def find(self, tag: str) -> Element | None:
        """The first child of this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def all(self, tag: str) -> list[Element]:
        """The children of this tag."""
        return [child for child in self.children if child.tag == tag]

    def walk(self) -> Iterator[Element]:
        """Itself and all below it."""
        yield self
        for child in self.children:
            yield from child.walk()


def check_xml(file: BinaryIO, name: str) -> None:
    """Read an XML file to its end, and refuse what is no plain one.

    Args:
        file: open, from its beginning.
        name: what messages call it.

    Raises:
        GeometryError: it is not well-formed, has a document type, or is too large or too deep.
    """
    _parse(file, name, None)


def read_xml(content: bytes, name: str) -> Element:
    """The root of an XML file, held to the same rules.

    Raises:
        GeometryError: as `check_xml` does.
    """
    found: list[Element] = []
    _parse(io.BytesIO(content), name, found)
    return found[0]


def _parse(file: BinaryIO, name: str, found: list[Element] | None) -> None:
    """Read to the end; ``found`` receives the root."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    _Watch(parser, name, found)
    try:
        while piece := file.read(_PIECE):
            parser.Parse(piece, False)  # noqa: FBT003 - its name is isfinal
        parser.Parse(b"", True)  # noqa: FBT003
    except (expat.ExpatError, ValueError) as error:  # ValueError: an unknown encoding
        raise GeometryError(f"{name}: is not well-formed XML: {error}") from None


class _Watch:
    """Counts what a parser meets, refuses too much of it, and keeps it if somebody wants it."""

    def __init__(self, parser: expat.XMLParserType, name: str, found: list[Element] | None) -> None:
        self._parser, self._name, self._found = parser, name, found
        self._depth = self._count = 0
        self._above: list[Element] = []
        parser.StartElementHandler, parser.EndElementHandler = self._begin, self._end
        parser.StartDoctypeDeclHandler = self._refuse
        if found is not None:
            parser.CharacterDataHandler = self._characters

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth, self._count = self._depth + 1, self._count + 1
        if self._depth > MAX_DEPTH:
            raise GeometryError(f"{self._name}: elements are nested deeper than {MAX_DEPTH} levels")
        if self._count > MAX_ELEMENTS:
            raise GeometryError(f"{self._name}: has more than {MAX_ELEMENTS} elements")
        if self._found is not None:
            element = Element(tag, self._parser.CurrentLineNumber, attributes)
            (self._above[-1].children if self._above else self._found).append(element)
            self._above.append(element)

    def _end(self, _tag: str) -> None:
        self._depth -= 1
        if self._above:
            self._above.pop()

    def _characters(self, text: str) -> None:
        if self._above:
            self._above[-1].text += text

    def _refuse(self, *_: object) -> None:
        raise GeometryError(
            f"{self._name}:{self._parser.CurrentLineNumber}: has a document type (<!DOCTYPE…>),"
            " which may name other files or unfold without end; remove it"
        )
