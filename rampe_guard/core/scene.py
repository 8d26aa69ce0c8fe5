"""Keep-out objects as plain values: what a scene file says, checked, without any mesh loaded.

Poses are 4x4 homogeneous matrices in the world frame [m]. ``margin_m`` is the keep-out
distance round the object [m]; ``ignore_links`` names links that may touch it.

An object with a ``key`` moves: the shape, as the file places it, is given in the object's own
frame, and messages on that key place the frame in the world.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from rampe_guard.core.types import FloatArray, Point

SELF_ZONE = "self:"
"""How the names of self-collision zones begin; the link's name follows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepOut:
    """What every solid keep-out object has.

    ``key``, ``max_speed`` and ``timeout_s`` are for objects that move (never a halfspace):
    the key of their poses, None for all others; how fast any point of them may move unseen
    [m/s]; and for how long a pose may be carried on by that speed [s].
    """

    name: str
    margin_m: float
    ignore_links: tuple[str, ...] = ()
    key: str | None = None
    max_speed: float = 0.0
    timeout_s: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Box(KeepOut):
    """Box with edge lengths ``size_m`` centred on ``pose``."""

    size_m: Point
    pose: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere(KeepOut):
    """Sphere centred on ``center_m``."""

    radius_m: float
    center_m: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder(KeepOut):
    """Cylinder along the z axis of ``pose``, centred on it."""

    radius_m: float
    height_m: float
    pose: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule(KeepOut):
    """All points within ``radius_m`` of the segment from ``start_m`` to ``end_m``."""

    radius_m: float
    start_m: Point
    end_m: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class Halfspace(KeepOut):
    """All x with ``normal``·x <= ``offset_m`` (``normal`` of unit length, pointing out)."""

    normal: Point
    offset_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh(KeepOut):
    """Triangle mesh read from ``file``, scaled by ``scale``, placed at ``pose``.

    ``open``: it is a surface without an inside, such as a scanned terrain; else a solid.
    """

    file: str
    scale: float
    pose: FloatArray
    open: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ActuatorLimit:
    """Zone in actuator space: actuator ``actuator`` (index) above and/or below a value."""

    name: str
    actuator: int
    above: float | None = None
    below: float | None = None


SolidObject: TypeAlias = Box | Sphere | Cylinder | Capsule | Halfspace | Mesh
SceneObject: TypeAlias = SolidObject | ActuatorLimit


@dataclass(frozen=True, slots=True)
class Scene:
    """All zones of a site, names unique, in file order.

    ``path`` is of the scene file, ``text`` what was read, ``content_hash`` of that and all meshes.
    """

    objects: tuple[SceneObject, ...]
    path: str = ""
    content_hash: str = ""
    text: str = ""

    @property
    def moving(self) -> tuple[SolidObject, ...]:
        """The objects whose poses come from a key."""
        return tuple(
            item
            for item in self.objects
            if not isinstance(item, ActuatorLimit) and item.key is not None
        )


@dataclass(frozen=True, slots=True)
class SelfCollision:
    """Whether the arm is swept against itself.

    Attributes:
        enabled: whether it is.
        margin_m: keep-out distance between two of its links [m].
        allow: pairs of links that may touch, beside neighbours.
    """

    enabled: bool = False
    margin_m: float = 0.0
    allow: tuple[tuple[str, str], ...] = ()
