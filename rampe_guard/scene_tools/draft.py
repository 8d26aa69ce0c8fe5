"""What an importer found: objects for a scene file, meshes to lie beside it, and remarks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from rampe_guard.collision.mesh import TriangleMesh
from rampe_guard.core.events import SYSTEM_ZONE
from rampe_guard.core.scene import SELF_ZONE
from rampe_guard.core.types import FloatArray
from rampe_guard.settings.model import MAX_NAME

_LOCKED: Final = 1e-9


@dataclass(frozen=True, slots=True)
class DraftObject:
    """One object of a scene file.

    Attributes:
        name: of the zone.
        fields: the keys of the scene file but ``name``, with plain values.
        mesh: [m], for an object of type mesh; its ``file`` is not among the fields.
    """

    name: str
    fields: dict[str, Any]
    mesh: TriangleMesh | None = None


@dataclass(frozen=True, slots=True)
class Draft:
    """All that came from a file.

    Attributes:
        objects: in the order of the file, with names of their own.
        notes: sentences on what is remarkable.
    """

    objects: tuple[DraftObject, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Common:
    """What the caller wants of every object.

    Attributes:
        pose: of the file's frame in the world (4, 4) [m].
        margin_m: keep-out distance [m]; None leaves it to the scene.
        ignore_links: links of the arm that may touch.
    """

    pose: FloatArray = field(default_factory=lambda: np.eye(4))
    margin_m: float | None = None
    ignore_links: tuple[str, ...] = ()

    def fields(self, margin_m: float | None = None) -> dict[str, Any]:
        """The keys that every object shares; ``margin_m`` [m] is one that the file itself names."""
        found: dict[str, Any] = {}
        wanted = self.margin_m if margin_m is None else margin_m
        if wanted is not None:
            found["margin_m"] = plain(wanted)
        if self.ignore_links:
            found["ignore_links"] = list(self.ignore_links)
        return found


class Names:
    """Gives every object a name that a scene file can have, and that no other has.

    Args:
        taken: names that are used already.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = {*taken, SYSTEM_ZONE}
        self._next: dict[str, int] = {}

    def new(self, wanted: str, otherwise: str = "object") -> str:
        """``wanted`` as it is if it can be a name, else the nearest that can."""
        text = "".join(c if c.isprintable() else " " for c in wanted).strip() or otherwise
        if text.startswith(SELF_ZONE):
            text = f"zone {text}"
        text = text[:MAX_NAME].strip()
        if text not in self._taken:
            self._taken.add(text)
            return text
        number = self._next.get(text, 2)
        while (name := _numbered(text, number)) in self._taken:
            number += 1
        self._next[text] = number + 1
        self._taken.add(name)
        return name


def _numbered(text: str, number: int) -> str:
    ending = f"-{number}"
    return text[: MAX_NAME - len(ending)].strip() + ending


def plain(value: float) -> float:
    """A number as a person writes it: without the last, meaningless digits, and no -0."""
    return round(float(value), 9) + 0.0


def placed(pose: FloatArray) -> dict[str, list[float]]:
    """A pose (4, 4) [m] as a scene file gives it; what is 0 is left out."""
    found = {"xyz": [plain(v) for v in pose[:3, 3]]}
    rpy = [plain(v) for v in rpy_of(pose[:3, :3])]
    return {**found, "rpy": rpy} if any(rpy) else found


def rpy_of(rotation: FloatArray) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] about the fixed axes of a rotation matrix (3, 3)."""
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if math.hypot(rotation[0, 0], rotation[1, 0]) < _LOCKED:  # roll and yaw turn about one axis
        return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    return roll, pitch, math.atan2(rotation[1, 0], rotation[0, 0])
