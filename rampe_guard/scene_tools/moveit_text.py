"""MoveIt's ``.scene`` text as values: objects, their shapes and poses.

The text as MoveIt writes and reads it::

    NAME OF THE SCENE
    * NAME OF AN OBJECT
    X Y Z                  pose of the object (since 2021; then shapes are relative to it)
    QX QY QZ QW
    SHAPE COUNT
    KIND                   sphere R | box X Y Z | cylinder R L | cone R L | plane A B C D | mesh
    NUMBERS                mesh: VERTICES TRIANGLES, their coordinates, their corners
    X Y Z                  pose of the shape
    QX QY QZ QW
    R G B A                colour
    SUBFRAME COUNT         (since 2021) then for each: its name and pose
    .

Older files have neither the object's pose nor subframes. MoveIt tells them apart by the line after
the first object's name, which is a lone count in an old file; so do we, for each object.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from rampe_guard.core.rotation import rotation_of_quaternion
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError

_WORD: Final = re.compile(r"\S+")
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_COUNT: Final = re.compile(r"\d{1,10}")
_SIZES: Final = {"sphere": 1, "box": 3, "cylinder": 2, "cone": 2, "plane": 4}
_UNIT: Final = 1e-3
"""How far from 1 the length of a quaternion may be: six digits are written."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One shape.

    Attributes:
        kind: ``sphere``, ``box``, ``cylinder``, ``cone``, ``plane`` or ``mesh``.
        sizes: its numbers [m]; of a plane a, b, c, d.
        pose: in the file's frame (4, 4) [m].
        vertices, faces: of a mesh, (v, 3) [m] and (f, 3).
        line: where it stands.
    """

    kind: str
    sizes: tuple[float, ...]
    pose: FloatArray
    vertices: FloatArray
    faces: FloatArray
    line: int


@dataclass(frozen=True, slots=True)
class Item:
    """One collision object: its name, its shapes, the number of its subframes."""

    name: str
    shapes: tuple[Shape, ...]
    subframes: int


def read_text(text: str, file: str) -> tuple[Item, ...]:
    """The objects of a ``.scene`` text.

    Raises:
        GeometryError: with file and line, for anything that MoveIt would not read, too.
    """
    return _Reader(text, file).items()


class _Reader:
    """A text and the place up to which it was read."""

    def __init__(self, text: str, file: str) -> None:
        self._text, self._file, self._at = text, file, 0

    def items(self) -> tuple[Item, ...]:
        self._rest_of_line()  # the scene's name
        found = []
        while (marker := self._word("'*' or '.'")) == "*":
            found.append(self._item())
        if marker != ".":
            raise self._wrong(f"{marker[:40]!r} where '*' (an object) or '.' (the end) was due")
        return tuple(found)

    def _item(self) -> Item:
        name = self._rest_of_line().strip()
        if not name:
            raise self._wrong("an object without a name")
        pose = np.eye(4)
        if len(self._next_line().split()) > 1:
            pose = self._pose()
        count = self._count("shapes")
        shapes = tuple(self._shape(pose) for _ in range(count))
        subframes = 0
        if self._peek() not in {"*", "."}:
            subframes = self._count("subframes")
            for _ in range(subframes):
                self._word("the name of a subframe")
                self._pose()
        return Item(name, shapes, subframes)

    def _shape(self, frame: FloatArray) -> Shape:
        kind = self._word("a shape")
        line = self._line()
        vertices, faces = np.empty((0, 3)), np.empty((0, 3))
        sizes: tuple[float, ...] = ()
        if kind == "mesh":
            shape = self._count("vertices"), self._count("triangles")
            vertices = np.array([self._numbers(3) for _ in range(shape[0])]).reshape(-1, 3)
            faces = np.array([self._corners() for _ in range(shape[1])]).reshape(-1, 3)
        elif kind in _SIZES:
            sizes = self._numbers(_SIZES[kind])
        else:
            raise self._wrong(f"a shape {kind[:40]!r}; known are {', '.join(_SIZES)} and mesh")
        pose = frame @ self._pose()
        self._numbers(4)  # its colour
        return Shape(kind, sizes, pose, vertices, faces, line)

    def _pose(self) -> FloatArray:
        xyz, turn = self._numbers(3), self._numbers(4)
        length = math.hypot(*turn)
        if not abs(length - 1.0) < _UNIT:
            raise self._wrong(f"a quaternion of length {length:.4g}, need 1")
        pose = np.eye(4)
        pose[:3, :3] = rotation_of_quaternion(turn)
        pose[:3, 3] = xyz
        return pose

    def _numbers(self, count: int) -> tuple[float, ...]:
        return tuple(self._number() for _ in range(count))

    def _number(self) -> float:
        word = self._word("a number")
        value = float(word) if _NUMBER.fullmatch(word) else math.nan
        if not math.isfinite(value):
            raise self._wrong(f"{word[:40]!r} where a finite number was due")
        return value

    def _corners(self) -> tuple[int, ...]:
        return tuple(self._count("the corner of a triangle") for _ in range(3))

    def _count(self, what: str) -> int:
        word = self._word(f"a count of {what}")
        if not _COUNT.fullmatch(word):
            raise self._wrong(f"{word[:40]!r} where a count of {what} was due")
        return int(word)

    def _peek(self) -> str:
        found = _WORD.search(self._text, self._at)
        return found.group() if found else "."

    def _word(self, what: str) -> str:
        found = _WORD.search(self._text, self._at)
        if found is None:
            self._at = len(self._text)
            raise self._wrong(f"the file ends where {what} was due: it is cut off")
        self._at = found.end()
        return found.group()

    def _next_line(self) -> str:
        """The next line that is not empty, without reading it."""
        found = _WORD.search(self._text, self._at)
        if found is None:
            return ""
        end = self._text.find("\n", found.start())
        return self._text[found.start() : end if end >= 0 else None]

    def _rest_of_line(self) -> str:
        end = self._text.find("\n", self._at)
        end = len(self._text) if end < 0 else end
        rest, self._at = self._text[self._at : end], end
        return rest

    def _line(self) -> int:
        return self._text.count("\n", 0, self._at) + 1

    def _wrong(self, what: str) -> GeometryError:
        return GeometryError(f"{self._file}:{self._line()}: {what}; export the scene again")
